// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <orbis/core/simd/math.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

/// Rows as long as the input.
template <class T, std::size_t N>
struct functions {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(T* out, const std::vector<T>& in) {
    using V = simd::vec<T, N, Target>;
    for (std::size_t at = 0; at + N <= in.size(); at += N) {
      const V x = V::load(in.data() + at);
      test::rows<T> to{out + at, in.size()};
      to.put(simd::abs(x));
      to.put(-x);
      to.put(simd::sqrt(simd::abs(x)));
      to.put(simd::floor(x));
      to.put(V(least(x)));
      to.put(V(greatest(x)));
    }
  }
};

template <class T, std::size_t N>
struct multiply_adds {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::vector<T>& in, std::vector<T>& out) {
    using V = simd::vec<T, N, Target>;
    for (std::size_t at = 0; at + N <= in.size(); at += N) {
      const V x = V::load(in.data() + at);
      simd::approximate_multiply_add(x, V(T(0.5)), V(T(3))).store(out.data() + at);
      (x * T(0.5) + T(3)).store(out.data() + in.size() + at);
    }
  }
};

template <class T>
[[gnu::noinline]] std::vector<T> expected_functions(const std::vector<T>& in, std::size_t lanes) {
  std::vector<T> out(6 * in.size());
  for (std::size_t i = 0; i != in.size(); ++i) {
    const auto first = in.begin() + static_cast<std::ptrdiff_t>(i / lanes * lanes);
    const auto last = first + static_cast<std::ptrdiff_t>(lanes);
    test::rows<T> to{out.data() + i, in.size()};
    to.put(std::abs(in[i]));
    to.put(-in[i]);
    to.put(std::sqrt(std::abs(in[i])));
    to.put(std::floor(in[i]));
    to.put(*std::min_element(first, last));
    to.put(*std::max_element(first, last));
  }
  return out;
}

template <class T, std::size_t N>
void check_functions(const std::vector<T>& in) {
  test::check_on_every_level<functions<T, N>>(expected_functions(in, N), in);
  for (const simd::level l : simd::available_levels()) {
    INFO("level " << static_cast<int>(l));
    std::vector<T> out(2 * in.size());
    simd::kernel<multiply_adds<T, N>, void(const std::vector<T>&, std::vector<T>&), simd::popcnt, simd::avx2,
                 simd::avx512>(l)(in, out);
    for (std::size_t i = 0; i != in.size(); ++i)
      CHECK(std::abs(out[i] - out[in.size() + i]) <= std::numeric_limits<T>::epsilon() * (std::abs(in[i]) + 3));
  }
}

/// The sums of eight numbers and of 0 ... 15, then for each further number its root and its inverse root.
struct sums_and_roots {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::vector<double>& in, std::vector<double>& out) {
    using V = simd::vec<double, 8, Target>;
    using I = simd::vec<std::int32_t, 16, Target>;
    out.assign({sum(V::load(in.data())), double(sum(I::iota()))});
    for (std::size_t i = 8; i != in.size(); ++i) {
      out.push_back(square_root(V(in[i]))[3]);
      out.push_back(reciprocal_root(V(in[i]))[5]);
    }
  }
};

/// What kernels make of arithmetic, comparisons and roots, to be compared between the levels.
struct mixed_arithmetic {
  static constexpr std::size_t results = 10 * 8 + 10;
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const double* a, const double* b, double* out) {
    using V = simd::vec<double, 8, Target>;
    const V x = V::load(a), y = V::load(b);
    const auto less = x < y, equal = x == y;
    const V r[] = {x + y,
                   x - y,
                   x * y,
                   x / y,
                   x * y + x * x - 3.0 * y,
                   select(less, x, y),
                   select((x <= y) & !equal, V(1.0), V(0.0)),
                   select(less | equal, V(1.0), V(0.0)),
                   reciprocal_root(x * x + 1e-9),
                   square_root(x * x)};
    for (const V& v : r) {
      v.store(out);
      out += V::count;
    }
    for (const V& v : r) *out++ = sum(v);
  }
};

/// Root and inverse root of one number.
struct roots {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(double x, double* out) {
    const simd::vec<double, 8, Target> v(x);
    out[0] = square_root(v)[3];
    out[1] = reciprocal_root(v)[6];
  }
};

bool same_number(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b)); }

}  // namespace

TEST_CASE("functions of vectors are those of their lanes") {
  const auto d = test::numbers<double>(64, 5);
  const auto f = test::numbers<float>(64, 6);
  check_functions<double, 2>(d);
  check_functions<double, 8>(d);
  check_functions<float, 8>(f);
  check_functions<float, 16>(f);
}

TEST_CASE("sums over lanes have one order and roots one series on every target") {
  auto in = test::numbers<double>(64, 7);
  in.resize(8);
  for (const double x : {1e-290, 3e-7, 0.5, 1.0, 2.0, 1e10, 7e289, 0.0}) in.push_back(x);
  for (const simd::level l : simd::available_levels()) {
    INFO("level " << static_cast<int>(l));
    std::vector<double> out;
    simd::kernel<sums_and_roots, void(const std::vector<double>&, std::vector<double>&), simd::popcnt, simd::avx2,
                 simd::avx512>(l)(in, out);
    const double* const v = in.data();
    CHECK(out[0] == ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])));  // N / 2 apart first
    CHECK(out[1] == 120);
    for (std::size_t i = 8; i != in.size(); ++i) {
      const double x = in[i], root = out[2 * i - 14], inverse = out[2 * i - 13];
      CAPTURE(x);
      if (x == 0) {
        CHECK(root == 0.0);
        continue;
      }
      CHECK(std::abs(root - std::sqrt(x)) <= 6e-16 * std::sqrt(x));
      CHECK(std::abs(inverse * std::sqrt(x) - 1) <= 8e-16);
      // Written out for one number.
      double y = std::bit_cast<double>(0x5fe6eb50c7b537a9 - (std::bit_cast<std::int64_t>(x) >> 1));
      for (int k = 0; k != 4; ++k) {
        volatile double half_y = 0.5 * x * y, step = half_y * y;
        y = y * (1.5 - step);
      }
      CHECK(inverse == y);
    }
  }
}

TEST_CASE("arithmetic and roots have the same bits on every level, also of what is not finite") {
  random_bits random(11);
  for (int trial = 0; trial != 200; ++trial) {
    double a[8], b[8];
    for (int i = 0; i != 8; ++i) a[i] = random.uniform(-3, 3), b[i] = random.uniform() < 0.2 ? a[i] : random.normal();
    if (trial == 0) b[3] = std::numeric_limits<double>::quiet_NaN(), a[5] = std::numeric_limits<double>::infinity();
    const auto at = [&](simd::level l, double* out) {
      simd::kernel<mixed_arithmetic, void(const double*, const double*, double*)>(l)(a, b, out);
    };
    double expected[mixed_arithmetic::results];
    at(simd::level::portable, expected);
    for (const simd::level l : simd::available_levels()) {
      double out[mixed_arithmetic::results];
      at(l, out);
      for (std::size_t i = 0; i != mixed_arithmetic::results; ++i) REQUIRE(same_number(out[i], expected[i]));
    }
    for (int i = 0; i != 8; ++i) {
      const double x = a[i], y = b[i];
      CHECK(same_number(expected[i], x + y));
      CHECK(same_number(expected[8 + i], x - y));
      CHECK(same_number(expected[16 + i], x * y));
      CHECK(same_number(expected[24 + i], x / y));
      CHECK(same_number(expected[40 + i], x < y ? x : y));
      CHECK(expected[48 + i] == (x < y ? 1.0 : 0.0));
      CHECK(expected[56 + i] == (x <= y ? 1.0 : 0.0));
      if (!std::isfinite(x)) continue;
      CHECK(expected[64 + i] == Approx(1.0 / std::sqrt(x * x + 1e-9)).epsilon(1e-15));
      CHECK(expected[72 + i] == Approx(std::abs(x)).epsilon(1e-15));
    }
  }
}

TEST_CASE("roots hold over the range of double on every level") {
  for (const simd::level l : simd::available_levels())
    for (double x = 1e-300; x < 1e300; x *= 7.3) {
      double out[2];
      simd::kernel<roots, void(double, double*)>(l)(x, out);
      CHECK(std::abs(out[0] - std::sqrt(x)) <= 4e-16 * std::sqrt(x));
      CHECK(std::abs(out[1] * std::sqrt(x) - 1.0) <= 6e-16);
    }
}

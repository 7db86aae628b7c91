// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <orbis/core/simd/math.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

template <class T, std::size_t N>
struct functions {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::vector<T>& in) {
    using V = simd::vec<T, N, Target>;
    for (std::size_t at = 0; at + N <= in.size(); at += N) {
      const T* const a = in.data() + at;
      const V x = V::load(a);
      test::check_lanes(simd::abs(x), a, a, [](T p, T) { return std::abs(p); });
      test::check_lanes(-x, a, a, [](T p, T) { return -p; });
      test::check_lanes(simd::sqrt(simd::abs(x)), a, a, [](T p, T) { return std::sqrt(std::abs(p)); });
      test::check_lanes(simd::floor(x), a, a, [](T p, T) { return std::floor(p); });
      const V fused = simd::approximate_multiply_add(x, V(T(0.5)), V(T(3)));
      const V reference = x * T(0.5) + T(3);
      for (std::size_t i = 0; i != N; ++i)
        CHECK(std::abs(fused[i] - reference[i]) <= std::numeric_limits<T>::epsilon() * (std::abs(a[i]) + 3));
      CHECK(least(x) == *std::min_element(a, a + N));
      CHECK(greatest(x) == *std::max_element(a, a + N));
    }
  }
};

/// As `core/lanes` summed and rooted: pairs that are N / 2 apart first.
struct sums_and_roots {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::vector<double>& in) {
    using V = simd::vec<double, 8, Target>;
    const double* const v = in.data();
    CHECK(sum(V::load(v)) == ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])));
    using I = simd::vec<std::int32_t, 16, Target>;
    CHECK(sum(I::iota()) == 120);
    for (const double x : {1e-290, 3e-7, 0.5, 1.0, 2.0, 1e10, 7e289}) {
      const double root = square_root(V(x))[3], inverse = reciprocal_root(V(x))[5];
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
    CHECK(square_root(V(0.0))[0] == 0.0);
  }
};

}  // namespace

TEST_CASE("functions of vectors are those of their lanes") {
  const auto d = test::numbers<double>(64, 5);
  const auto f = test::numbers<float>(64, 6);
  test::on_every_level<functions<double, 2>>(d);
  test::on_every_level<functions<double, 8>>(d);
  test::on_every_level<functions<float, 8>>(f);
  test::on_every_level<functions<float, 16>>(f);
}

TEST_CASE("sums over lanes have one order and roots one series on every target") {
  test::on_every_level<sums_and_roots>(test::numbers<double>(64, 7));
}

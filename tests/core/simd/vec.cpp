// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>

#include <orbis/core/simd/vec.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

template <class T>
struct sample {
  std::vector<T> a = test::numbers<T>(256, 1), b = test::numbers<T>(256, 2);
};
template <class T>
using modular = typename simd::detail::modular_of<T>::type;

/// Everything that all kinds of numbers have.
template <class T, std::size_t N>
struct arithmetic {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(T* out, const sample<T>& s) {
    using V = simd::vec<T, N, Target>;
    for (std::size_t at = 0; at + N <= s.a.size(); at += N) {
      const T *const a = s.a.data() + at, *const b = s.b.data() + at;
      const V x = V::load(a), y = V::load(b), second(a[1]);
      test::rows<T> to{out + at, s.a.size()};
      to.put(x + y);
      to.put(x - y);
      to.put(x * y);
      to.put(min(x, y));
      to.put(max(x, y));
      to.put(V(a[0]));
      const auto put = [&](const auto& m) ORBIS_INLINE_LAMBDA {
        to.put(select(m, x, y));
        to.put(select(!m, x, y));
      };
      put(x < y);
      put(x <= y);
      put(x > y);
      put(x >= y);
      put(x == y);
      put(x != y);
      put((x < y) & (x != second));
      put((x < y) | (x == second));
      put((x < y) ^ (x == second));
    }
  }
};

/// What vectors of `lanes` lanes have to make of them.
template <class T>
[[gnu::noinline]] std::vector<T> expected_arithmetic(const sample<T>& s, std::size_t lanes) {
  using U = modular<T>;
  std::vector<T> out(24 * s.a.size());
  for (std::size_t i = 0; i != s.a.size(); ++i) {
    const T p = s.a[i], q = s.b[i], first = s.a[i / lanes * lanes], second = s.a[i / lanes * lanes + 1];
    test::rows<T> to{out.data() + i, s.a.size()};
    to.put(U(U(p) + U(q)));
    to.put(U(U(p) - U(q)));
    if constexpr (std::is_floating_point_v<T>)
      to.put(p * q);
    else
      to.put(U(std::uint64_t(p) * std::uint64_t(q)));
    to.put(std::min(p, q));
    to.put(std::max(p, q));
    to.put(first);
    for (const bool chosen : {p<q, p <= q, p> q, p >= q, p == q, p != q, p < q && p != second, p < q || p == second,
                              (p < q) != (p == second)}) {
      to.put(chosen ? p : q);
      to.put(chosen ? q : p);
    }
  }
  return out;
}

template <class T, std::size_t N>
struct integers {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(T* out, const sample<T>& s) {
    using V = simd::vec<T, N, Target>;
    constexpr int width = 8 * sizeof(T);
    for (std::size_t at = 0; at + N <= s.a.size(); at += N) {
      const V x = V::load(s.a.data() + at), y = V::load(s.b.data() + at);
      const int n = static_cast<int>(at) / 16 % width;
      test::rows<T> to{out + at, s.a.size()};
      to.put(x & y);
      to.put(x | y);
      to.put(x ^ y);
      to.put(~x);
      to.put(x << n);
      to.put(x >> n);
      to.put(x << 3);
      to.put(x >> 3);
      if constexpr (sizeof(T) >= 4) {
        const V each = y & V(T(width - 1));
        to.put(x << each);
        to.put(x >> each);
      }
    }
  }
};

template <class T>
[[gnu::noinline]] std::vector<T> expected_integers(const sample<T>& s, std::size_t lanes) {
  using U = modular<T>;
  constexpr int width = 8 * sizeof(T);
  std::vector<T> out((sizeof(T) >= 4 ? 10 : 8) * s.a.size());
  for (std::size_t i = 0; i != s.a.size(); ++i) {
    const T p = s.a[i], q = s.b[i];
    const int n = static_cast<int>(i / lanes * lanes) / 16 % width;
    test::rows<T> to{out.data() + i, s.a.size()};
    to.put(p & q);
    to.put(p | q);
    to.put(p ^ q);
    to.put(~p);
    to.put(U(U(p) << n));
    to.put(p >> n);
    to.put(U(U(p) << 3));
    to.put(p >> 3);
    if constexpr (sizeof(T) >= 4) {
      to.put(U(U(p) << (q & (width - 1))));
      to.put(p >> (q & (width - 1)));
    }
  }
  return out;
}

template <class T>
void check_type() {
  const sample<T> s;
  const auto check = [&]<std::size_t N>(std::integral_constant<std::size_t, N>) {
    test::check_on_every_level<arithmetic<T, N>>(expected_arithmetic(s, N), s);
    if constexpr (std::is_integral_v<T> && (N == 16 / sizeof(T) || N == 64 / sizeof(T)))
      test::check_on_every_level<integers<T, N>>(expected_integers(s, N), s);
  };
  check(std::integral_constant<std::size_t, 16 / sizeof(T)>{});
  check(std::integral_constant<std::size_t, 32 / sizeof(T)>{});
  check(std::integral_constant<std::size_t, 64 / sizeof(T)>{});
  check(std::integral_constant<std::size_t, 128 / sizeof(T)>{});
  if constexpr (sizeof(T) <= 4) check(std::integral_constant<std::size_t, 8 / sizeof(T)>{});
}

}  // namespace

TEST_CASE("vectors of floating-point numbers do lane by lane what numbers do") {
  check_type<double>();
  check_type<float>();
}
TEST_CASE("vectors of wide integers do lane by lane what numbers do") {
  check_type<std::int64_t>();
  check_type<std::uint64_t>();
  check_type<std::int32_t>();
  check_type<std::uint32_t>();
}
TEST_CASE("vectors of narrow integers do lane by lane what numbers do") {
  check_type<std::int16_t>();
  check_type<std::uint16_t>();
  check_type<std::int8_t>();
  check_type<std::uint8_t>();
}

namespace {

/// Rows of 20, of which the vector fills 16.
struct partial_memory {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(float* out, const std::vector<float>& in) {
    using V = simd::vec<float, 16, Target>;
    std::fill(out, out + std::size_t{34} * 20, -7.0F);
    test::rows<float> to{out, 20};
    for (std::size_t n = 0; n <= 16; ++n) to.put(V::load(in.data(), n));
    for (std::size_t n = 0; n <= 16; ++n, to.to += 20) V::load(in.data()).store(to.to, n);
  }
};

/// The first n of N numbers, for every n.
template <class T, std::size_t N>
struct first_lanes {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(T* out, const std::vector<T>& in) {
    test::rows<T> to{out, N};
    for (std::size_t n = 0; n <= N; ++n) to.put(simd::vec<T, N, Target>::load(in.data(), n));
  }
};
template <class T, std::size_t N>
void check_first_lanes() {
  std::vector<T> in, expected;
  for (std::size_t i = 0; i != N; ++i) in.push_back(static_cast<T>(i + 3));
  for (std::size_t n = 0; n <= N; ++n)
    for (std::size_t i = 0; i != N; ++i) expected.push_back(i < n ? in[i] : T{});
  test::check_on_every_level<first_lanes<T, N>>(expected, in);
}

struct parts {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(float* out, const std::vector<float>& in) {
    using V = simd::vec<float, 16, Target>;
    const V v = V::load(in.data());
    const auto words = simd::bits_as<std::uint64_t>(v);
    static_assert(decltype(words)::count == 8);
    test::rows<float> to{out, 16};
    for (std::size_t i = 0; i != 16; ++i) out[i] = v[i];
    to.to += 16;
    to.put(V::iota());
    v.low().store(to.to);
    v.high().store(to.to + 8);
    to.to += 16;
    to.put(V(v.high(), v.low()));
    to.put(simd::bits_as<float>(words));
  }
};

/// (1 + 2^-30) (1 - 2^-30) = 1 - 2^-60, which rounds to 1: a fused multiply-add would leave the rest.
struct products {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(double* out, const std::array<double, 2>& p) {
    using V = simd::vec<double, 8, Target>;
    const V x = p[0], y = p[1];
    (x * y - 1.0).store(out);
    (-1.0 + y * x).store(out + 8);
  }
};

}  // namespace

TEST_CASE("vectors read and write as many numbers as they are told") {
  const auto in = test::numbers<float>(64, 3);
  std::vector<float> expected;
  for (std::size_t n = 0; n <= 16; ++n)
    for (std::size_t i = 0; i != 20; ++i) expected.push_back(i < n ? in[i] : i < 16 ? 0.0F : -7.0F);
  for (std::size_t n = 0; n <= 16; ++n)
    for (std::size_t i = 0; i != 20; ++i) expected.push_back(i < n ? in[i] : -7.0F);
  test::check_on_every_level<partial_memory>(expected, in);
}

TEST_CASE("vectors give their lanes and halves") {
  const auto in = test::numbers<float>(64, 3);
  std::vector<float> expected(80);
  for (std::size_t i = 0; i != 16; ++i) {
    test::rows<float> to{expected.data() + i, 16};
    to.put(in[i]);
    to.put(static_cast<float>(i));
    to.put(in[i]);
    to.put(in[(i + 8) % 16]);
    to.put(in[i]);
  }
  test::check_on_every_level<parts>(expected, in);
}

TEST_CASE("the first lanes are loaded and the others are zero") {
  check_first_lanes<float, 8>();
  check_first_lanes<float, 16>();
  check_first_lanes<double, 4>();
  check_first_lanes<double, 8>();
  check_first_lanes<std::int32_t, 8>();
  check_first_lanes<std::uint64_t, 4>();
  check_first_lanes<std::int16_t, 16>();
}

TEST_CASE("a product is rounded before it is added to") {
  test::check_on_every_level<products>(std::vector<double>(16, 0.0),
                                       std::array<double, 2>{1.0 + 0x1p-30, 1.0 - 0x1p-30});
}

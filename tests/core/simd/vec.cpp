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

/// Everything that all kinds of numbers have.
template <class T, std::size_t N>
struct arithmetic {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const sample<T>& s) {
    using V = simd::vec<T, N, Target>;
    using U = typename simd::detail::modular_of<T>::type;
    for (std::size_t at = 0; at + N <= s.a.size(); at += N) {
      const T *const a = s.a.data() + at, *const b = s.b.data() + at;
      const V x = V::load(a), y = V::load(b);
      test::check_lanes(x + y, a, b, [](T p, T q) { return U(U(p) + U(q)); });
      test::check_lanes(x - y, a, b, [](T p, T q) { return U(U(p) - U(q)); });
      test::check_lanes(x * y, a, b, [](T p, T q) {
        if constexpr (std::is_floating_point_v<T>)
          return p * q;
        else
          return U(std::uint64_t(p) * std::uint64_t(q));
      });
      test::check_lanes(min(x, y), a, b, [](T p, T q) { return std::min(p, q); });
      test::check_lanes(max(x, y), a, b, [](T p, T q) { return std::max(p, q); });
      test::check_lanes(V(a[0]), a, b, [&](T, T) { return a[0]; });
      const auto check = [&](const auto& m, const auto& expected) ORBIS_INLINE_LAMBDA {
        test::check_lanes(select(m, x, y), a, b, [&](T p, T q) { return expected(p, q) ? p : q; });
        test::check_lanes(select(!m, x, y), a, b, [&](T p, T q) { return expected(p, q) ? q : p; });
      };
      check(x < y, [](T p, T q) { return p < q; });
      check(x <= y, [](T p, T q) { return p <= q; });
      check(x > y, [](T p, T q) { return p > q; });
      check(x >= y, [](T p, T q) { return p >= q; });
      check(x == y, [](T p, T q) { return p == q; });
      check(x != y, [](T p, T q) { return p != q; });
      check((x < y) & (x != V(a[1])), [&](T p, T q) { return p < q && p != a[1]; });
      check((x < y) | (x == V(a[1])), [&](T p, T q) { return p < q || p == a[1]; });
      check((x < y) ^ (x == V(a[1])), [&](T p, T q) { return (p < q) != (p == a[1]); });
    }
  }
};

template <class T, std::size_t N>
struct integers {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const sample<T>& s) {
    using V = simd::vec<T, N, Target>;
    using U = typename simd::detail::modular_of<T>::type;
    constexpr int width = 8 * sizeof(T);
    for (std::size_t at = 0; at + N <= s.a.size(); at += N) {
      const T *const a = s.a.data() + at, *const b = s.b.data() + at;
      const V x = V::load(a), y = V::load(b);
      test::check_lanes(x & y, a, b, [](T p, T q) { return p & q; });
      test::check_lanes(x | y, a, b, [](T p, T q) { return p | q; });
      test::check_lanes(x ^ y, a, b, [](T p, T q) { return p ^ q; });
      test::check_lanes(~x, a, b, [](T p, T) { return ~p; });
      const int n = static_cast<int>(at) / 16 % width;
      test::check_lanes(x << n, a, b, [&](T p, T) { return U(U(p) << n); });
      test::check_lanes(x >> n, a, b, [&](T p, T) { return p >> n; });
      test::check_lanes(x << 3, a, b, [&](T p, T) { return U(U(p) << 3); });
      test::check_lanes(x >> 3, a, b, [&](T p, T) { return p >> 3; });
      if constexpr (sizeof(T) >= 4) {
        const V each = y & V(T(width - 1));
        test::check_lanes(x << each, a, b, [&](T p, T q) { return U(U(p) << (q & (width - 1))); });
        test::check_lanes(x >> each, a, b, [&](T p, T q) { return p >> (q & (width - 1)); });
      }
    }
  }
};

template <class T>
void check_type() {
  const sample<T> s;
  test::on_every_level<arithmetic<T, 16 / sizeof(T)>>(s);
  test::on_every_level<arithmetic<T, 32 / sizeof(T)>>(s);
  test::on_every_level<arithmetic<T, 64 / sizeof(T)>>(s);
  test::on_every_level<arithmetic<T, 128 / sizeof(T)>>(s);
  if constexpr (sizeof(T) <= 4) test::on_every_level<arithmetic<T, 8 / sizeof(T)>>(s);
  if constexpr (std::is_integral_v<T>) {
    test::on_every_level<integers<T, 16 / sizeof(T)>>(s);
    test::on_every_level<integers<T, 64 / sizeof(T)>>(s);
  }
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

struct places {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::vector<float>& in) {
    using V = simd::vec<float, 16, Target>;
    std::array<float, 20> out;
    for (std::size_t n = 0; n <= 16; ++n) {
      out.fill(-7);
      V::load(in.data(), n).store(out.data());
      for (std::size_t i = 0; i != 20; ++i) CHECK(out[i] == (i < n ? in[i] : i < 16 ? 0.0F : -7.0F));
      out.fill(-7);
      V::load(in.data()).store(out.data(), n);
      for (std::size_t i = 0; i != 20; ++i) CHECK(out[i] == (i < n ? in[i] : -7.0F));
    }
    const V v = V::load(in.data());
    for (std::size_t i = 0; i != 16; ++i) {
      CHECK(v[i] == in[i]);
      CHECK(V::iota()[i] == static_cast<float>(i));
      CHECK((i < 8 ? v.low()[i] : v.high()[i - 8]) == in[i]);
      CHECK(V(v.high(), v.low())[i] == in[(i + 8) % 16]);
    }
    const auto words = simd::bits_as<std::uint64_t>(v);
    CHECK(simd::bits_as<float>(words)[5] == in[5]);
    CHECK(words.count == 8);
  }
};

/// (1 + 2^-30) (1 - 2^-30) = 1 - 2^-60, which rounds to 1: a fused multiply-add would leave the rest.
struct products {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::array<double, 2>& p) {
    using V = simd::vec<double, 8, Target>;
    const V x = p[0], y = p[1];
    CHECK((x * y - 1.0)[3] == 0.0);
    CHECK((-1.0 + y * x)[6] == 0.0);
  }
};

}  // namespace

TEST_CASE("vectors read and write as many numbers as they are told") {
  test::on_every_level<places>(test::numbers<float>(64, 3));
}

TEST_CASE("a product is rounded before it is added to") {
  test::on_every_level<products>(std::array<double, 2>{1.0 + 0x1p-30, 1.0 - 0x1p-30});
}

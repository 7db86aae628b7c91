// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <orbis/core/simd/convert.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

template <class U, class T, std::size_t N>
struct conversion {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(U* out, const std::vector<T>& in) {
    for (std::size_t at = 0; at + N <= in.size(); at += N)
      simd::convert<U>(simd::vec<T, N, Target>::load(in.data() + at)).store(out + at);
  }
};

template <class U, class T>
[[gnu::noinline]] std::vector<U> converted(const std::vector<T>& in) {
  std::vector<U> out(in.size());
  std::transform(in.begin(), in.end(), out.begin(), [](T x) { return static_cast<U>(x); });
  return out;
}

template <class U, class T>
void check_conversion() {
  auto in = test::numbers<T>(128, 11);
  if constexpr (std::is_floating_point_v<T>)
    for (T& x : in) x = std::clamp(x, std::is_unsigned_v<U> ? T(0) : T(-100), T(100));
  const std::vector<U> expected = converted<U>(in);
  test::check_on_every_level<conversion<U, T, 4>>(expected, in);
  test::check_on_every_level<conversion<U, T, 8>>(expected, in);
  test::check_on_every_level<conversion<U, T, 16>>(expected, in);
  if constexpr (sizeof(T) < 4 || sizeof(U) < 4) test::check_on_every_level<conversion<U, T, 64>>(expected, in);
}

template <std::size_t From, std::size_t To, std::size_t N>
struct mask_conversion {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(std::uint64_t* out, const std::vector<std::uint64_t>& patterns) {
    for (std::size_t i = 0; i != patterns.size(); ++i)
      out[i] = bits(simd::mask_as<To>(simd::mask<From, N, Target>::from_bits(patterns[i])));
  }
};

template <std::size_t From, std::size_t To, std::size_t N>
void check_mask_conversion() {
  const std::vector<std::uint64_t> patterns{0x0, 0x1, 0xa5c3, 0xffff};
  std::vector<std::uint64_t> expected = patterns;
  for (auto& p : expected) p &= (std::uint64_t{1} << N) - 1;
  test::check_on_every_level<mask_conversion<From, To, N>>(expected, patterns);
}

}  // namespace

TEST_CASE("conversions of vectors to wider numbers") {
  check_conversion<std::uint16_t, std::uint8_t>();
  check_conversion<std::int16_t, std::int8_t>();
  check_conversion<std::int32_t, std::uint8_t>();
  check_conversion<std::int32_t, std::int8_t>();
  check_conversion<std::int64_t, std::uint8_t>();
  check_conversion<std::int32_t, std::int16_t>();
  check_conversion<std::uint32_t, std::uint16_t>();
  check_conversion<std::uint64_t, std::uint16_t>();
  check_conversion<std::int64_t, std::int32_t>();
  check_conversion<std::uint64_t, std::uint32_t>();
}
TEST_CASE("conversions of vectors to narrower numbers") {
  check_conversion<std::uint8_t, std::uint16_t>();
  check_conversion<std::uint8_t, std::int32_t>();
  check_conversion<std::int16_t, std::int32_t>();
  check_conversion<std::int32_t, std::int64_t>();
}
TEST_CASE("conversions of vectors from and to floating-point numbers") {
  check_conversion<double, float>();
  check_conversion<float, std::int32_t>();
  check_conversion<float, std::uint32_t>();
  check_conversion<float, std::uint8_t>();
  check_conversion<float, std::uint16_t>();
  check_conversion<double, std::int32_t>();
  check_conversion<std::int32_t, float>();
  check_conversion<std::int32_t, double>();
  check_conversion<std::uint8_t, float>();
}
TEST_CASE("a vector of doubles is rounded to floats") {
  const std::vector<double> in{0.1, 1.0 / 3.0, -1e-3, 1e30, 0.0, 7.0, -2.5, 1e-30};
  test::check_on_every_level<conversion<float, double, 2>>(converted<float>(in), in);
  test::check_on_every_level<conversion<float, double, 8>>(converted<float>(in), in);
}
TEST_CASE("masks for numbers of other sizes") {
  check_mask_conversion<4, 8, 4>();
  check_mask_conversion<8, 4, 8>();
  check_mask_conversion<4, 8, 16>();
  check_mask_conversion<1, 4, 16>();
  check_mask_conversion<2, 1, 16>();
}

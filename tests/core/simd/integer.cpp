// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <bit>

#include <orbis/core/simd/integer.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

template <class T>
struct sample {
  std::vector<T> a = test::numbers<T>(256, 41), b = test::numbers<T>(256, 42);
};

template <class T, std::size_t N>
struct saturated {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const sample<T>& s) {
    using V = simd::vec<T, N, Target>;
    for (std::size_t at = 0; at != s.a.size(); at += N) {
      const T *const a = s.a.data() + at, *const b = s.b.data() + at;
      const V x = V::load(a), y = V::load(b);
      test::check_lanes(add_saturated(x, y), a, b,
                        [](T p, T q) { return std::min<int>(p + q, std::numeric_limits<T>::max()); });
      test::check_lanes(subtract_saturated(x, y), a, b, [](T p, T q) { return std::max(p - q, 0); });
      test::check_lanes(average(x, y), a, b, [](T p, T q) { return (p + q + 1) / 2; });
    }
  }
};

template <std::size_t N>
struct products {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const sample<std::int16_t>& s) {
    using V = simd::vec<std::int16_t, N, Target>;
    for (std::size_t at = 0; at != s.a.size(); at += N) {
      const auto out = multiply_add_pairs(V::load(s.a.data() + at), V::load(s.b.data() + at));
      for (std::size_t i = 0; i != N / 2; ++i) {
        const std::size_t j = at + 2 * i;
        CHECK(out[i] == s.a[j] * s.b[j] + s.a[j + 1] * s.b[j + 1]);
      }
    }
  }
};

template <std::size_t N>
struct byte_products {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const sample<std::uint8_t>& s) {
    using V = simd::vec<std::uint8_t, N, Target>;
    for (std::size_t at = 0; at != s.a.size(); at += N) {
      const V half = V::load(s.b.data() + at) >> 2;  // up to 63: what comes out fits
      const auto weights = simd::bits_as<std::int8_t>(half) - simd::vec<std::int8_t, N, Target>(31);
      const auto out = multiply_add_pairs(V::load(s.a.data() + at), weights);
      for (std::size_t i = 0; i != N / 2; ++i) {
        const std::size_t j = at + 2 * i;
        CHECK(out[i] == s.a[j] * weights[2 * i] + s.a[j + 1] * weights[2 * i + 1]);
      }
    }
  }
};

template <std::size_t N>
struct narrowing {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const sample<std::int16_t>& s) {
    using V = simd::vec<std::int16_t, N, Target>;
    const auto out = narrow_in_blocks(V::load(s.a.data()), V::load(s.b.data()));
    for (std::size_t i = 0; i != 2 * N; ++i) {
      const std::size_t j = i / 16 * 8 + i % 8;
      CHECK(out[i] == std::clamp<int>(i % 16 < 8 ? s.a[j] : s.b[j], 0, 255));
    }
    const auto x = simd::vec<std::uint8_t, 2 * N, Target>::iota(), zero = x - x;
    const auto low = simd::bits_as<std::int16_t>(zip_low_in_blocks(x, zero));
    const auto high = simd::bits_as<std::int16_t>(zip_high_in_blocks(x, zero));
    if constexpr (std::endian::native == std::endian::little) CHECK(all(narrow_in_blocks(low, high) == x));
  }
};

template <std::size_t N>
struct bit_counts {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const sample<std::uint64_t>& s) {
    using V = simd::vec<std::uint64_t, N, Target>;
    for (std::size_t at = 0; at != s.a.size(); at += N)
      test::check_lanes(count_bits(V::load(s.a.data() + at)), s.a.data() + at, s.a.data() + at,
                        [](std::uint64_t p, std::uint64_t) { return std::popcount(p); });
  }
};

}  // namespace

TEST_CASE("sums, differences and averages of small numbers do not overflow") {
  const sample<std::uint8_t> bytes;
  test::on_every_level<saturated<std::uint8_t, 8>>(bytes);
  test::on_every_level<saturated<std::uint8_t, 16>>(bytes);
  test::on_every_level<saturated<std::uint8_t, 64>>(bytes);
  const sample<std::uint16_t> words;
  test::on_every_level<saturated<std::uint16_t, 8>>(words);
  test::on_every_level<saturated<std::uint16_t, 32>>(words);
}
TEST_CASE("products of neighbouring lanes are added") {
  auto words = sample<std::int16_t>{};
  for (auto& x : words.a) x = std::max<std::int16_t>(x, -32767);  // twice its square does not fit into 32 bits
  test::on_every_level<products<8>>(words);
  test::on_every_level<products<32>>(words);
  const sample<std::uint8_t> bytes;
  test::on_every_level<byte_products<16>>(bytes);
  test::on_every_level<byte_products<64>>(bytes);
}
TEST_CASE("two vectors of words become one of bytes") {
  const sample<std::int16_t> words;
  test::on_every_level<narrowing<8>>(words);
  test::on_every_level<narrowing<32>>(words);
}
TEST_CASE("the ones of each lane are counted") {
  const sample<std::uint64_t> words;
  test::on_every_level<bit_counts<2>>(words);
  test::on_every_level<bit_counts<8>>(words);
}

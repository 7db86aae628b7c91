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
  static ORBIS_ALWAYS_INLINE void run(T* out, const sample<T>& s) {
    using V = simd::vec<T, N, Target>;
    for (std::size_t at = 0; at != s.a.size(); at += N) {
      const V x = V::load(s.a.data() + at), y = V::load(s.b.data() + at);
      test::rows<T> to{out + at, s.a.size()};
      to.put(add_saturated(x, y));
      to.put(subtract_saturated(x, y));
      to.put(average(x, y));
    }
  }
};

template <class T>
[[gnu::noinline]] std::vector<T> expected_saturated(const sample<T>& s) {
  std::vector<T> out(3 * s.a.size());
  for (std::size_t i = 0; i != s.a.size(); ++i) {
    const T p = s.a[i], q = s.b[i];
    test::rows<T> to{out.data() + i, s.a.size()};
    to.put(std::min<int>(p + q, std::numeric_limits<T>::max()));
    to.put(std::max(p - q, 0));
    to.put((p + q + 1) / 2);
  }
  return out;
}

template <std::size_t N>
struct products {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(std::int32_t* out, const sample<std::int16_t>& s) {
    using V = simd::vec<std::int16_t, N, Target>;
    for (std::size_t at = 0; at != s.a.size(); at += N)
      multiply_add_pairs(V::load(s.a.data() + at), V::load(s.b.data() + at)).store(out + at / 2);
  }
};

template <std::size_t N>
struct byte_products {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(std::int16_t* out, const sample<std::uint8_t>& s) {
    using V = simd::vec<std::uint8_t, N, Target>;
    for (std::size_t at = 0; at != s.a.size(); at += N) {
      const V half = V::load(s.b.data() + at) >> 2;  // up to 63: what comes out fits
      const auto weights = simd::bits_as<std::int8_t>(half) - simd::vec<std::int8_t, N, Target>(31);
      multiply_add_pairs(V::load(s.a.data() + at), weights).store(out + at / 2);
    }
  }
};

/// Two vectors of words narrowed; then 0, 1, 2 ... as words, narrowed again.
template <std::size_t N>
struct narrowing {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(std::uint8_t* out, const sample<std::int16_t>& s) {
    using V = simd::vec<std::int16_t, N, Target>;
    narrow_in_blocks(V::load(s.a.data()), V::load(s.b.data())).store(out);
    const auto x = simd::vec<std::uint8_t, 2 * N, Target>::iota(), zero = x - x;
    const auto low = simd::bits_as<std::int16_t>(zip_low_in_blocks(x, zero));
    const auto high = simd::bits_as<std::int16_t>(zip_high_in_blocks(x, zero));
    if constexpr (std::endian::native == std::endian::little) narrow_in_blocks(low, high).store(out + 2 * N);
  }
};

template <std::size_t N>
void check_narrowing() {
  const sample<std::int16_t> s;
  std::vector<std::uint8_t> expected(4 * N);
  for (std::size_t i = 0; i != 2 * N; ++i) {
    const std::size_t j = i / 16 * 8 + i % 8;
    expected[i] = static_cast<std::uint8_t>(std::clamp<int>(i % 16 < 8 ? s.a[j] : s.b[j], 0, 255));
    if constexpr (std::endian::native == std::endian::little) expected[2 * N + i] = static_cast<std::uint8_t>(i);
  }
  test::check_on_every_level<narrowing<N>>(expected, s);
}

template <std::size_t N>
struct bit_counts {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(std::uint64_t* out, const std::vector<std::uint64_t>& in) {
    using V = simd::vec<std::uint64_t, N, Target>;
    for (std::size_t at = 0; at != in.size(); at += N) count_bits(V::load(in.data() + at)).store(out + at);
  }
};

}  // namespace

TEST_CASE("sums, differences and averages of small numbers do not overflow") {
  const sample<std::uint8_t> bytes;
  const auto of_bytes = expected_saturated(bytes);
  test::check_on_every_level<saturated<std::uint8_t, 8>>(of_bytes, bytes);
  test::check_on_every_level<saturated<std::uint8_t, 16>>(of_bytes, bytes);
  test::check_on_every_level<saturated<std::uint8_t, 64>>(of_bytes, bytes);
  const sample<std::uint16_t> words;
  const auto of_words = expected_saturated(words);
  test::check_on_every_level<saturated<std::uint16_t, 8>>(of_words, words);
  test::check_on_every_level<saturated<std::uint16_t, 32>>(of_words, words);
}
TEST_CASE("products of neighbouring lanes are added") {
  auto words = sample<std::int16_t>{};
  for (auto& x : words.a) x = std::max<std::int16_t>(x, -32767);  // twice its square does not fit into 32 bits
  std::vector<std::int32_t> of_words;
  for (std::size_t j = 0; j != words.a.size(); j += 2)
    of_words.push_back(words.a[j] * words.b[j] + words.a[j + 1] * words.b[j + 1]);
  test::check_on_every_level<products<8>>(of_words, words);
  test::check_on_every_level<products<32>>(of_words, words);
  const sample<std::uint8_t> bytes;
  std::vector<std::int16_t> of_bytes;
  const auto weight = [&](std::size_t j) { return bytes.b[j] / 4 - 31; };
  for (std::size_t j = 0; j != bytes.a.size(); j += 2)
    of_bytes.push_back(static_cast<std::int16_t>(bytes.a[j] * weight(j) + bytes.a[j + 1] * weight(j + 1)));
  test::check_on_every_level<byte_products<16>>(of_bytes, bytes);
  test::check_on_every_level<byte_products<64>>(of_bytes, bytes);
}
TEST_CASE("two vectors of words become one of bytes") {
  check_narrowing<8>();
  check_narrowing<32>();
}
TEST_CASE("the ones of each lane are counted") {
  const sample<std::uint64_t> words;
  std::vector<std::uint64_t> expected;
  for (const std::uint64_t x : words.a) expected.push_back(static_cast<std::uint64_t>(std::popcount(x)));
  test::check_on_every_level<bit_counts<2>>(expected, words.a);
  test::check_on_every_level<bit_counts<8>>(expected, words.a);
}

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Hamming distances with one train per vector lane; the insides of `hamming_nearest`.
///
/// Sixteen trains are transposed into rows of 32-bit words, so that a query's word, broadcast, meets
/// sixteen trains at once and no sum across lanes is needed. Distance and index form one key,
/// distance first: the smallest key is the nearest with the lowest index, and two minima and a
/// maximum per step keep the two nearest of each lane.
///
/// Where there is no instruction that counts bits in lanes, the eight words of a lane are first
/// added bitwise by a tree of full and half adders, which leaves four counts by table instead of
/// eight (Harley-Seal; Mula, Kurz, Lemire, "Faster population counts using AVX2 instructions", 2018).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/nearest.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::features::detail {

inline constexpr unsigned lane_index_bits = 22;  // leaves 10 for the distance
inline constexpr std::size_t most_in_lanes = (std::size_t{1} << lane_index_bits) - 1;
inline constexpr std::uint32_t no_key = std::numeric_limits<std::uint32_t>::max();

struct alignas(64) lane_row {
  std::array<std::uint32_t, 16> lane{};
};

/// Sixteen trains, word by word, and their indices (`no_key` in lanes that hold none).
struct lane_group {
  std::array<lane_row, 8> words;
  lane_row index;
};

/// The smallest and second smallest key.
struct two_keys {
  std::uint32_t best = no_key;
  std::uint32_t second = no_key;
  constexpr void insert(std::uint32_t key) noexcept {
    second = std::min(second, std::max(best, key));
    best = std::min(best, key);
  }
};

/// Compares one query with some groups. `reverse`: null, or one row of keys (distance, query) per group.
using lane_pass = two_keys(const binary_descriptor<256>& query, std::uint32_t query_index, const lane_group* groups,
                           std::size_t count, lane_row* reverse);

[[nodiscard]] inline std::vector<lane_group> transposed(std::span<const binary_descriptor<256>> trains) {
  std::vector<lane_group> groups((trains.size() + 15) / 16);
  for (std::size_t t = 0; t != groups.size() * 16; ++t) {
    lane_group& group = groups[t / 16];
    const bool real = t < trains.size();
    group.index.lane[t % 16] = real ? static_cast<std::uint32_t>(t) : no_key;
    for (std::size_t w = 0; real && w != 4; ++w) {
      group.words[2 * w].lane[t % 16] = static_cast<std::uint32_t>(trains[t].words[w]);
      group.words[2 * w + 1].lane[t % 16] = static_cast<std::uint32_t>(trains[t].words[w] >> 32U);
    }
  }
  return groups;
}

/// `hamming_nearest` with a vector kernel. Trains are taken in blocks that stay in the first-level cache.
/// @pre queries and trains number at most most_in_lanes
inline void nearest_in_lanes(lane_pass* pass, std::span<const binary_descriptor<256>> queries,
                             std::span<const binary_descriptor<256>> trains, std::span<nearest_two> nearest,
                             std::span<std::uint32_t> reverse) {
  constexpr std::size_t block = 32;
  const std::vector<lane_group> groups = transposed(trains);
  std::vector<lane_row> reverse_keys(reverse.empty() ? 0 : groups.size());
  for (lane_row& row : reverse_keys) row.lane.fill(no_key);
  std::vector<two_keys> keys(queries.size());
  for (std::size_t begin = 0; begin < groups.size(); begin += block) {
    const std::size_t count = std::min(block, groups.size() - begin);
    lane_row* const reverse_block = reverse.empty() ? nullptr : reverse_keys.data() + begin;
    for (std::size_t q = 0; q != queries.size(); ++q) {
      const two_keys found =
          pass(queries[q], static_cast<std::uint32_t>(q), groups.data() + begin, count, reverse_block);
      keys[q].insert(found.best);
      keys[q].insert(found.second);
    }
  }

  constexpr std::uint32_t index_mask = (1U << lane_index_bits) - 1;
  for (std::size_t q = 0; q != queries.size(); ++q) {
    nearest[q] = {};
    if (keys[q].best != no_key) {
      nearest[q].index = keys[q].best & index_mask;
      nearest[q].distance = keys[q].best >> lane_index_bits;
    }
    if (keys[q].second != no_key) nearest[q].second_distance = keys[q].second >> lane_index_bits;
  }
  for (std::size_t t = 0; t != reverse.size() && !queries.empty(); ++t)
    reverse[t] = reverse_keys[t / 16].lane[t % 16] & index_mask;
}

#if ORBIS_X86

[[nodiscard]] inline std::uint32_t query_word(const binary_descriptor<256>& query, std::size_t w) noexcept {
  return static_cast<std::uint32_t>(query.words[w / 2] >> (32 * (w % 2)));
}

[[nodiscard]] inline two_keys reduce(const std::uint32_t* best, const std::uint32_t* second,
                                     std::size_t lanes) noexcept {
  two_keys keys;
  for (std::size_t i = 0; i != lanes; ++i) {
    keys.insert(best[i]);
    keys.second = std::min(keys.second, second[i]);
  }
  return keys;
}

// -- AVX2: eight lanes, so each group in two halves -------------------------------------------------

struct sum_avx2 {
  __m256i sum, carry;
};
ORBIS_TARGET("avx2") inline sum_avx2 add_avx2(__m256i a, __m256i b, __m256i c) noexcept {
  const __m256i either = _mm256_xor_si256(a, b);
  return {_mm256_xor_si256(either, c), _mm256_or_si256(_mm256_and_si256(a, b), _mm256_and_si256(either, c))};
}
ORBIS_TARGET("avx2") inline sum_avx2 add_avx2(__m256i a, __m256i b) noexcept {
  return {_mm256_xor_si256(a, b), _mm256_and_si256(a, b)};
}
/// The number of ones in each byte, times the table's unit.
ORBIS_TARGET("avx2") inline __m256i count_avx2(__m256i x, __m256i table) noexcept {
  const __m256i nibble = _mm256_set1_epi8(15);
  return _mm256_add_epi8(_mm256_shuffle_epi8(table, _mm256_and_si256(x, nibble)),
                         _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi32(x, 4), nibble)));
}

ORBIS_TARGET("avx2")
inline two_keys lane_pass_avx2(const binary_descriptor<256>& query, std::uint32_t query_index, const lane_group* groups,
                               std::size_t count, lane_row* reverse) {
  const __m256i table1 = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4,  //
                                          0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
  const __m256i table2 = _mm256_add_epi8(table1, table1);
  const __m256i table4 = _mm256_add_epi8(table2, table2);
  const __m256i table8 = _mm256_add_epi8(table4, table4);
  const __m256i ones8 = _mm256_set1_epi8(1);
  const __m256i ones16 = _mm256_set1_epi16(1);
  const __m256i from = _mm256_set1_epi32(static_cast<int>(query_index));
  __m256i q[8];
  for (std::size_t w = 0; w != 8; ++w) q[w] = _mm256_set1_epi32(static_cast<int>(query_word(query, w)));
  __m256i best = _mm256_set1_epi32(-1);
  __m256i second = best;
  for (std::size_t g = 0; g != 2 * count; ++g) {
    const lane_group& group = groups[g / 2];
    const std::size_t half = 8 * (g % 2);
    __m256i x[8];
    for (std::size_t w = 0; w != 8; ++w)
      x[w] = _mm256_xor_si256(q[w],
                              _mm256_load_si256(reinterpret_cast<const __m256i*>(group.words[w].lane.data() + half)));
    const sum_avx2 a = add_avx2(x[0], x[1], x[2]);
    const sum_avx2 b = add_avx2(x[3], x[4], x[5]);
    const sum_avx2 c = add_avx2(x[6], x[7], a.sum);
    const sum_avx2 unit = add_avx2(b.sum, c.sum);
    const sum_avx2 d = add_avx2(a.carry, b.carry, c.carry);
    const sum_avx2 two = add_avx2(d.sum, unit.carry);
    const sum_avx2 four = add_avx2(d.carry, two.carry);
    const __m256i bytes =
        _mm256_add_epi8(_mm256_add_epi8(count_avx2(unit.sum, table1), count_avx2(two.sum, table2)),
                        _mm256_add_epi8(count_avx2(four.sum, table4), count_avx2(four.carry, table8)));
    const __m256i distance = _mm256_madd_epi16(_mm256_maddubs_epi16(bytes, ones8), ones16);
    const __m256i high = _mm256_slli_epi32(distance, lane_index_bits);
    const __m256i key =
        _mm256_or_si256(high, _mm256_load_si256(reinterpret_cast<const __m256i*>(group.index.lane.data() + half)));
    second = _mm256_min_epu32(second, _mm256_max_epu32(best, key));
    best = _mm256_min_epu32(best, key);
    if (reverse != nullptr) {
      auto* const row = reinterpret_cast<__m256i*>(reverse[g / 2].lane.data() + half);
      _mm256_store_si256(row, _mm256_min_epu32(_mm256_load_si256(row), _mm256_or_si256(high, from)));
    }
  }
  lane_row b, s;
  _mm256_store_si256(reinterpret_cast<__m256i*>(b.lane.data()), best);
  _mm256_store_si256(reinterpret_cast<__m256i*>(s.lane.data()), second);
  return reduce(b.lane.data(), s.lane.data(), 8);
}

// -- AVX-512: sixteen lanes; a ternary logic instruction makes a full adder of two --------------------

struct sum_avx512 {
  __m512i sum, carry;
};
ORBIS_TARGET("avx512f") inline sum_avx512 add_avx512(__m512i a, __m512i b, __m512i c) noexcept {
  return {_mm512_ternarylogic_epi32(a, b, c, 0x96), _mm512_ternarylogic_epi32(a, b, c, 0xe8)};
}
ORBIS_TARGET("avx512f") inline sum_avx512 add_avx512(__m512i a, __m512i b) noexcept {
  return {_mm512_xor_si512(a, b), _mm512_and_si512(a, b)};
}
ORBIS_TARGET("avx512f,avx512bw") inline __m512i count_avx512(__m512i x, __m512i table) noexcept {
  const __m512i nibble = _mm512_set1_epi8(15);
  return _mm512_add_epi8(_mm512_shuffle_epi8(table, _mm512_and_si512(x, nibble)),
                         _mm512_shuffle_epi8(table, _mm512_and_si512(_mm512_srli_epi16(x, 4), nibble)));
}
/// All lanes. g++ 12 warns inside the intrinsics that take no mask; a full one costs nothing.
inline constexpr __mmask16 all_avx512 = 0xffff;

/// The two nearest of each lane; `keep_avx512` is what follows the distances in both kernels.
struct keys_avx512 {
  __m512i best, second;
};
ORBIS_TARGET("avx512f") inline __m512i smaller_avx512(__m512i a, __m512i b) noexcept {
  return _mm512_maskz_min_epu32(all_avx512, a, b);
}
ORBIS_TARGET("avx512f")
inline void keep_avx512(keys_avx512& keys, __m512i distance, const lane_group& group, lane_row* reverse,
                        __m512i from) noexcept {
  const __m512i high = _mm512_maskz_slli_epi32(all_avx512, distance, lane_index_bits);
  const __m512i key = _mm512_or_si512(high, _mm512_load_si512(group.index.lane.data()));
  keys.second = smaller_avx512(keys.second, _mm512_maskz_max_epu32(all_avx512, keys.best, key));
  keys.best = smaller_avx512(keys.best, key);
  if (reverse != nullptr)
    _mm512_store_si512(reverse->lane.data(),
                       smaller_avx512(_mm512_load_si512(reverse->lane.data()), _mm512_or_si512(high, from)));
}
ORBIS_TARGET("avx512f") inline two_keys reduce_avx512(const keys_avx512& keys) noexcept {
  lane_row b, s;
  _mm512_store_si512(b.lane.data(), keys.best);
  _mm512_store_si512(s.lane.data(), keys.second);
  return reduce(b.lane.data(), s.lane.data(), 16);
}

ORBIS_TARGET("avx512f,avx512bw")
inline two_keys lane_pass_avx512(const binary_descriptor<256>& query, std::uint32_t query_index,
                                 const lane_group* groups, std::size_t count, lane_row* reverse) {
  const __m512i table1 = _mm512_set4_epi32(0x04030302, 0x03020201, 0x03020201, 0x02010100);
  const __m512i table2 = _mm512_add_epi8(table1, table1);
  const __m512i table4 = _mm512_add_epi8(table2, table2);
  const __m512i table8 = _mm512_add_epi8(table4, table4);
  const __m512i ones8 = _mm512_set1_epi8(1);
  const __m512i ones16 = _mm512_set1_epi16(1);
  const __m512i from = _mm512_set1_epi32(static_cast<int>(query_index));
  __m512i q[8];
  for (std::size_t w = 0; w != 8; ++w) q[w] = _mm512_set1_epi32(static_cast<int>(query_word(query, w)));
  keys_avx512 keys{_mm512_set1_epi32(-1), _mm512_set1_epi32(-1)};
  for (std::size_t g = 0; g != count; ++g) {
    const lane_group& group = groups[g];
    __m512i x[8];
    for (std::size_t w = 0; w != 8; ++w) x[w] = _mm512_xor_si512(q[w], _mm512_load_si512(group.words[w].lane.data()));
    const sum_avx512 a = add_avx512(x[0], x[1], x[2]);
    const sum_avx512 b = add_avx512(x[3], x[4], x[5]);
    const sum_avx512 c = add_avx512(x[6], x[7], a.sum);
    const sum_avx512 unit = add_avx512(b.sum, c.sum);
    const sum_avx512 d = add_avx512(a.carry, b.carry, c.carry);
    const sum_avx512 two = add_avx512(d.sum, unit.carry);
    const sum_avx512 four = add_avx512(d.carry, two.carry);
    const __m512i bytes =
        _mm512_add_epi8(_mm512_add_epi8(count_avx512(unit.sum, table1), count_avx512(two.sum, table2)),
                        _mm512_add_epi8(count_avx512(four.sum, table4), count_avx512(four.carry, table8)));
    const __m512i distance = _mm512_madd_epi16(_mm512_maddubs_epi16(bytes, ones8), ones16);
    keep_avx512(keys, distance, group, reverse == nullptr ? nullptr : reverse + g, from);
  }
  return reduce_avx512(keys);
}

ORBIS_TARGET("avx512f,avx512vpopcntdq")
inline two_keys lane_pass_vpopcnt(const binary_descriptor<256>& query, std::uint32_t query_index,
                                  const lane_group* groups, std::size_t count, lane_row* reverse) {
  const __m512i from = _mm512_set1_epi32(static_cast<int>(query_index));
  __m512i q[8];
  for (std::size_t w = 0; w != 8; ++w) q[w] = _mm512_set1_epi32(static_cast<int>(query_word(query, w)));
  keys_avx512 keys{_mm512_set1_epi32(-1), _mm512_set1_epi32(-1)};
  for (std::size_t g = 0; g != count; ++g) {
    const lane_group& group = groups[g];
    __m512i distance = _mm512_setzero_si512();
    for (std::size_t w = 0; w != 8; ++w)
      distance = _mm512_add_epi32(
          distance, _mm512_popcnt_epi32(_mm512_xor_si512(q[w], _mm512_load_si512(group.words[w].lane.data()))));
    keep_avx512(keys, distance, group, reverse == nullptr ? nullptr : reverse + g, from);
  }
  return reduce_avx512(keys);
}

#endif

}  // namespace orbis::features::detail

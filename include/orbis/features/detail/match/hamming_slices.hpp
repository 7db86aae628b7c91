// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bit-sliced Hamming distances of one query to 256 or 512 trains at once.
///
/// Trains are stored by bit: a slice holds one bit of 256 trains, or of 512 with 512-bit registers. Three bits of a
/// query form a group, a pattern from 0 to 7. For each group the query selects two slices from a table: the parity and
/// the majority of the three differing bits, which together are their count. Full adders sum the counts of all groups
/// in bit planes, so that one logic instruction processes one train per bit of a register. The table is built once per
/// block of trains, for all queries. The adders follow Harley and Seal (Mula, Kurz, Lemire, "Faster population counts
/// using AVX2 instructions", 2018); the selection by groups is the method of four Russians.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include <orbis/core/bits.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/features/detail/match/hamming_search.hpp>

namespace orbis::features::detail {

inline constexpr std::size_t slice_planes = 9;  // a distance has 9 bits: 0 to 256

/// The bit planes of the distances, lowest first.
template <std::size_t Words>
using slice_distances = std::array<slice<Words>, slice_planes>;

/// Transposes a matrix of 64x64 bits: bit `j` of word `i` becomes bit `i` of word `j`.
inline void transpose_bits(std::array<std::uint64_t, 64>& m) noexcept {
  // Swaps the off-diagonal blocks of half the size, then those within each block, recursively.
  const auto swap_blocks = [&]<std::size_t Size>(std::integral_constant<std::size_t, Size>, std::uint64_t mask) {
    for (std::size_t k = 0; k != 64; k += 2 * Size)
      for (std::size_t i = k; i != k + Size; ++i) {
        const std::uint64_t swapped = ((m[i] >> Size) ^ m[i + Size]) & mask;
        m[i] ^= swapped << Size;
        m[i + Size] ^= swapped;
      }
  };
  swap_blocks(std::integral_constant<std::size_t, 32>{}, 0x00000000ffffffffULL);
  swap_blocks(std::integral_constant<std::size_t, 16>{}, 0x0000ffff0000ffffULL);
  swap_blocks(std::integral_constant<std::size_t, 8>{}, 0x00ff00ff00ff00ffULL);
  swap_blocks(std::integral_constant<std::size_t, 4>{}, 0x0f0f0f0f0f0f0f0fULL);
  swap_blocks(std::integral_constant<std::size_t, 2>{}, 0x3333333333333333ULL);
  swap_blocks(std::integral_constant<std::size_t, 1>{}, 0x5555555555555555ULL);
}

/// Group `g` consists of bits `g`, `88 + g` and `176 + g`; the last eight groups lack the third bit, which counts as
/// zero.
/// @pre at most 64 * Words trains
template <std::size_t Words, bit_string D>
void make_slice_table(std::span<const D> trains, slice_table<Words>& table) noexcept {
  std::array<slice<Words>, 3 * slice_groups> rows{};
  for (std::size_t begin = 0; begin < trains.size(); begin += 64)
    for (std::size_t w = 0; w != 4; ++w) {
      std::array<std::uint64_t, 64> block{};
      for (std::size_t i = 0; i != 64 && begin + i != trains.size(); ++i) block[i] = as_words(trains[begin + i])[w];
      transpose_bits(block);
      for (std::size_t b = 0; b != 64; ++b) rows[64 * w + b].words[begin / 64] = block[b];
    }
  for (std::size_t g = 0; g != slice_groups; ++g)
    for (std::size_t w = 0; w != Words; ++w) {
      const std::uint64_t a = rows[g].words[w];
      const std::uint64_t b = rows[slice_groups + g].words[w];
      const std::uint64_t c = rows[2 * slice_groups + g].words[w];
      table[g].parity[0].words[w] = a ^ b ^ c;
      table[g].parity[1].words[w] = ~(a ^ b ^ c);
      for (std::size_t p = 0; p != 4; ++p) {
        const std::uint64_t x = (p & 1U) != 0 ? ~a : a;
        const std::uint64_t y = (p & 2U) != 0 ? ~b : b;
        const std::uint64_t majority = (x & y) | ((x ^ y) & c);
        table[g].majority[p].words[w] = majority;
        table[g].majority[7 - p].words[w] = ~majority;  // complement of all three bits
      }
    }
}

/// Expands bit `i` of a byte to byte `i` of a word, 0x20 if it is set.
[[nodiscard]] constexpr std::uint64_t spread_bits(std::uint64_t byte) noexcept {
  const std::uint64_t each = (byte * 0x0101010101010101ULL) & 0x8040201008040201ULL;
  return ((each + 0x7f7f7f7f7f7f7f7fULL) & 0x8080808080808080ULL) >> 2U;
}

/// Stores the bytes of a word, lowest first.
inline void store_bytes(std::uint8_t* to, std::uint64_t word) noexcept {
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(to, &word, 8);
  } else {
    for (std::size_t k = 0; k != 8; ++k) to[k] = static_cast<std::uint8_t>(word >> (8 * k));
  }
}

inline void make_slice_query(const bit_words<256>& query, slice_query& to) noexcept {
  std::array<std::uint8_t, 40> bytes{};
  for (std::size_t w = 0; w != 4; ++w) store_bytes(bytes.data() + 8 * w, query[w]);
  for (std::size_t i = 0; i != slice_rounds; ++i) {
    const std::uint64_t a = spread_bits(bytes[i]);
    const std::uint64_t b = spread_bits(bytes[slice_rounds + i]);
    const std::uint64_t c = spread_bits(bytes[2 * slice_rounds + i]);
    store_bytes(to.majority.data() + 8 * i, a | (b << 1U) | (c << 2U));
    store_bytes(to.parity.data() + 8 * i, a ^ b ^ c);
  }
}

/// The number of words of a slice, and the register type for its bits.
template <class Target>
inline constexpr std::size_t slice_words = Target::bytes == 64 ? 8 : 4;
template <class Target>
using slice_plane = simd::vec<std::uint64_t, Target::bytes / 8, Target>;

template <std::size_t Words>
inline constexpr std::array<slice<Words>, 2> constant_slices = [] {
  std::array<slice<Words>, 2> zeros_and_ones{};
  zeros_and_ones[1].words.fill(~std::uint64_t{0});
  return zeros_and_ones;
}();

/// Bit `i` of `limit` for all trains: a load, because a broadcast from a scalar costs several instructions.
template <class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE slice_plane<Target> limit_plane(std::uint32_t limit, std::size_t i) noexcept {
  return slice_plane<Target>::load(constant_slices<slice_words<Target>>[(limit >> i) & 1U].words.data());
}

#if ORBIS_X86
/// Lane-wise function of three bits whose truth table is the bits of `Table`. The compiler recognises few of the
/// functions below: without it brute-force matching takes 1.35 times as long with AVX-512.
template <int Table, class R>
ORBIS_TARGET_AVX512 inline void ternary_logic(R& out, const R& a, const R& b, const R& c) noexcept {
  out = reinterpret_cast<R>(_mm512_ternarylogic_epi64(reinterpret_cast<__m512i>(a), reinterpret_cast<__m512i>(b),
                                                      reinterpret_cast<__m512i>(c), Table));
}
#endif
template <class V>
inline constexpr bool has_ternary_logic = ORBIS_X86 != 0 && V::target_type::bytes == 64;

/// One bit of a full adder: sum becomes the sum of the three, carry its carry.
template <class V>
ORBIS_ALWAYS_INLINE void full_add(V& sum, V& carry, const V& a, const V& b) noexcept {
  if constexpr (has_ternary_logic<V>) {
#if ORBIS_X86
    ternary_logic<0xe8>(carry.v, sum.v, a.v, b.v);
    ternary_logic<0x96>(sum.v, sum.v, a.v, b.v);
#endif
  } else {
    const V either = a ^ b;
    carry = (a & b) | (either & sum);
    sum = sum ^ either;
  }
}
/// One bit of a half adder: sum becomes the sum of both, a the carry.
template <class V>
ORBIS_ALWAYS_INLINE void half_add(V& sum, V& a) noexcept {
  const V carry = sum & a;
  sum = sum ^ a;
  a = carry;
}
/// One bit of a comparison, starting at the lowest bit: below becomes x < y, given the result for the lower bits.
template <class V>
ORBIS_ALWAYS_INLINE void compare_bit(V& below, const V& x, const V& y) noexcept {
  if constexpr (has_ternary_logic<V>) {
#if ORBIS_X86
    ternary_logic<0xb2>(below.v, below.v, x.v, y.v);
#endif
  } else {
    below = (~x & y) | (~(x ^ y) & below);
  }
}

/// Computes the distances of a query to the trains of a table, and the trains whose distance is below `limit`. Each
/// round adds sixteen slices: parities count one, majorities two.
template <class Target>
ORBIS_ALWAYS_INLINE void slice_count(const slice_table<slice_words<Target>>& table, const slice_query& query,
                                     std::uint32_t limit, slice_distances<slice_words<Target>>& distances,
                                     slice<slice_words<Target>>& below) noexcept {
  using plane = slice_plane<Target>;
  using group_type = slice_group<slice_words<Target>>;
  constexpr std::size_t slice_bytes = sizeof(slice<slice_words<Target>>), unit = slice_bytes / 32;
  for (std::size_t part = 0; part != slice_bytes; part += sizeof(plane)) {
    const plane zero(0);
    plane one = zero, two = zero, four = zero, eight = zero, s16 = zero;
    plane c32[slice_rounds];  // summed after the rounds
    for (std::size_t g = 0; g != slice_groups; g += 8) {
      const char* const group = reinterpret_cast<const char*>(table.data() + g) + part;
      const auto parity = [&](std::size_t i) ORBIS_INLINE_LAMBDA {
        const std::size_t at = i * sizeof(group_type) + sizeof(group_type::majority) + unit * query.parity[g + i];
        return plane::load(reinterpret_cast<const std::uint64_t*>(group + at));
      };
      const auto majority = [&](std::size_t i) ORBIS_INLINE_LAMBDA {
        const std::size_t at = i * sizeof(group_type) + unit * query.majority[g + i];
        return plane::load(reinterpret_cast<const std::uint64_t*>(group + at));
      };
      plane c2, c4, d4, e4, c8, d8, e8, c16;
      // Two parities and a majority of each of the first four pairs, then the remaining majorities.
      full_add(one, c2, parity(0), parity(1));
      full_add(two, c4, c2, majority(0));
      full_add(one, c2, parity(2), parity(3));
      full_add(two, d4, c2, majority(1));
      full_add(four, c8, c4, d4);
      full_add(one, c2, parity(4), parity(5));
      full_add(two, c4, c2, majority(2));
      full_add(one, c2, parity(6), parity(7));
      full_add(two, d4, c2, majority(3));
      full_add(four, d8, c4, d4);
      full_add(eight, c16, c8, d8);
      full_add(two, c4, majority(4), majority(5));
      full_add(two, e4, majority(6), majority(7));
      full_add(four, e8, c4, e4);
      half_add(eight, e8);
      full_add(s16, c32[g / 8], c16, e8);
    }
    plane s32 = zero, s64 = zero, s128 = zero, s256 = zero, c64[6], c128[3], c256, none;
    for (std::size_t i = 0; i != 5; ++i) full_add(s32, c64[i], c32[2 * i], c32[2 * i + 1]);
    c64[5] = c32[10];
    half_add(s32, c64[5]);
    for (std::size_t i = 0; i != 3; ++i) full_add(s64, c128[i], c64[2 * i], c64[2 * i + 1]);
    full_add(s128, c256, c128[0], c128[1]);
    half_add(s128, c128[2]);
    full_add(s256, none, c256, c128[2]);
    const std::size_t word = part / 8;
    plane result = zero;
    const auto keep = [&](const plane& x, std::size_t i) ORBIS_INLINE_LAMBDA {
      compare_bit(result, x, limit_plane<Target>(limit, i));
      x.store(&distances[i].words[word]);
    };
    keep(one, 0), keep(two, 1), keep(four, 2), keep(eight, 3), keep(s16, 4), keep(s32, 5), keep(s64, 6), keep(s128, 7),
        keep(s256, 8);
    result.store(&below.words[word]);
  }
}

/// The trains whose distance is below `limit`.
template <class Target>
ORBIS_ALWAYS_INLINE void slice_below(const slice_distances<slice_words<Target>>& distances, std::uint32_t limit,
                                     slice<slice_words<Target>>& below) noexcept {
  using plane = slice_plane<Target>;
  for (std::size_t word = 0; word != slice_words<Target>; word += plane::count) {
    plane result(0);
    for (std::size_t i = 0; i != slice_planes; ++i)
      compare_bit(result, plane::load(&distances[i].words[word]), limit_plane<Target>(limit, i));
    result.store(&below.words[word]);
  }
}

/// The trains whose distance is below `least`; lowers `least` to these distances.
template <class Target>
ORBIS_ALWAYS_INLINE void slice_lower(const slice_distances<slice_words<Target>>& distances,
                                     slice_distances<slice_words<Target>>& least,
                                     slice<slice_words<Target>>& below) noexcept {
  using plane = slice_plane<Target>;
  for (std::size_t word = 0; word != slice_words<Target>; word += plane::count) {
    plane result(0);
    for (std::size_t i = 0; i != slice_planes; ++i)
      compare_bit(result, plane::load(&distances[i].words[word]), plane::load(&least[i].words[word]));
    for (std::size_t i = 0; i != slice_planes; ++i) {
      const plane x = plane::load(&distances[i].words[word]), y = plane::load(&least[i].words[word]);
      ((x & result) | (y & ~result)).store(&least[i].words[word]);
    }
    result.store(&below.words[word]);
  }
}

/// The `rank`-th smallest distance among the trains in `candidates`, determined bit by bit from the highest.
/// @pre 0 < rank <= the number of bits in `candidates`
template <class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE std::uint32_t slice_ranked(const slice_distances<slice_words<Target>>& distances,
                                                             const slice<slice_words<Target>>& candidates,
                                                             std::size_t rank) noexcept {
  constexpr std::size_t words = slice_words<Target>;
  slice<words> among = candidates;
  std::uint32_t value = 0;
  for (std::size_t i = slice_planes; i-- != 0;) {
    slice<words> low;
    std::size_t count = 0;
    for (std::size_t w = 0; w != words; ++w) {
      low.words[w] = among.words[w] & ~distances[i].words[w];
      count += simd::ones<Target>(low.words[w]);
    }
    if (count >= rank) {
      among = low;
    } else {
      rank -= count;
      value |= 1U << i;
      for (std::size_t w = 0; w != words; ++w) among.words[w] &= distances[i].words[w];
    }
  }
  return value;
}

}  // namespace orbis::features::detail

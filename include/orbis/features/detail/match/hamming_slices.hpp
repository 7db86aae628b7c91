// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bit-sliced Hamming distances from one query to 256 or 512 train descriptors at once.
///
/// Train descriptors are stored by bit: a slice holds one bit of 256 descriptors, or of 512 with 512-bit registers. A
/// full adder sums three differing bits to their parity and their majority, which counts as two. The parities are then
/// summed in the same way, so 128 groups of three bits leave 128 majorities and one parity. The three bits of a query,
/// a pattern from 0 to 7, select the majority of a group from a table, which is built once per block of train
/// descriptors and used for all queries. Full adders sum the majorities in bit planes, so that one logic instruction
/// processes one train descriptor per bit of a register. The adders follow Harley and Seal (Mula, Kurz, Lemire, "Faster
/// population counts using AVX2 instructions", 2018); the table look-up by groups is the method of four Russians.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include <orbis/core/bits.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/mask.hpp>
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

/// Sets the slices of a group of three bits for each query pattern; returns the parity of the three bits.
template <std::size_t Words>
ORBIS_ALWAYS_INLINE slice<Words> make_slice_group(const slice<Words>& a, const slice<Words>& b, const slice<Words>& c,
                                                  std::array<slice<Words>, 8>& group) noexcept {
  slice<Words> parity;
  for (std::size_t w = 0; w != Words; ++w) {
    parity.words[w] = a.words[w] ^ b.words[w] ^ c.words[w];
    for (std::size_t p = 0; p != 4; ++p) {
      const std::uint64_t x = (p & 1U) != 0 ? ~a.words[w] : a.words[w];
      const std::uint64_t y = (p & 2U) != 0 ? ~b.words[w] : b.words[w];
      const std::uint64_t majority = (x & y) | ((x ^ y) & c.words[w]);
      group[p].words[w] = majority;
      group[7 - p].words[w] = ~majority;  // complement of all three bits
    }
  }
  return parity;
}

/// Group `g` consists of bits `g`, `64 + g` and `128 + g`; group `64 + g` consists of bit `192 + g`, the parity of
/// group `g`, and the parity of the previous group.
/// @pre at most 64 * Words train descriptors
template <class Target, std::size_t Words, bit_string D>
ORBIS_ALWAYS_INLINE void make_slice_table(std::span<const D> trains, slice_table<Words>& table) noexcept {
  std::array<slice<Words>, 256> rows{};
  for (std::size_t begin = 0; begin < trains.size(); begin += 64)
    for (std::size_t w = 0; w != 4; ++w) {
      std::array<std::uint64_t, 64> block{};
      for (std::size_t i = 0; i != 64 && begin + i != trains.size(); ++i) block[i] = as_words(trains[begin + i])[w];
      transpose_bits(block);
      for (std::size_t b = 0; b != 64; ++b) rows[64 * w + b].words[begin / 64] = block[b];
    }
  slice<Words> total;
  for (std::size_t g = 0; g != 64; ++g) {
    const slice<Words> parity = make_slice_group(rows[g], rows[64 + g], rows[128 + g], table.majority[g]);
    total = make_slice_group(rows[192 + g], parity, total, table.majority[64 + g]);
  }
  table.parity[0] = total;
  for (std::size_t w = 0; w != Words; ++w) table.parity[1].words[w] = ~total.words[w];
}

/// Computes the patterns of a query for the groups of `make_slice_table`.
template <class Target>
ORBIS_ALWAYS_INLINE void make_slice_query(const bit_words<256>& query, slice_query& to) noexcept {
  using bytes = simd::vec<std::uint8_t, 64, Target>;
  const auto spread = [](std::uint64_t bits, std::uint8_t weight) ORBIS_INLINE_LAMBDA {
    return select(bytes::mask_type::from_bits(bits), bytes(weight), bytes(0));
  };
  const std::uint64_t parity = query[0] ^ query[1] ^ query[2];
  std::uint64_t total = query[3] ^ parity;  // bit i becomes the parity of bits 0 to i
  for (int shift = 1; shift != 64; shift *= 2) total ^= total << shift;
  (spread(query[0], 0x20) | spread(query[1], 0x40) | spread(query[2], 0x80)).store(to.majority.data());
  (spread(query[3], 0x20) | spread(parity, 0x40) | spread(total << 1U, 0x80)).store(to.majority.data() + 64);
  to.parity = total >> 63U;
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

/// Bit `i` of `limit`, repeated for all train descriptors. Loaded from memory, because a broadcast from a scalar costs
/// several instructions.
template <class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE slice_plane<Target> limit_plane(std::uint32_t limit, std::size_t i) noexcept {
  return slice_plane<Target>::load(constant_slices<slice_words<Target>>[(limit >> i) & 1U].words.data());
}

#if ORBIS_X86
/// Lane-wise function of three bits with the truth table `Table`. The compiler recognises only a few of the functions
/// below as ternary logic; without this function, brute-force matching takes 1.35 times as long with AVX-512.
template <int Table, class R>
ORBIS_TARGET_AVX512 inline void ternary_logic(R& out, const R& a, const R& b, const R& c) noexcept {
  out = reinterpret_cast<R>(_mm512_ternarylogic_epi64(reinterpret_cast<__m512i>(a), reinterpret_cast<__m512i>(b),
                                                      reinterpret_cast<__m512i>(c), Table));
}
#endif
template <class V>
inline constexpr bool has_ternary_logic = ORBIS_X86 != 0 && V::target_type::bytes == 64;

/// One bit of a full adder: sets `sum` to the sum of the three bits and `carry` to the carry.
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
/// One bit of a half adder: sets `sum` to the sum of both bits and `a` to the carry.
template <class V>
ORBIS_ALWAYS_INLINE void half_add(V& sum, V& a) noexcept {
  const V carry = sum & a;
  sum = sum ^ a;
  a = carry;
}
/// One bit of a comparison, starting at the lowest bit: sets `below` to x < y, given the result for the lower bits.
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

/// Computes the distances from a query to the train descriptors of a table, and the set of those below `limit`.
template <class Target>
ORBIS_ALWAYS_INLINE void slice_count(const slice_table<slice_words<Target>>& table, const slice_query& query,
                                     std::uint32_t limit, slice_distances<slice_words<Target>>& distances,
                                     slice<slice_words<Target>>& below) noexcept {
  using plane = slice_plane<Target>;
  constexpr std::size_t slice_bytes = sizeof(slice<slice_words<Target>>), unit = slice_bytes / 32;
  for (std::size_t part = 0; part != slice_bytes; part += sizeof(plane)) {
    const plane one = plane::load(&table.parity[query.parity].words[part / 8]);
    plane two(0), four(0), eight(0), s16(0), c32[slice_groups / 16];
    for (std::size_t g = 0; g != slice_groups; g += 16) {
      const char* const group = reinterpret_cast<const char*>(table.majority.data() + g) + part;
      const auto majority = [&](std::size_t i) ORBIS_INLINE_LAMBDA {
        const std::size_t at = i * 8 * slice_bytes + unit * query.majority[g + i];
        return plane::load(reinterpret_cast<const std::uint64_t*>(group + at));
      };
      plane c4, d4, c8, d8, c16, d16;
      const auto add_eight = [&](std::size_t i, plane& c) ORBIS_INLINE_LAMBDA {
        full_add(two, c4, majority(i), majority(i + 1));
        full_add(two, d4, majority(i + 2), majority(i + 3));
        full_add(four, c8, c4, d4);
        full_add(two, c4, majority(i + 4), majority(i + 5));
        full_add(two, d4, majority(i + 6), majority(i + 7));
        full_add(four, d8, c4, d4);
        full_add(eight, c, c8, d8);
      };
      add_eight(0, c16);
      add_eight(8, d16);
      full_add(s16, c32[g / 16], c16, d16);
    }
    plane s32(0), s64(0), s128(0), s256, c64[4], c128[2];
    for (std::size_t i = 0; i != 4; ++i) full_add(s32, c64[i], c32[2 * i], c32[2 * i + 1]);
    for (std::size_t i = 0; i != 2; ++i) full_add(s64, c128[i], c64[2 * i], c64[2 * i + 1]);
    full_add(s128, s256, c128[0], c128[1]);
    const std::size_t word = part / 8;
    plane result(0);
    const auto keep = [&](const plane& x, std::size_t i) ORBIS_INLINE_LAMBDA {
      compare_bit(result, x, limit_plane<Target>(limit, i));
      x.store(&distances[i].words[word]);
    };
    keep(one, 0), keep(two, 1), keep(four, 2), keep(eight, 3), keep(s16, 4), keep(s32, 5), keep(s64, 6), keep(s128, 7),
        keep(s256, 8);
    result.store(&below.words[word]);
  }
}

/// Sets `below` to the train descriptors whose distance is below `limit`.
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

/// Sets `below` to the train descriptors whose distance is below `least`, and lowers `least` to these distances.
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

/// The `rank`-th smallest distance among the train descriptors in `candidates`, determined bit by bit from the highest
/// bit.
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

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Hamming distances of one query to 256 or 512 trains at once, bit-sliced; the insides of `hamming_nearest`.
///
/// Trains are stored by bit: a slice holds one bit of 256 trains, or of 512 where registers are as wide. A query
/// selects for every three of its bits (a group, as pattern of 0 to 7) two slices from a table: the parity and the
/// majority of the three differing bits, which together are their count. The counts of all groups are added in vertical
/// counters, bit planes, by full adders: a logic instruction works on as many trains as the register has bits, and
/// nothing is ever xor-ed, shifted or summed across lanes. The table is made once per block of trains for all queries.
/// The adders follow Harley and Seal (Mula, Kurz, Lemire, "Faster population counts using AVX2 instructions", 2018),
/// the selection by groups is the method of four Russians.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include <orbis/features/descriptor.hpp>
#include <orbis/features/detail/match/slice_ops.hpp>

namespace orbis::features::detail {

inline constexpr std::size_t slice_planes = 9;  // a distance has 9 bits: 0 to 256
inline constexpr std::size_t slice_groups = 88;
inline constexpr std::size_t slice_rounds = slice_groups / 8;

/// One bit of `64 * Words` trains.
template <std::size_t Words>
struct alignas(8 * Words) slice {
  std::array<std::uint64_t, Words> words{};
};

template <std::size_t Words>
inline constexpr std::array<slice<Words>, 2> constant_slices = [] {
  std::array<slice<Words>, 2> zeros_and_ones{};
  zeros_and_ones[1].words.fill(~std::uint64_t{0});
  return zeros_and_ones;
}();

/// What a group of three bits can give, by the pattern of the query's bits.
template <std::size_t Words>
struct slice_group {
  std::array<slice<Words>, 8> majority;  ///< whether at least two of the three bits differ
  std::array<slice<Words>, 2> parity;    ///< whether one or three do, by the parity of the pattern
};
template <std::size_t Words>
using slice_table = std::array<slice_group<Words>, slice_groups>;

/// Where a query's slices lie: offsets into the two arrays of each group, in units of a 32nd of a slice.
struct slice_query {
  std::array<std::uint8_t, slice_groups> majority;
  std::array<std::uint8_t, slice_groups> parity;
};

/// The bit planes of the distances, the lowest first.
template <std::size_t Words>
using slice_distances = std::array<slice<Words>, slice_planes>;

/// Transposes a matrix of 64x64 bits: bit `j` of word `i` becomes bit `i` of word `j`.
inline void transpose_bits(std::array<std::uint64_t, 64>& m) noexcept {
  // Swaps the off-diagonal blocks of half the size, then those within each block, and so on.
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

/// Group `g` is made of bits `g`, `88 + g` and `176 + g`; the last eight lack the third, which counts as zero.
/// @pre at most 64 * Words trains
template <std::size_t Words>
void make_slice_table(std::span<const binary_descriptor<256>> trains, slice_table<Words>& table) noexcept {
  std::array<slice<Words>, 3 * slice_groups> rows{};
  for (std::size_t begin = 0; begin < trains.size(); begin += 64)
    for (std::size_t w = 0; w != 4; ++w) {
      std::array<std::uint64_t, 64> block{};
      for (std::size_t i = 0; i != 64 && begin + i != trains.size(); ++i) block[i] = trains[begin + i].words[w];
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
        table[g].majority[7 - p].words[w] = ~majority;  // the complements of all three bits
      }
    }
}

/// Bit `i` of a byte as byte `i` of a word, 0x20 where it is set.
[[nodiscard]] constexpr std::uint64_t spread_bits(std::uint64_t byte) noexcept {
  const std::uint64_t each = (byte * 0x0101010101010101ULL) & 0x8040201008040201ULL;
  return ((each + 0x7f7f7f7f7f7f7f7fULL) & 0x8080808080808080ULL) >> 2U;
}

/// Stores the bytes of a word, the lowest first.
inline void store_bytes(std::uint8_t* to, std::uint64_t word) noexcept {
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(to, &word, 8);
  } else {
    for (std::size_t k = 0; k != 8; ++k) to[k] = static_cast<std::uint8_t>(word >> (8 * k));
  }
}

inline void make_slice_query(const binary_descriptor<256>& query, slice_query& to) noexcept {
  std::array<std::uint8_t, 40> bytes{};
  for (std::size_t w = 0; w != 4; ++w) store_bytes(bytes.data() + 8 * w, query.words[w]);
  for (std::size_t i = 0; i != slice_rounds; ++i) {
    const std::uint64_t a = spread_bits(bytes[i]);
    const std::uint64_t b = spread_bits(bytes[slice_rounds + i]);
    const std::uint64_t c = spread_bits(bytes[2 * slice_rounds + i]);
    store_bytes(to.majority.data() + 8 * i, a | (b << 1U) | (c << 2U));
    store_bytes(to.parity.data() + 8 * i, a ^ b ^ c);
  }
}

/// The distances of a query to the trains of a table, and which of them lie below `limit`. Sixteen slices a round:
/// parities count one, majorities two.
template <class Ops>
[[gnu::always_inline]] inline void slice_count(const slice_table<Ops::words>& table, const slice_query& query,
                                               std::uint32_t limit, slice_distances<Ops::words>& distances,
                                               slice<Ops::words>& below) noexcept {
  using plane = typename Ops::plane;
  constexpr std::size_t unit = sizeof(slice<Ops::words>) / 32;
  for (std::size_t part = 0; part != sizeof(slice<Ops::words>); part += sizeof(plane)) {
    plane one{}, two{}, four{}, eight{}, s16{};
    plane c32[slice_rounds];  // added up after the rounds
    for (std::size_t g = 0; g != slice_groups; g += 8) {
      const char* const group = reinterpret_cast<const char*>(table.data() + g) + part;
      plane a, b, c2, d2, c4, d4, e4, c8, d8, e8, c16, d16;
      // Two parities and a majority of each of the first four pairs, then the majorities left over.
      const auto parity = [&](plane & x, std::size_t i) __attribute__((always_inline)) {
        Ops::load(x, group + i * sizeof(slice_group<Ops::words>) + sizeof(slice_group<Ops::words>::majority) +
                         unit * query.parity[g + i]);
      };
      const auto majority = [&](plane & x, std::size_t i) __attribute__((always_inline)) {
        Ops::load(x, group + i * sizeof(slice_group<Ops::words>) + unit * query.majority[g + i]);
      };
      parity(a, 0), parity(b, 1);
      Ops::add(one, c2, a, b);
      majority(d2, 0);
      Ops::add(two, c4, c2, d2);
      parity(a, 2), parity(b, 3);
      Ops::add(one, c2, a, b);
      majority(d2, 1);
      Ops::add(two, d4, c2, d2);
      Ops::add(four, c8, c4, d4);
      parity(a, 4), parity(b, 5);
      Ops::add(one, c2, a, b);
      majority(d2, 2);
      Ops::add(two, c4, c2, d2);
      parity(a, 6), parity(b, 7);
      Ops::add(one, c2, a, b);
      majority(d2, 3);
      Ops::add(two, d4, c2, d2);
      Ops::add(four, d8, c4, d4);
      Ops::add(eight, c16, c8, d8);
      majority(a, 4), majority(b, 5);
      Ops::add(two, c4, a, b);
      majority(a, 6), majority(b, 7);
      Ops::add(two, e4, a, b);
      Ops::add(four, e8, c4, e4);
      d16 = e8;
      Ops::add(eight, d16);
      Ops::add(s16, c32[g / 8], c16, d16);
    }
    plane s32{}, s64{}, s128{}, s256{}, c64[6], c128[3], c256, none;
    for (std::size_t i = 0; i != 5; ++i) Ops::add(s32, c64[i], c32[2 * i], c32[2 * i + 1]);
    c64[5] = c32[10];
    Ops::add(s32, c64[5]);
    for (std::size_t i = 0; i != 3; ++i) Ops::add(s64, c128[i], c64[2 * i], c64[2 * i + 1]);
    Ops::add(s128, c256, c128[0], c128[1]);
    Ops::add(s128, c128[2]);
    Ops::add(s256, none, c256, c128[2]);
    plane result{};
    const auto keep = [&](const plane& x, std::size_t i) __attribute__((always_inline)) {
      plane bit;
      Ops::load(bit, reinterpret_cast<const char*>(&constant_slices<Ops::words>[(limit >> i) & 1U]));
      Ops::compare(result, x, bit);
      Ops::store(reinterpret_cast<char*>(&distances[i]) + part, x);
    };
    keep(one, 0), keep(two, 1), keep(four, 2), keep(eight, 3), keep(s16, 4), keep(s32, 5), keep(s64, 6), keep(s128, 7),
        keep(s256, 8);
    Ops::store(reinterpret_cast<char*>(&below) + part, result);
  }
}

/// Which distances lie below `limit`.
template <class Ops>
[[gnu::always_inline]] inline void slice_below(const slice_distances<Ops::words>& distances, std::uint32_t limit,
                                               slice<Ops::words>& below) noexcept {
  using plane = typename Ops::plane;
  for (std::size_t part = 0; part != sizeof(slice<Ops::words>); part += sizeof(plane)) {
    plane result{};
    for (std::size_t i = 0; i != slice_planes; ++i) {
      plane x, y;
      Ops::load(x, reinterpret_cast<const char*>(&distances[i]) + part);
      Ops::load(y, reinterpret_cast<const char*>(&constant_slices<Ops::words>[(limit >> i) & 1U]));
      Ops::compare(result, x, y);
    }
    Ops::store(reinterpret_cast<char*>(&below) + part, result);
  }
}

/// Which distances lie below those in `least`, which takes them over.
template <class Ops>
[[gnu::always_inline]] inline void slice_lower(const slice_distances<Ops::words>& distances,
                                               slice_distances<Ops::words>& least, slice<Ops::words>& below) noexcept {
  using plane = typename Ops::plane;
  for (std::size_t part = 0; part != sizeof(slice<Ops::words>); part += sizeof(plane)) {
    plane result{};
    for (std::size_t i = 0; i != slice_planes; ++i) {
      plane x, y;
      Ops::load(x, reinterpret_cast<const char*>(&distances[i]) + part);
      Ops::load(y, reinterpret_cast<const char*>(&least[i]) + part);
      Ops::compare(result, x, y);
    }
    for (std::size_t i = 0; i != slice_planes; ++i) {
      plane x, y;
      Ops::load(x, reinterpret_cast<const char*>(&distances[i]) + part);
      Ops::load(y, reinterpret_cast<const char*>(&least[i]) + part);
      Ops::replace(y, x, result);
      Ops::store(reinterpret_cast<char*>(&least[i]) + part, y);
    }
    Ops::store(reinterpret_cast<char*>(&below) + part, result);
  }
}

/// The `rank`-th smallest distance among the trains in `candidates`, bit by bit from the highest.
/// @pre 0 < rank <= the number of bits in `candidates`
template <class Ops>
[[gnu::always_inline]] inline std::uint32_t slice_ranked(const slice_distances<Ops::words>& distances,
                                                         const slice<Ops::words>& candidates,
                                                         std::size_t rank) noexcept {
  slice<Ops::words> among = candidates;
  std::uint32_t value = 0;
  for (std::size_t i = slice_planes; i-- != 0;) {
    slice<Ops::words> low;
    std::size_t count = 0;
    for (std::size_t w = 0; w != Ops::words; ++w) {
      low.words[w] = among.words[w] & ~distances[i].words[w];
      count += Ops::ones(low.words[w]);
    }
    if (count >= rank) {
      among = low;
    } else {
      rank -= count;
      value |= 1U << i;
      for (std::size_t w = 0; w != Ops::words; ++w) among.words[w] &= distances[i].words[w];
    }
  }
  return value;
}

}  // namespace orbis::features::detail

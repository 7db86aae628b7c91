// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Searches for bit strings by the Hamming distance, without their code, which is in hamming_nearest.hpp and
/// hamming_listed.hpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/bits.hpp>
#include <orbis/features/detail/match/nearest.hpp>

namespace orbis::features::detail {

inline constexpr std::size_t slice_groups = 88;
inline constexpr std::size_t slice_rounds = slice_groups / 8;

/// One bit of `64 * Words` trains.
template <std::size_t Words>
struct alignas(8 * Words) slice {
  std::array<std::uint64_t, Words> words{};
};

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

/// Memory of `hamming_nearest`, which the next call uses again.
struct hamming_workspace {
  std::vector<slice_query> queries;
  std::vector<slice_table<4>> table4;  ///< of the current block of trains, for registers of up to 256 bits
  std::vector<slice_table<8>> table8;  ///< the same for registers of 512 bits
  std::vector<std::uint32_t> reverse_distance;
};

/// For each query its nearest and second nearest train; if `reverse` is not empty, for each train its nearest
/// query (the lowest on ties), in the same pass. O(queries x trains) time, O(queries + trains) memory, all of it in
/// `workspace`. Strings of 256 bits are the fast ones.
/// @pre nearest.size() == queries.size(); reverse is empty or of the size of trains
template <bit_string D>
void hamming_nearest(std::span<const D> queries, std::span<const D> trains, std::span<nearest_two> nearest,
                     std::span<std::uint32_t> reverse, hamming_workspace& workspace);

/// `distances[i]` becomes the Hamming distance between `query` and `trains[indices[i]]`.
/// @pre distances.size() == indices.size(); indices are of trains
template <bit_string D>
void hamming_listed(const D& query, std::span<const D> trains, std::span<const std::uint32_t> indices,
                    std::span<std::uint32_t> distances);

}  // namespace orbis::features::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Declarations of searches for bit strings by the Hamming distance; implemented in hamming_nearest.hpp and
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

inline constexpr std::size_t slice_groups = 128;

/// One bit of each of `64 * Words` trains.
template <std::size_t Words>
struct alignas(8 * Words) slice {
  std::array<std::uint64_t, Words> words{};
};

/// Precomputed counts of groups of three bits, by the pattern of the query's bits.
template <std::size_t Words>
struct slice_table {
  std::array<std::array<slice<Words>, 8>, slice_groups> majority;  ///< set if at least two of the three bits differ
  std::array<slice<Words>, 2> parity;  ///< set if the distance is odd, by the parity of the query
};

/// Positions of a query's slices.
struct slice_query {
  std::array<std::uint8_t, slice_groups> majority;  ///< offsets into a group, in units of a 32nd of a slice
  std::uint64_t parity;
};

/// Reusable memory of `hamming_nearest`.
struct hamming_workspace {
  std::vector<slice_query> queries;
  std::vector<slice_table<4>> table4;  ///< of the current block of trains, for registers of up to 256 bits
  std::vector<slice_table<8>> table8;  ///< the same for registers of 512 bits
  std::vector<std::uint32_t> reverse_distance;
};

/// Finds the nearest and second nearest train of each query; if `reverse` is not empty, also the nearest query of each
/// train (the lowest on ties), in the same pass. O(queries x trains) time, O(queries + trains) memory, all of it in
/// `workspace`. Fastest for strings of 256 bits.
/// @pre nearest.size() == queries.size(); reverse is empty or has the size of trains
template <bit_string D>
void hamming_nearest(std::span<const D> queries, std::span<const D> trains, std::span<nearest_two> nearest,
                     std::span<std::uint32_t> reverse, hamming_workspace& workspace);

/// Sets `distances[i]` to the Hamming distance between `query` and `trains[indices[i]]`.
/// @pre distances.size() == indices.size(); indices are valid for trains
template <bit_string D>
void hamming_listed(const D& query, std::span<const D> trains, std::span<const std::uint32_t> indices,
                    std::span<std::uint32_t> distances);

}  // namespace orbis::features::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Declarations of nearest-neighbour searches among bit strings under the Hamming distance; implemented in
/// hamming_nearest.hpp and hamming_listed.hpp.
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

/// One bit of each of `64 * Words` train descriptors.
template <std::size_t Words>
struct alignas(8 * Words) slice {
  std::array<std::uint64_t, Words> words{};
};

/// Precomputed counts for groups of three bits, indexed by the pattern of the query's bits.
template <std::size_t Words>
struct slice_table {
  std::array<std::array<slice<Words>, 8>, slice_groups> majority;  ///< set if at least two of the three bits differ
  std::array<slice<Words>, 2> parity;  ///< set if the distance is odd, indexed by the parity of the query
};

/// The slices of a `slice_table` that a query selects.
struct slice_query {
  std::array<std::uint8_t, slice_groups> majority;  ///< offset of the slice in each group, in units of 1/32 slice
  std::uint64_t parity;
};

/// Reusable memory for `hamming_nearest`.
struct hamming_workspace {
  std::vector<slice_query> queries;
  std::vector<slice_table<4>> table4;  ///< table of the current block, for registers of up to 256 bits
  std::vector<slice_table<8>> table8;  ///< table for registers of 512 bits
  std::vector<std::uint32_t> reverse_distance;
};

/// Finds the nearest and second-nearest train descriptors for each query; if `reverse` is not empty, also the nearest
/// query for each train descriptor (the lowest on ties), in the same pass. O(queries x trains) time, O(queries +
/// trains) memory, all in `workspace`. Fastest for strings of 256 bits.
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

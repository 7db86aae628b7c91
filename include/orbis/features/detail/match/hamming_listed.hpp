// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Distances of one descriptor to listed others, by run-time dispatched kernels.
#pragma once

#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

#include <orbis/core/simd.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/hamming.hpp>

namespace orbis::features::detail {

template <std::size_t Bits>
using listed_kernel = void(const binary_descriptor<Bits>&, std::span<const binary_descriptor<Bits>>,
                           std::span<const std::uint32_t>, std::span<std::uint32_t>);

template <std::size_t Bits>
void hamming_listed_portable(const binary_descriptor<Bits>& query, std::span<const binary_descriptor<Bits>> trains,
                             std::span<const std::uint32_t> indices, std::span<std::uint32_t> distances) {
  for (std::size_t i = 0; i != indices.size(); ++i) distances[i] = hamming{}(query, trains[indices[i]]);
}
#if ORBIS_X86
template <std::size_t Bits>
ORBIS_TARGET("popcnt")
void hamming_listed_popcnt(const binary_descriptor<Bits>& query, std::span<const binary_descriptor<Bits>> trains,
                           std::span<const std::uint32_t> indices, std::span<std::uint32_t> distances) {
  for (std::size_t i = 0; i != indices.size(); ++i) {
    const binary_descriptor<Bits>& train = trains[indices[i]];
    int sum = 0;
    for (std::size_t w = 0; w != Bits / 64; ++w) sum += __builtin_popcountll(query.words[w] ^ train.words[w]);
    distances[i] = static_cast<std::uint32_t>(sum);
  }
}
#endif

/// `distances[i]` becomes the Hamming distance between `query` and `trains[indices[i]]`.
/// @pre distances.size() == indices.size(); indices are of trains
template <std::size_t Bits>
void hamming_listed(simd::level level, const binary_descriptor<Bits>& query,
                    std::span<const binary_descriptor<Bits>> trains, std::span<const std::uint32_t> indices,
                    std::span<std::uint32_t> distances) {
  assert(distances.size() == indices.size());
#if ORBIS_X86
  simd::select<listed_kernel<Bits>>(level, {.portable = hamming_listed_portable<Bits>,
                                            .popcnt = hamming_listed_popcnt<Bits>})(query, trains, indices, distances);
#else
  static_cast<void>(level);
  hamming_listed_portable(query, trains, indices, distances);
#endif
}

}  // namespace orbis::features::detail

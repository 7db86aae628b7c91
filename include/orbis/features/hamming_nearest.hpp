// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The two nearest neighbours of many binary descriptors at once, by run-time dispatched kernels.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/hamming_lanes.hpp>
#include <orbis/features/nearest.hpp>

namespace orbis::features {

/// Descriptors that `hamming_nearest` knows.
template <class Descriptor>
concept has_hamming_kernel = std::same_as<Descriptor, binary_descriptor<256>>;

namespace detail {

using hamming_kernel = void(std::span<const binary_descriptor<256>>, std::span<const binary_descriptor<256>>,
                            std::span<nearest_two>, std::span<std::uint32_t>);

inline void hamming_nearest_portable(std::span<const binary_descriptor<256>> queries,
                                     std::span<const binary_descriptor<256>> trains, std::span<nearest_two> nearest,
                                     std::span<std::uint32_t> reverse) {
  nearest_by(hamming{}, queries, trains, nearest, reverse);
}

#if ORBIS_X86
/// `hamming`, for functions compiled with the POPCNT instruction.
struct hamming_builtin {
  [[gnu::always_inline]] std::uint32_t operator()(const binary_descriptor<256>& a,
                                                  const binary_descriptor<256>& b) const noexcept {
    return static_cast<std::uint32_t>(
        __builtin_popcountll(a.words[0] ^ b.words[0]) + __builtin_popcountll(a.words[1] ^ b.words[1]) +
        __builtin_popcountll(a.words[2] ^ b.words[2]) + __builtin_popcountll(a.words[3] ^ b.words[3]));
  }
};

ORBIS_TARGET("popcnt")
inline void hamming_nearest_popcnt(std::span<const binary_descriptor<256>> queries,
                                   std::span<const binary_descriptor<256>> trains, std::span<nearest_two> nearest,
                                   std::span<std::uint32_t> reverse) {
  nearest_by(hamming_builtin{}, queries, trains, nearest, reverse);
}

inline void hamming_nearest_avx2(std::span<const binary_descriptor<256>> queries,
                                 std::span<const binary_descriptor<256>> trains, std::span<nearest_two> nearest,
                                 std::span<std::uint32_t> reverse) {
  nearest_in_lanes(lane_pass_avx2, queries, trains, nearest, reverse);
}

inline void hamming_nearest_avx512(std::span<const binary_descriptor<256>> queries,
                                   std::span<const binary_descriptor<256>> trains, std::span<nearest_two> nearest,
                                   std::span<std::uint32_t> reverse) {
  nearest_in_lanes(__builtin_cpu_supports("avx512vpopcntdq") ? lane_pass_vpopcnt : lane_pass_avx512, queries, trains,
                   nearest, reverse);
}
#endif

}  // namespace detail

/// For each query its nearest and second nearest train; if `reverse` is not empty, for each train
/// its nearest query (the lowest on ties). Every level gives the same answer. O(queries x trains)
/// time, O(queries + trains) memory.
/// @pre nearest.size() == queries.size(); reverse is empty or of the size of trains
inline void hamming_nearest(simd::level level, std::span<const binary_descriptor<256>> queries,
                            std::span<const binary_descriptor<256>> trains, std::span<nearest_two> nearest,
                            std::span<std::uint32_t> reverse) {
  // The vector kernels pack distance and index into 32 bits.
  if (std::max(queries.size(), trains.size()) > detail::most_in_lanes) level = std::min(level, simd::level::popcnt);
#if ORBIS_X86
  simd::select<detail::hamming_kernel>(level, {.portable = detail::hamming_nearest_portable,
                                               .popcnt = detail::hamming_nearest_popcnt,
                                               .avx2 = detail::hamming_nearest_avx2,
                                               .avx512 = detail::hamming_nearest_avx512})(queries, trains, nearest,
                                                                                          reverse);
#else
  detail::hamming_nearest_portable(queries, trains, nearest, reverse);
#endif
}

}  // namespace orbis::features

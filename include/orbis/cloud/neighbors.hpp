// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Result type of nearest-neighbour searches.
#pragma once

#include <concepts>
#include <cstdint>

namespace orbis::cloud {

/// A neighbour found by a search: its index in the cloud and its distance.
template <std::floating_point S>
struct neighbor {
  std::uint32_t index = 0;
  S distance = 0;  ///< metres
  friend bool operator==(const neighbor&, const neighbor&) = default;
};

/// Order of neighbours in results: nearest first, then by index.
template <std::floating_point S>
[[nodiscard]] constexpr bool is_nearer(const neighbor<S>& a, const neighbor<S>& b) noexcept {
  return a.distance < b.distance || (a.distance == b.distance && a.index < b.index);
}

}  // namespace orbis::cloud

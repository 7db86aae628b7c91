// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What searches for nearest neighbours find.
#pragma once

#include <concepts>
#include <cstdint>

namespace orbis::cloud {

/// A point that was found, by its index in the searched cloud.
template <std::floating_point S>
struct neighbor {
  std::uint32_t index = 0;
  S distance = 0;  ///< metres
  friend bool operator==(const neighbor&, const neighbor&) = default;
};

/// The order in which neighbours come: the nearest first, equal distances by index.
template <std::floating_point S>
[[nodiscard]] constexpr bool is_nearer(const neighbor<S>& a, const neighbor<S>& b) noexcept {
  return a.distance < b.distance || (a.distance == b.distance && a.index < b.index);
}

}  // namespace orbis::cloud

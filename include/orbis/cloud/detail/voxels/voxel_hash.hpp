// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Numbers for the occupied cells of a grid, in the order in which they are first seen.
#pragma once

#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <orbis/core/point.hpp>
#include <orbis/core/random.hpp>

namespace orbis::cloud::detail {

/// A cell of a grid through the origin.
using voxel_key = std::array<std::int32_t, 3>;

/// Maps points to the numbers 0, 1, 2, ... of their voxels. Open addressing; O(1) per point, 12
/// bytes for each voxel and 8 to 16 for its place in the table.
class voxel_hash {
 public:
  /// @pre size > 0, metres
  explicit voxel_hash(double size) : inverse_size_{1.0 / size}, slots_(1024, none) { assert(size > 0); }

  /// The voxel of a point; empty where it is not finite or more than 2^31 voxels from the origin.
  template <point_like P>
  [[nodiscard]] std::optional<voxel_key> key_of(const P& point) const {
    const auto p = coordinates<double>(point);
    voxel_key key{};
    for (std::size_t a = 0; a != 3; ++a) {
      const double cell = std::floor(p[a] * inverse_size_);
      if (!(std::abs(cell) < 2147483647.0)) return std::nullopt;
      key[a] = static_cast<std::int32_t>(cell);
    }
    return key;
  }
  /// The number of a voxel, a new one if it has none. @pre fewer than 2^32 - 1 voxels
  std::uint32_t insert(const voxel_key& key) {
    if (2 * (keys_.size() + 1) > slots_.size()) grow();
    std::uint32_t& slot = slots_[slot_of(key)];
    if (slot == none) {
      slot = static_cast<std::uint32_t>(keys_.size());
      keys_.push_back(key);
    }
    return slot;
  }
  /// The number of a voxel, if it has one.
  [[nodiscard]] std::optional<std::uint32_t> find(const voxel_key& key) const {
    const std::uint32_t number = slots_[slot_of(key)];
    return number == none ? std::nullopt : std::optional{number};
  }
  [[nodiscard]] std::size_t size() const noexcept { return keys_.size(); }
  /// The voxels in the order of their numbers.
  [[nodiscard]] const std::vector<voxel_key>& keys() const noexcept { return keys_; }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  /// Where the voxel is, or would be.
  [[nodiscard]] std::size_t slot_of(const voxel_key& key) const {
    const std::uint64_t low =
        std::bit_cast<std::uint32_t>(key[0]) | static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(key[1])) << 32U;
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = mix64(low ^ mix64(std::bit_cast<std::uint32_t>(key[2]))) & mask;
    while (slots_[slot] != none && keys_[slots_[slot]] != key) slot = (slot + 1) & mask;
    return slot;
  }
  void grow() {
    slots_.assign(2 * slots_.size(), none);
    for (std::uint32_t i = 0; i != keys_.size(); ++i) slots_[slot_of(keys_[i])] = i;
  }

  double inverse_size_;
  std::vector<std::uint32_t> slots_;
  std::vector<voxel_key> keys_;
};

}  // namespace orbis::cloud::detail

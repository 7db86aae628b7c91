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
#include <optional>
#include <vector>

#include <orbis/cloud/detail/voxels/voxel_key.hpp>
#include <orbis/core/hash_index.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/random.hpp>

namespace orbis::cloud::detail {

/// 64 well-mixed bits of a voxel's key.
struct voxel_key_hash {
  [[nodiscard]] std::uint64_t operator()(const voxel_key& key) const noexcept {
    const std::uint64_t low = std::bit_cast<std::uint32_t>(key[0]) | std::uint64_t{std::bit_cast<std::uint32_t>(key[1])}
                                                                         << 32U;
    return mix64(low ^ mix64(std::bit_cast<std::uint32_t>(key[2])));
  }
};

/// Maps points to the numbers 0, 1, 2, ... of their voxels. O(1) per point; 12 bytes for each voxel and 8 to 16 for its
/// place in the table.
class voxel_hash {
  [[nodiscard]] auto key_of_number() const {
    return [this](std::uint32_t number) -> const voxel_key& { return keys_[number]; };
  }

 public:
  /// @pre size > 0, metres
  explicit voxel_hash(double size) : inverse_size_{1.0 / size} { assert(size > 0); }

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
    const auto next = static_cast<std::uint32_t>(keys_.size());
    const std::uint32_t number = numbers_.find_or_insert(key, next, key_of_number());
    if (number == next) keys_.push_back(key);
    return number;
  }
  /// The number of a voxel, if it has one.
  [[nodiscard]] std::optional<std::uint32_t> find(const voxel_key& key) const {
    const std::uint32_t number = numbers_.find(key, key_of_number());
    return number == numbers_.none ? std::nullopt : std::optional{number};
  }
  [[nodiscard]] std::size_t size() const noexcept { return keys_.size(); }
  /// The voxels in the order of their numbers.
  [[nodiscard]] const std::vector<voxel_key>& keys() const noexcept { return keys_; }

 private:
  double inverse_size_;
  number_index<voxel_key, voxel_key_hash> numbers_;
  std::vector<voxel_key> keys_;
};

}  // namespace orbis::cloud::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Looking up octants of a store that lie near each other.
#pragma once

#include <cstdint>
#include <optional>

#include <orbis/octree/detail/storage/brick.hpp>

namespace orbis::octree::detail {

/// Reads octants, bricks and chunks of a store, which must outlive it and stay as it is. One for each
/// thread.
template <class T>
class store_reader {
 public:
  using chunk = typename brick_store<T>::chunk;

  explicit store_reader(const brick_store<T>& store) noexcept : store_{&store} {}

  /// The octant that contains `k`; nothing in it is known where nothing is stored. O(1).
  [[nodiscard]] const octant_view<T>& octant(const voxel_key& k) noexcept {
    if (const std::uint32_t far = distance(k); far >= cells_) move(k, far);
    return octant_;
  }
  /// The value of voxel `k`, empty where nothing is known. O(1).
  [[nodiscard]] std::optional<T> value(const voxel_key& k) noexcept {
    const octant_view<T>& o = octant(k);
    const std::uint32_t place = place_in_octant(k);
    return (o.known >> place & 1U) != 0 ? std::optional{o.at(place)} : std::nullopt;
  }
  /// The octant asked for last.
  [[nodiscard]] const octant_view<T>& last() const noexcept { return octant_; }
  /// Whether all that is known in the octant asked for last is less than `bound`.
  [[nodiscard]] bool is_below(T bound) const noexcept { return max_ < bound; }
  [[nodiscard]] const brick_store<T>& store() const noexcept { return *store_; }

 private:
  /// At least as large as the smallest node that contains both `k` and the last octant.
  [[nodiscard]] std::uint32_t distance(const voxel_key& k) const noexcept {
    return (k.x ^ at_.x) | (k.y ^ at_.y) | (k.z ^ at_.z);
  }
  void move(const voxel_key& k, std::uint32_t far) noexcept {
    at_ = k;
    if (far >= node_cells(chunk_level)) chunk_ = store_->find_chunk(k);
    if (far >= node_cells(brick_level)) brick_ = chunk_ == nullptr ? nullptr : store_->find(*chunk_, place_in_chunk(k));
    if (brick_ != nullptr) {
      octant_ = store_->view(*brick_, place_in_brick(k) >> 6U);
      max_ = brick_->value[place_in_brick(k) >> 6U];
      cells_ = node_cells(octant_level);
    } else {
      const T* const large = store_->find_large_value(k);
      octant_ = large == nullptr ? octant_view<T>{} : octant_view<T>{~std::uint64_t{0}, nullptr, 0, large};
      max_ = large == nullptr ? T{} : *large;
      cells_ = node_cells(chunk_ == nullptr && !store_->has_large() ? chunk_level : brick_level);
    }
  }

  const brick_store<T>* store_;
  voxel_key at_{~0U, ~0U, ~0U};  ///< the voxel asked for last; at first far from all
  std::uint32_t cells_ = 0;      ///< the edge of the node around it that `octant_` stands for
  const chunk* chunk_ = nullptr;
  const brick<T>* brick_ = nullptr;
  octant_view<T> octant_;
  T max_{};  ///< the largest value in the octant, if anything is known there
};

}  // namespace orbis::octree::detail

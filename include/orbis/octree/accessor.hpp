// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Looking up voxels that lie near each other: an accessor remembers where it looked last.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>

#include <orbis/core/point.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/sensor_model.hpp>

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

namespace orbis::octree {

/// What queries need of a map: its sensor model, its store and its grid. See occupancy_octree.
template <class M>
concept octree_map = sensor_model<typename M::model> && requires(const M& map) {
  { map.store() } -> std::same_as<const detail::brick_store<typename M::model::value_type>&>;
  { map.grid() } -> std::same_as<const voxel_grid&>;
};

/// The probability that a stored value stands for; empty if there is none.
template <sensor_model Model>
[[nodiscard]] std::optional<double> probability_at(std::optional<typename Model::value_type> v) noexcept {
  return v ? std::optional{probability_of(*v)} : std::nullopt;
}

/// The queries of a map for points or voxels of which each lies near the one before: along a ray, on
/// a surface, in a scan. Those are found without a search. The map must outlive it and stay as it is;
/// one for each thread.
///
/// @code
///   auto near = map.accessor();
///   for (const vec3f& p : points) occupied += near.state(p) == orbis::octree::occupancy::occupied;
/// @endcode
template <sensor_model Model>
class octree_accessor {
 public:
  using value_type = typename Model::value_type;

  octree_accessor(const detail::brick_store<value_type>& store, const voxel_grid& grid) noexcept
      : reader_{store}, grid_{grid} {}

  /// What is stored at `p`: empty where unknown or outside the grid. O(1), as are all.
  template <point_like P>
  [[nodiscard]] std::optional<value_type> value(const P& p) noexcept {
    const auto key = grid_.key(p);
    return key ? reader_.value(*key) : std::nullopt;
  }
  [[nodiscard]] std::optional<value_type> value(const voxel_key& key) noexcept { return reader_.value(key); }
  /// The log-odds at `p`, empty where unknown or outside the grid.
  template <class P>
  requires point_like<P> || std::same_as<P, voxel_key>
  [[nodiscard]] std::optional<value_type> log_odds(const P& p) noexcept { return value(p); }
  /// The probability that `p` is occupied, empty where unknown or outside the grid.
  template <class P>
  requires point_like<P> || std::same_as<P, voxel_key>
  [[nodiscard]] std::optional<double> probability(const P& p) noexcept { return probability_at<Model>(value(p)); }
  /// What is known about `p`.
  template <class P>
  requires point_like<P> || std::same_as<P, voxel_key>
  [[nodiscard]] occupancy state(const P& p) noexcept {
    if constexpr (point_like<P>) {
      const auto key = grid_.key(p);
      return key ? state(*key) : occupancy::unknown;
    } else {
      const detail::octant_view<value_type>& o = reader_.octant(p);
      const std::uint32_t place = detail::place_in_octant(p);
      if ((o.known >> place & 1U) == 0) return occupancy::unknown;
      const bool occupied = !reader_.is_below(Model::occupancy_threshold) && is_occupied<Model>(o.at(place));
      return occupied ? occupancy::occupied : occupancy::free;
    }
  }

 private:
  detail::store_reader<value_type> reader_;
  voxel_grid grid_;
};

}  // namespace orbis::octree

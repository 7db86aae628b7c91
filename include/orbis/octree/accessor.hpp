// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Fast look-up of voxels near each other: an accessor caches its last position.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>

#include <orbis/core/point.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree::detail {

/// Reads octants, bricks and chunks of a store, which must outlive the reader and must not change. Use one per thread.
template <class T>
class store_reader {
 public:
  using chunk = typename brick_store<T>::chunk;

  explicit store_reader(const brick_store<T>& store) noexcept : store_{&store} {}

  /// Returns the octant that contains `k`; all its voxels are unknown if nothing is stored there. O(1).
  [[nodiscard]] const octant_view<T>& octant(const voxel_key& k) noexcept {
    if (const std::uint32_t far = distance(k); far >= cells_) move(k, far);
    return octant_;
  }
  /// Returns the value of voxel `k`, empty if unknown. O(1).
  [[nodiscard]] std::optional<T> value(const voxel_key& k) noexcept {
    const octant_view<T>& o = octant(k);
    const std::uint32_t place = place_in_octant(k);
    return (o.known >> place & 1U) != 0 ? std::optional{o.at(place)} : std::nullopt;
  }
  /// Returns the last octant that was read.
  [[nodiscard]] const octant_view<T>& last() const noexcept { return octant_; }
  /// Returns true if all known values in the last octant are less than `bound`.
  [[nodiscard]] bool is_below(T bound) const noexcept { return max_ < bound; }
  [[nodiscard]] const brick_store<T>& store() const noexcept { return *store_; }

 private:
  /// A node that contains the last octant also contains `k` if and only if its edge, in voxels, exceeds this value.
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
  voxel_key at_{~0U, ~0U, ~0U};  ///< a voxel in the last octant; initially far from all others
  std::uint32_t cells_ = 0;      ///< edge in voxels of the node around `at_` that `octant_` represents
  const chunk* chunk_ = nullptr;
  const brick<T>* brick_ = nullptr;
  octant_view<T> octant_;
  T max_{};  ///< the largest value in the octant, if any is known
};

}  // namespace orbis::octree::detail

namespace orbis::octree {

/// A map that can be queried: it has a sensor model, a store and a grid. See occupancy_octree.
template <class M>
concept octree_map = sensor_model<typename M::model> && requires(const M& map) {
  { map.store() } -> std::same_as<const detail::brick_store<typename M::model::value_type>&>;
  { map.grid() } -> std::same_as<const voxel_grid&>;
};

/// Converts a stored value to a probability; empty for an empty value.
template <sensor_model Model>
[[nodiscard]] std::optional<double> probability_at(std::optional<typename Model::value_type> v) noexcept {
  return v ? std::optional{to_probability(*v)} : std::nullopt;
}

/// Queries of a map at points or voxels near each other: along a ray, on a surface, in a scan. A position near the
/// previous one is found without a search. The map must outlive the accessor and must not change; use one accessor per
/// thread.
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

  /// Returns the value stored at `p`; empty if unknown or outside the grid. All queries are O(1).
  template <point_like P>
  [[nodiscard]] std::optional<value_type> value(const P& p) noexcept {
    const auto key = grid_.key(p);
    return key ? reader_.value(*key) : std::nullopt;
  }
  [[nodiscard]] std::optional<value_type> value(const voxel_key& key) noexcept { return reader_.value(key); }
  /// Returns the log-odds at `p`, empty if unknown or outside the grid.
  template <class P>
  requires point_like<P> || std::same_as<P, voxel_key>
  [[nodiscard]] std::optional<value_type> log_odds(const P& p) noexcept { return value(p); }
  /// Returns the probability that `p` is occupied, empty if unknown or outside the grid.
  template <class P>
  requires point_like<P> || std::same_as<P, voxel_key>
  [[nodiscard]] std::optional<double> probability(const P& p) noexcept { return probability_at<Model>(value(p)); }
  /// Returns the state of `p`.
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

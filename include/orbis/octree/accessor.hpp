// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Looking up voxels that lie near each other: an accessor remembers where it looked last.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>

#include <orbis/core/point.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/detail/storage/store_reader.hpp>
#include <orbis/octree/sensor_model.hpp>

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

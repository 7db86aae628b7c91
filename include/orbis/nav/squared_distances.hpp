// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Exact squared Euclidean distances from voxels to the nearest obstacle, as integers, updated incrementally.
///
/// The transform is separable (T. Saito, J. Toriwaki, "New algorithms for Euclidean distance transformation of an
/// n-dimensional digitized picture with applications", Pattern Recognition 27(11), 1994; P. Felzenszwalb, D.
/// Huttenlocher, "Distance transforms of sampled functions", Theory of Computing 8, 2012), and all three stages are
/// stored:
///
///     along(x, y, z) = distance along x to the nearest obstacle of that row
///     plane(x, y, z) = min over j of along(x, j, z)^2 + (y - j)^2
///     space(x, y, z) = min over k of plane(x, y, k) + (z - k)^2
///
/// A change propagates through the stages and ends where a value is unchanged. In each stage, a source that increased
/// marks as stale the slices of 8x8 voxels in which a value equals its previous offer: that offer may have been the
/// minimum, so the slice is recomputed once. Sources that decreased lower their targets. The values therefore do not
/// depend on the order of changes.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include <orbis/core/cow_pages.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/nav/detail/field/block_vector.hpp>
#include <orbis/nav/detail/field/brick_directory.hpp>
#include <orbis/nav/detail/field/slice_code.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav {

/// The obstacles in an octant of 4x4x4 voxels: bit i is the voxel at index i of the Morton curve.
struct octant_obstacles {
  octree::voxel_key octant;  ///< any voxel in it
  std::uint64_t mask = 0;
};

/// A node of an octree: a cube with an edge of 2^level voxels, aligned to multiples of its edge.
struct voxel_cube {
  octree::voxel_key low;  ///< any voxel in it
  int level = 0;
};

/// A snapshot of the distances, for readers. A copy shares memory with the field from which it was made; later updates
/// do not change it.
class squared_distance_view {
 public:
  /// The value of voxels whose distance exceeds the reach.
  static constexpr std::uint16_t far = detail::far_away;

  /// The squared distance between the centres of voxel `k` and the nearest obstacle, in voxels; 0 in obstacles; `far`
  /// if it exceeds the reach. O(1), about 10 ns.
  [[nodiscard]] std::uint16_t squared(const octree::voxel_key& k) const noexcept {
    const std::uint32_t n = directory_.find(place_of(k));
    return is_brick(n) ? values_[n][index_of(k)] : value_without_brick(n);
  }
  /// Returns true if the brick of 8x8x8 voxels that contains `k` is stored. O(1).
  [[nodiscard]] bool is_stored(const octree::voxel_key& k) const noexcept {
    return is_brick(directory_.find(place_of(k)));
  }
  /// Maximum distance, in voxels.
  [[nodiscard]] int reach() const noexcept { return reach_; }
  /// The value outside the grid and in all bricks that are not stored, except for bricks in a cube (see
  /// squared_distances::begin).
  [[nodiscard]] std::uint16_t elsewhere() const noexcept { return elsewhere_; }
  /// Calls `visit(lowest voxel, values)` for every stored brick: 8x8x8 squared distances, x fastest. Bricks that are
  /// not stored have the value `elsewhere()`; inside the cubes passed to `squared_distances::begin` they have `far` if
  /// `elsewhere()` is 0, otherwise 0. The order is unspecified.
  template <class Visit>
  void for_each_brick(Visit&& visit) const {
    for (std::size_t i = 0; i != values_.size(); ++i) {
      const detail::brick_place& p = places_[i];
      visit(octree::voxel_key{static_cast<std::uint32_t>(p.x) * 8, static_cast<std::uint32_t>(p.y) * 8,
                              static_cast<std::uint32_t>(p.z) * 8},
            std::span<const std::uint16_t, 512>{values_[i]});
    }
  }
  [[nodiscard]] std::size_t brick_count() const noexcept { return values_.size(); }

  /// Reads squared distances of voxels, each near the previous one. The view must outlive the reader and not change.
  class reader {
   public:
    explicit reader(const squared_distance_view& view) noexcept : view_{&view}, cursor_{view.directory_} {}
    [[nodiscard]] std::uint16_t squared(const octree::voxel_key& k) noexcept {
      const detail::brick_place p = place_of(k);
      if (p != place_) {
        place_ = p;
        const std::uint32_t n = cursor_.find(p);
        values_ = is_brick(n) ? view_->values_[n].data() : nullptr;
        without_ = view_->value_without_brick(n);
      }
      return values_ == nullptr ? without_ : values_[index_of(k)];
    }

   private:
    const squared_distance_view* view_;
    detail::brick_directory::cursor cursor_;
    detail::brick_place place_{-1, -1, -1};
    const std::uint16_t* values_ = nullptr;
    std::uint16_t without_ = far;
  };

 protected:
  using brick_values = std::array<std::uint16_t, 512>;

  squared_distance_view(int reach, std::uint32_t cells, bool elsewhere_is_obstacle)
      : directory_{cells / 8}, reach_{reach}, elsewhere_{elsewhere_is_obstacle ? std::uint16_t{0} : far} {}

  [[nodiscard]] static detail::brick_place place_of(const octree::voxel_key& k) noexcept {
    return {static_cast<std::int32_t>(k.x >> 3U), static_cast<std::int32_t>(k.y >> 3U),
            static_cast<std::int32_t>(k.z >> 3U)};
  }
  /// Returns true if the result of a directory look-up is a brick index.
  [[nodiscard]] static bool is_brick(std::uint32_t found) noexcept { return found < detail::brick_directory::inner; }
  /// The value, 0 or `far`, of all voxels of a brick that is not stored. `found`: result of the directory look-up.
  [[nodiscard]] std::uint16_t value_without_brick(std::uint32_t found) const noexcept {
    return found == detail::brick_directory::inner ? static_cast<std::uint16_t>(far - elsewhere_) : elsewhere_;
  }
  [[nodiscard]] static std::size_t index_of(const octree::voxel_key& k) noexcept {
    return (k.z & 7U) << 6U | (k.y & 7U) << 3U | (k.x & 7U);
  }

  detail::brick_directory directory_;
  cow_pages<brick_values> values_;
  cow_pages<detail::brick_place> places_;
  int reach_;
  std::uint16_t elsewhere_;
};

/// Distances that are updated with the obstacles: after any sequence of updates, the values are bitwise identical to
/// those of a field rebuilt from the same obstacles. No bounds need to be specified. Memory is proportional to the
/// space near obstacles or, if unset space counts as an obstacle (`elsewhere_is_obstacle`), to the free space: about
/// 2.9 kB for each block of 8x8x8 voxels with a voxel within reach; the memory is released when the block no longer has
/// one.
///
/// Not thread-safe. Readers on other threads use copies of `view()`.
class squared_distances : public squared_distance_view {
 public:
  /// `reach`: maximum distance, in voxels. `cells`: number of grid cells along an axis. `elsewhere_is_obstacle`: true
  /// if voxels that were never set, and all space outside the grid, are obstacles. @pre 1 <= reach <= 181; cells is a
  /// multiple of 8
  ORBIS_LAZY squared_distances(int reach, std::uint32_t cells, bool elsewhere_is_obstacle);

  /// Initialises these cubes to the opposite state of the rest of space (`elsewhere_is_obstacle`). Bricks are stored
  /// only within reach of the cubes' faces, on the free side: outside full cubes, inside free ones (see
  /// max_added_bricks). @pre `update` has not been called; the cubes are disjoint, in the grid, and of level 6 or more
  ORBIS_LAZY void begin(std::span<const voxel_cube> cubes);
  /// Maximum number of bricks that a single cube adds to the field. O(1).
  ORBIS_LAZY [[nodiscard]] std::uint64_t max_added_bricks(const voxel_cube& cube) const noexcept;
  /// Returns true if a node (level 2 or more) is in one of the cubes that the field was initialised with. O(levels).
  [[nodiscard]] bool is_in_cube(const voxel_cube& node) const noexcept {
    return directory_.has_cubes() && directory_.is_in_cube(place_of(node.low), std::max(node.level - 3, 0));
  }
  [[nodiscard]] bool has_cubes() const noexcept { return directory_.has_cubes(); }

  /// Sets the obstacles in these octants; all other voxels keep their state. Each octant is listed once.
  ///
  /// O(changes x reach^3) in the worst case: a single obstacle in free space is the nearest one for all voxels within
  /// reach, and all of these are written, 64 at a time; when it disappears, their slices of 64 are recomputed in
  /// O(reach) each. Obstacles are typically surfaces: most changes end after a few voxels, where another obstacle is
  /// nearer, and voxels affected by several neighbours are computed once. Memory that a large update needs in addition
  /// to the field (up to its size) is released at its end; small updates allocate nothing except new bricks.
  /// @pre keys lie in the grid
  ORBIS_LAZY void update(std::span<const octant_obstacles> octants);

  /// Returns true if voxel `k` is an obstacle. O(1).
  [[nodiscard]] bool is_obstacle(const octree::voxel_key& k) const noexcept { return squared(k) == 0; }
  /// The obstacle nearest to voxel `k` (one of them on ties); empty if there is none within reach. It may be a voxel
  /// that was never set (see `elsewhere_is_obstacle`). O(reach).
  ORBIS_LAZY [[nodiscard]] std::optional<octree::voxel_key> nearest(const octree::voxel_key& k) const;

  /// A view for readers. It is part of the field: read or copy it on the thread that updates the field, between two
  /// updates. A copy does not change; it may be passed to other threads, read by several threads concurrently, and
  /// destroyed on any thread. Copying costs one pointer and one atomic increment per 4 bricks, and 40 to 80 bytes per
  /// block of 8x8x8 bricks (the directory); afterwards, the field clones the parts that it writes to, 4 kB at a time.
  /// On the updating thread, no copy is needed.
  [[nodiscard]] const squared_distance_view& view() const noexcept { return *this; }
  /// Heap memory in bytes, including memory shared with copies of the view.
  ORBIS_LAZY [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  static constexpr std::uint32_t none = detail::brick_directory::none;
  static constexpr std::uint8_t far_along = 0xff;

  /// Data of a brick in addition to its distances (1728 bytes). Arrays are in rows along x: z * 64 + y * 8 + x.
  struct stages {
    alignas(64) std::array<std::uint16_t, 512> plane;
    std::array<std::uint8_t, 512> along;
    std::array<std::uint8_t, 64> obstacles;  ///< row z * 8 + y, bit x
    std::array<std::uint64_t, 8> octants;    ///< the obstacles of each octant, as passed to update
    std::array<std::uint16_t, 8> plane_top;  ///< the largest value of each slice
    std::array<std::uint16_t, 8> space_top;
    std::uint32_t kept = none;     ///< index of the copy of `plane` from before the update
    std::uint8_t stale_plane = 0;  ///< slices to recompute
    std::uint8_t stale_space = 0;
  };
  /// `plane` as it was before an update.
  struct kept_plane {
    alignas(64) std::array<std::uint16_t, 512> plane;
    std::uint32_t brick;
    std::uint8_t changed;  ///< slices that may have changed
  };
  struct along_change {
    std::uint32_t brick;
    std::uint32_t row;
    std::uint64_t before, after;  ///< eight distances
  };

  ORBIS_LAZY [[nodiscard]] std::uint32_t make(const detail::brick_place& p);
  ORBIS_LAZY [[nodiscard]] bool is_needless(std::uint32_t brick) const;
  ORBIS_LAZY void remove_needless();
  ORBIS_LAZY void remove(std::uint32_t brick);
  ORBIS_LAZY [[nodiscard]] std::size_t buffer_bytes() const noexcept;
  ORBIS_LAZY void release_buffers();
  /// For a brick that is not stored: `is_full` returns true if it is full of obstacles; `row_bits` returns one of its
  /// rows.
  [[nodiscard]] bool is_full(std::uint32_t found) const noexcept { return value_without_brick(found) == 0; }
  [[nodiscard]] std::uint8_t row_bits(std::uint32_t found) const noexcept { return is_full(found) ? 0xff : 0; }
  [[nodiscard]] std::uint16_t bound() const noexcept { return static_cast<std::uint16_t>(reach_ * reach_); }
  /// The squared distances to eight consecutive rows, the first of which is `distance` rows away; each is repeated
  /// eight times.
  [[nodiscard]] const std::uint16_t* squares(int distance) const noexcept {
    return squares_.data() + 8 * (distance + squares_pad_);
  }
  /// Maximum distance, in voxels, at which `least` plus the squared distance is within `bound()`; negative if none.
  ORBIS_LAZY [[nodiscard]] int offer_reach(std::uint16_t least) const noexcept;

  /// `begin_update` clears the change lists of the previous update; `finish_update` propagates the new changes through
  /// all stages.
  ORBIS_LAZY void begin_update();
  ORBIS_LAZY void finish_update();
  ORBIS_LAZY void set_obstacles(std::span<const octant_obstacles> octants);
  ORBIS_LAZY void list_row(const detail::brick_place& p, std::size_t row);
  ORBIS_LAZY void update_rows();
  ORBIS_LAZY void update_line(std::span<const std::uint64_t> rows);
  ORBIS_LAZY void spread_along_y();
  ORBIS_LAZY void spread_along_z();
  ORBIS_LAZY void keep_plane(std::uint32_t brick, unsigned changed);
  ORBIS_LAZY void make_plane(std::uint32_t brick, int z);
  ORBIS_LAZY void make_space(std::uint32_t brick, unsigned slices);

  detail::slice_code kernels_;
  detail::block_vector<stages> stages_;  ///< indexed by brick
  int bricks_in_reach_;
  int squares_pad_;
  std::vector<std::uint16_t> squares_;
  std::array<std::array<std::uint8_t, 8>, 256> nearest_bit_;  ///< distances of 8 voxels to the nearest set bit

  // Buffers for an update.
  std::vector<std::uint64_t> rows_;
  std::vector<std::uint32_t> line_;
  std::vector<std::uint8_t> line_bits_, left_, right_;
  std::vector<along_change> along_;
  detail::block_vector<kept_plane> kept_;
  std::size_t used_kept_ = 0;
  std::vector<std::uint32_t> stale_plane_, stale_space_;
  std::vector<std::uint32_t> needless_;  ///< bricks that may have become unnecessary
};

}  // namespace orbis::nav

#ifndef ORBIS_COMPILED
#include <orbis/nav/squared_distances-inl.hpp>
#endif

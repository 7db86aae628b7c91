// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Moving regions of a depth image, grown from pixels that are known to be moving or static.
///
/// @code
///   orbis::mapping::moving_regions<orbis::camera::pinhole> regions{camera};
///   std::vector<orbis::mapping::marked_pixel> marks;
///   for (const auto& f : slam.last_frame().value().features)
///     if (f.moving || f.tracked) marks.push_back({f.x, f.y, f.moving});
///   if (regions.find(depth, marks)) regions.remove(depth, copy.view());  // copy: of the stored values of depth
/// @endcode
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>
#include <orbis/mapping/detail/moving/depth_cells.hpp>
#include <orbis/mapping/detail/moving/moving_judge.hpp>
#include <orbis/mapping/masked_depth.hpp>
#include <orbis/mapping/moving_options.hpp>

namespace orbis::mapping {

/// A pixel that is known to be on a moving or static object.
struct marked_pixel {
  float x = 0.0F, y = 0.0F;
  bool moves = false;
};

struct moving_region_options {
  /// Maximum distance along a surface from a marked pixel, metres.
  float reach = 0.8F;
  /// Minimum number of marked pixels on moving objects; with fewer, nothing is removed.
  std::size_t least_marks = 5;
};

/// Grows marked pixels along the surfaces of a depth image, moving and static ones at the same time: a cell is moving
/// if its nearest mark is. Surfaces end at depth discontinuities. The remaining pixels of a keyframe can be integrated
/// into a map. Tracking detects moving objects in front of the camera immediately (`slam::tracked_feature::moving`),
/// including a person walking along with the camera, through whom no later ray passes; `moving_filter` detects moved
/// objects that tracking has missed.
///
/// Works on cells of 4x4 pixels. Reuses its memory: allocates nothing after the first few images. Not thread-safe.
template <camera::camera_model Camera>
class moving_regions {
 public:
  /// @pre options.reach >= 0
  explicit moving_regions(const Camera& camera, const moving_region_options& options = {})
      : options_{options}, grid_{camera} {}

  /// Finds the moving regions. Returns true if there are any. O(pixels + cells log cells); returns immediately if no
  /// mark is moving. @pre the image has the camera's size
  template <camera::depth_source Depth>
  [[nodiscard]] bool find(const Depth& depth, std::span<const marked_pixel> marks) {
    removed_.clear();
    const auto moving = std::count_if(marks.begin(), marks.end(), [](const marked_pixel& m) { return m.moves; });
    if (moving == 0 || static_cast<std::size_t>(moving) < options_.least_marks) return false;
    take(depth);
    begin(marks);
    grow();
    for (std::size_t i = 0; i != label_.size(); ++i)
      if (label_[i] == label::moves) removed_.push_back({static_cast<std::uint32_t>(i), depth_[i]});
    return !removed_.empty();
  }

  /// Writes the stored values of `depth` to `out`, with 0 in moving regions. Returns the number of removed pixels.
  /// O(pixels). @pre `depth` is the image that `find` was called with; `out` has the same size
  template <camera::depth_source Depth>
  std::size_t remove(const Depth& depth, image_view<camera::depth_pixel<Depth>> out) const {
    for (int y = 0; y != depth.height(); ++y)
      for (int x = 0; x != depth.width(); ++x) out(x, y) = stored_depth(depth, x, y);
    return detail::remove_cells(depth, removed_, same_surface_, out);
  }

 private:
  enum class label : std::uint8_t { unknown, stands, moves };
  /// A cell reached from a mark along a surface.
  struct step {
    float way;  ///< distance along the surface, metres
    std::uint32_t cell;
    label what;
    [[nodiscard]] friend bool operator<(const step& a, const step& b) noexcept {  // the nearest is first in a heap
      return a.way > b.way || (a.way == b.way && a.cell > b.cell);
    }
  };

  template <class Depth>
  void take(const Depth& depth) {
    constexpr int edge = detail::cell_grid::edge;
    depth_.assign(grid_.size(), 0.0F);
    for (int y = 0; y != depth.height(); ++y)
      for (int x = 0; x != depth.width(); ++x) {
        const float z = depth(x, y);
        float& nearest = depth_[static_cast<std::size_t>(y / edge * grid_.across + x / edge)];
        if (z > 0.0F && (nearest == 0.0F || z < nearest)) nearest = z;
      }
    for (std::size_t i = 0; i != depth_.size(); ++i)
      if (std::isnan(grid_.rays[i].x())) depth_[i] = 0.0F;
  }

  /// Calls `visit(neighbour)` for the adjacent cells on the same surface. Returns true if all adjacent cells with depth
  /// are on that surface.
  template <class Visit>
  bool around(std::size_t cell, const Visit& visit) const {
    const int x = static_cast<int>(cell) % grid_.across, y = static_cast<int>(cell) / grid_.across;
    const float z = depth_[cell];
    bool all = true;
    for (int v = std::max(0, y - 1); v <= std::min(grid_.down - 1, y + 1); ++v)
      for (int u = std::max(0, x - 1); u <= std::min(grid_.across - 1, x + 1); ++u) {
        const auto j = static_cast<std::size_t>(v * grid_.across + u);
        if (j == cell || depth_[j] == 0.0F) continue;
        const float nearer = std::min(z, depth_[j]);
        if (std::abs(depth_[j] - z) <= 2.0F * detail::depth_margin(same_surface_, nearer))
          visit(j);
        else
          all = false;
      }
    return all;
  }
  [[nodiscard]] vec3f point(std::size_t cell) const {
    return depth_[cell] * vec3f(grid_.rays[cell].x(), grid_.rays[cell].y(), 1.0F);
  }

  void push(const step& s) {
    open_.push_back(s);
    std::push_heap(open_.begin(), open_.end());
  }
  void begin(std::span<const marked_pixel> marks) {
    label_.assign(grid_.size(), label::unknown);
    open_.clear();
    for (const marked_pixel& m : marks) {
      constexpr float edge = detail::cell_grid::edge;
      const float x = (m.x + 0.5F) / edge, y = (m.y + 0.5F) / edge;
      if (!(m.x >= 0.0F && m.y >= 0.0F && x < static_cast<float>(grid_.across) && y < static_cast<float>(grid_.down)))
        continue;
      const auto cell = static_cast<std::size_t>(static_cast<int>(y) * grid_.across + static_cast<int>(x));
      if (depth_[cell] == 0.0F) continue;
      // At an edge it is ambiguous which surface a mark belongs to.
      if (around(cell, [](std::size_t) {}))
        push({0.0F, static_cast<std::uint32_t>(cell), m.moves ? label::moves : label::stands});
    }
  }
  /// Dijkstra's algorithm, started from all marks simultaneously.
  void grow() {
    while (!open_.empty()) {
      std::pop_heap(open_.begin(), open_.end());
      const step s = open_.back();
      open_.pop_back();
      if (label_[s.cell] != label::unknown) continue;
      label_[s.cell] = s.what;
      around(s.cell, [&](std::size_t next) {
        const float way = s.way + norm(point(next) - point(s.cell));
        if (label_[next] == label::unknown && way <= options_.reach)
          push({way, static_cast<std::uint32_t>(next), s.what});
      });
    }
  }

  moving_region_options options_;
  moving_filter_options same_surface_;
  detail::cell_grid grid_;
  std::vector<float> depth_;  ///< depth of each cell's nearest pixel, metres; 0: no depth
  std::vector<label> label_;
  std::vector<step> open_;
  std::vector<detail::removed_cell> removed_;
};

}  // namespace orbis::mapping

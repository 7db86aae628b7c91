// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removes moving objects from a live map: the pixels of the last keyframes that the rays of other keyframes pass
/// through are taken out of their depth images while the camera moves.
///
/// The log-odds of a voxel become those of free space only if more rays pass through it than end in it. Somebody who
/// walks through a room leaves voxels in which one or two scans end and which few later scans see. The depth images of
/// a few keyframes tell more, because each measurement says that the space before its end is empty.
/// `cloud/ray_evidence.hpp` does the same for a whole cloud, and names its sources. Coarse depth images that decide and
/// can be overruled later are described by G. Kim, A. Kim, "Remove, then Revert: Static Point Cloud Map Construction
/// Using Multiresolution Range Images", IROS 2020.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/mapping/depth_history.hpp>
#include <orbis/mapping/detail/moving/depth_cells.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/scan_history.hpp>

namespace orbis::mapping {

struct moving_filter_options {
  std::size_t keyframes = 8;      ///< so many of the last ones judge each other; the older ones stay as they are
  /// Two depths z are the same if they differ by less than margin + margin_growth z^2, which covers noise and small
  /// errors of poses. Metres; 1 / metres.
  float margin = 0.03F;
  float margin_growth = 0.0075F;
  /// A ray passes through a point only if what it ends at is farther away by the margin and by this many times the
  /// range of depths around that end: rays that graze a surface prove nothing.
  float slant = 1.0F;
  int min_through = 1;  ///< a cell is taken out if the rays of at least so many keyframes pass through it, > 0,
  double ratio = 1.0;   ///< and of more than this many times as many as show it
  int grow = 4;  ///< cells up to this far from one that is taken out go too, if of the same surface and shown by no more
  /// A keyframe that is in the map already is marked again only where so much of its image has got another verdict, or
  /// when it leaves the last keyframes.
  double least_change = 0.002;
};

/// Judges the last keyframes of a live map by each other, and gives the map the result: a later keyframe whose rays pass
/// through what an earlier one shows takes it out, and one that shows it again brings it back. The result is a depth
/// image with fewer pixels (`live_map::set_depth`), so that the map stays the one of these images and the keyframes'
/// poses. Keyframes are compared at the poses that the map was told last (`live_map::wanted_pose`), for those are of
/// one moment; in the map, a keyframe that waits for a correction is still at an earlier one.
///
/// Keeps the last keyframes' depth images: 3.5 bytes a pixel for each. Memory is kept from keyframe to keyframe.
template <camera::camera_model Camera>
class moving_filter {
 public:
  using depth_view = camera::depth_view<std::uint16_t>;

  /// @pre options.keyframes > 0, min_through > 0; margins, slant and ratio >= 0
  explicit moving_filter(Camera camera, const moving_filter_options& options = {})
      : camera_{std::move(camera)}, options_{options}, grid_{camera_} {
    assert(options.keyframes > 0 && options.min_through > 0 && options.ratio >= 0 && options.slant >= 0);
  }

  /// live_map::add_keyframe, without the pixels that the last keyframes look through; and then set_depth for those of
  /// them that this one judges otherwise than before, whose change the map follows with `correct`. A keyframe with a
  /// pose that is not finite goes to the map as it is. The same for every policy. Errors: those of both. O(pixels +
  /// cells x keyframes), and marking. @pre as for add_keyframe; `map` is always the same
  template <execution_policy Policy, octree::replayable_octree Octree, depth_history Depths>
  result<octree::integration_summary> add_keyframe(const Policy& policy, live_map<Octree, Camera, Depths>& map,
                                                   std::uint64_t frame, const depth_view& depth,
                                                   const se3& T_world_camera) {
    forget(frame);
    if (!T_world_camera.to_matrix().allFinite()) return map.add_keyframe(policy, frame, depth, T_world_camera);
    view& now = make_view();
    now.frame = frame;
    now.scale = depth.scale();
    now.min_depth = depth.min_depth();
    now.max_depth = depth.max_depth();
    for (int y = 0; y != depth.height(); ++y) {
      const auto row = depth.pixels().row(y);
      std::copy(row.begin(), row.end(), now.pixels.row(y).begin());
    }
    now.cells.take(policy, depth, grid_);
    now.through.assign(now.cells.size(), 0);
    now.shown.assign(now.cells.size(), 0);
    now.removed.assign(now.cells.size(), 0);
    for (view& v : views_) {
      if (&v == &now) continue;
      const std::optional<se3> pose = map.wanted_pose(v.frame);
      if (!pose) continue;
      ask(policy, v, now, T_world_camera.inverse() * *pose);
      ask(policy, now, v, pose->inverse() * T_world_camera);
    }
    result<octree::integration_summary> added{};
    if (judge(now) == 0) {
      added = map.add_keyframe(policy, frame, depth, T_world_camera);
    } else {
      now.removed = verdict_;
      added = map.add_keyframe(policy, frame, masked(now), T_world_camera, completeness::filtered);
    }
    result<void> changed{};
    for (view& v : views_) {
      if (&v == &now) continue;
      const std::size_t differ = judge(v);
      const bool leaves = views_.size() == options_.keyframes && &v == &views_.front();
      if (differ == 0 ||
          (!leaves && static_cast<double>(differ) < options_.least_change * static_cast<double>(v.cells.size())))
        continue;
      v.removed = verdict_;
      if (!map.contains(v.frame)) continue;
      if (auto set = map.set_depth(policy, v.frame, masked(v)); !set && changed) changed = std::move(set);
    }
    if (added && !changed) return fail(std::move(changed.error()));
    return added;
  }
  /// Judges this keyframe no more, nor by it: it was removed, or has got another verdict from elsewhere.
  void forget(std::uint64_t frame) {
    const auto at = std::find_if(views_.begin(), views_.end(), [&](const view& v) { return v.frame == frame; });
    if (at == views_.end()) return;
    spare_.push_back(std::move(*at));
    views_.erase(at);
  }
  /// Which share of a kept keyframe's cells is taken out; empty if it is not kept. O(cells).
  [[nodiscard]] std::optional<double> removed_share(std::uint64_t frame) const {
    const auto at = std::find_if(views_.begin(), views_.end(), [&](const view& v) { return v.frame == frame; });
    if (at == views_.end()) return std::nullopt;
    return static_cast<double>(std::count(at->removed.begin(), at->removed.end(), std::uint8_t{1})) /
           static_cast<double>(at->removed.size());
  }
  [[nodiscard]] const moving_filter_options& options() const noexcept { return options_; }

 private:
  static constexpr int edge = detail::cell_grid::edge;

  struct view {
    std::uint64_t frame = 0;
    image<std::uint16_t> pixels;
    double scale = 1.0;
    float min_depth = 0.0F, max_depth = 0.0F;
    detail::depth_cells cells;
    std::vector<std::uint8_t> through;  ///< how many other views' rays pass through each cell
    std::vector<std::uint8_t> shown;    ///< how many others show it as well
    std::vector<std::uint8_t> removed;  ///< 1: not in the map
  };

  /// A view for a new keyframe, in the memory of the oldest where there are enough.
  [[nodiscard]] view& make_view() {
    view next;
    if (views_.size() == options_.keyframes) {
      next = std::move(views_.front());
      views_.pop_front();
    } else if (!spare_.empty()) {
      next = std::move(spare_.back());
      spare_.pop_back();
    }
    if (next.pixels.width() != camera_.width() || next.pixels.height() != camera_.height())
      next.pixels = image<std::uint16_t>(camera_.width(), camera_.height());
    views_.push_back(std::move(next));
    return views_.back();
  }
  /// Counts what `by` says about the cells of `about`.
  template <class Policy>
  void ask(const Policy& policy, view& about, const view& by, const se3& T_by_about) const {
    const auto count = [](std::uint8_t& n) { n = static_cast<std::uint8_t>(n + (n != 255 ? 1 : 0)); };
    const auto with_model = [&](const auto& model) {
      about.cells.ask(
          policy, by.cells, grid_, model, T_by_about, options_.slant, [&](float z) { return margin(z); },
          [&](std::size_t cell, detail::visibility seen) {
            count(seen == detail::visibility::through ? about.through[cell] : about.shown[cell]);
          });
    };
    if constexpr (requires { camera_.visit(with_model); })
      camera_.visit(with_model);
    else
      with_model(camera_);
  }
  [[nodiscard]] float margin(float z) const noexcept {
    return options_.margin + rounded_product(options_.margin_growth, rounded_product(z, z));
  }
  /// Puts the verdict on a view into `verdict_`; returns how many of its cells have another one than before.
  [[nodiscard]] std::size_t judge(const view& v) {
    const int across = grid_.across, down = grid_.down;
    const auto passed = [&](std::size_t i) {
      return v.through[i] >= options_.min_through && v.through[i] > options_.ratio * v.shown[i];
    };
    verdict_.assign(v.cells.size(), 0);
    bool any = false;
    for (int y = 0; y != down; ++y)
      for (int x = 0; x != across; ++x) {
        const auto i = static_cast<std::size_t>(y * across + x);
        if (passed(i)) {
          // One cell alone is noise, or the edge of something.
          int beside = 0;
          for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx)
              if (y + dy >= 0 && y + dy < down && x + dx >= 0 && x + dx < across && (dx != 0 || dy != 0))
                beside += passed(static_cast<std::size_t>((y + dy) * across + x + dx)) ? 1 : 0;
          verdict_[i] = beside >= 2 ? 1 : 0;
          any = any || beside >= 2;
        }
      }
    for (int n = 0; any && n != options_.grow; ++n) grow(v);
    std::size_t differ = 0;
    for (std::size_t i = 0; i != verdict_.size(); ++i) differ += verdict_[i] != v.removed[i] ? 1 : 0;
    return differ;
  }
  /// Takes out the cells beside those that are taken out, if they are of the same surface and nothing is known of them.
  void grow(const view& v) {
    const int across = grid_.across, down = grid_.down;
    grown_.clear();
    for (int y = 0; y != down; ++y)
      for (int x = 0; x != across; ++x) {
        const auto i = static_cast<std::size_t>(y * across + x);
        const float z = v.cells.depth(i);
        if (verdict_[i] != 0 || z == 0.0F || v.shown[i] > v.through[i]) continue;
        const auto reaches = [&](int u, int w) {
          if (u < 0 || u >= across || w < 0 || w >= down) return false;
          const auto j = static_cast<std::size_t>(w * across + u);
          return verdict_[j] != 0 && std::abs(v.cells.depth(j) - z) <= margin(z);
        };
        if (reaches(x - 1, y) || reaches(x + 1, y) || reaches(x, y - 1) || reaches(x, y + 1)) grown_.push_back(i);
      }
    for (const std::size_t i : grown_) verdict_[i] = 1;
  }
  /// The depth image without what was removed: the pixels of a removed cell and of those beside it that belong to the
  /// same surface.
  [[nodiscard]] depth_view masked(const view& v) {
    if (masked_.width() != v.pixels.width() || masked_.height() != v.pixels.height())
      masked_ = image<std::uint16_t>(v.pixels.width(), v.pixels.height());
    for (int y = 0; y != v.pixels.height(); ++y) {
      const auto row = v.pixels.row(y);
      std::copy(row.begin(), row.end(), masked_.row(y).begin());
    }
    const int across = grid_.across;
    for (std::size_t i = 0; i != v.removed.size(); ++i) {
      if (v.removed[i] == 0) continue;
      const float z = v.cells.depth(i), reach = 2.0F * margin(z);
      const double low = static_cast<double>(z - reach) * v.scale, high = static_cast<double>(z + reach) * v.scale;
      const double own_high = high + rounded_product(0.15, v.scale);
      const int x0 = (static_cast<int>(i) % across - 1) * edge, y0 = (static_cast<int>(i) / across - 1) * edge;
      for (int y = std::max(0, y0); y < std::min(masked_.height(), y0 + 3 * edge); ++y)
        for (int x = std::max(0, x0); x < std::min(masked_.width(), x0 + 3 * edge); ++x) {
          // Where a surface turns away, its cell's other pixels lie well behind the nearest one.
          const bool own = x >= x0 + edge && x < x0 + 2 * edge && y >= y0 + edge && y < y0 + 2 * edge;
          std::uint16_t& pixel = masked_(x, y);
          if (static_cast<double>(pixel) >= low && static_cast<double>(pixel) <= (own ? own_high : high)) pixel = 0;
        }
    }
    return depth_view{masked_.view(), v.scale, v.min_depth, v.max_depth};
  }

  Camera camera_;
  moving_filter_options options_;
  detail::cell_grid grid_;
  std::deque<view> views_;  ///< the last keyframes, the oldest first
  std::vector<view> spare_;
  std::vector<std::uint8_t> verdict_;
  std::vector<std::size_t> grown_;
  image<std::uint16_t> masked_;
};

}  // namespace orbis::mapping

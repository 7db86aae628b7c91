// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Detects cells in the most recent keyframes' depth images that show moved objects, using the rays of the other
/// keyframes.
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
#include <orbis/core/rounded.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/mapping/detail/moving/depth_cells.hpp>
#include <orbis/mapping/masked_depth.hpp>
#include <orbis/mapping/moving_options.hpp>

namespace orbis::mapping::detail {

/// A cell that is removed from a depth image.
struct removed_cell {
  std::uint32_t cell = 0;
  float depth = 0.0F;  ///< depth of its nearest pixel, metres
};

/// Sets the pixels of `cells` to 0 in `pixels`, a copy of the stored values of `depth`, and also the pixels of adjacent
/// cells that belong to the same surface. Returns the number of removed pixels. O(cells)
template <camera::depth_source Depth>
std::size_t remove_cells(const Depth& depth, const std::vector<removed_cell>& cells,
                         const moving_filter_options& options, image_view<camera::depth_pixel<Depth>> pixels) {
  constexpr int edge = cell_grid::edge;
  const int across = (depth.width() + edge - 1) / edge;
  std::size_t removed = 0;
  for (const removed_cell& c : cells) {
    const float reach = 2.0F * depth_margin(options, c.depth), low = c.depth - reach, high = c.depth + reach;
    const float own_high = high + 0.15F;
    const int x0 = (static_cast<int>(c.cell) % across - 1) * edge, y0 = (static_cast<int>(c.cell) / across - 1) * edge;
    for (int y = std::max(0, y0); y < std::min(depth.height(), y0 + 3 * edge); ++y)
      for (int x = std::max(0, x0); x < std::min(depth.width(), x0 + 3 * edge); ++x) {
        // On an oblique surface, the other pixels of a cell are much farther away than the nearest one.
        const bool own = x >= x0 + edge && x < x0 + 2 * edge && y >= y0 + edge && y < y0 + 2 * edge;
        const float z = depth(x, y);
        if (!(z >= low && z <= (own ? own_high : high)) || pixels(x, y) == 0) continue;
        pixels(x, y) = 0;
        ++removed;
      }
  }
  return removed;
}

/// The most recent keyframes, and the evidence that their rays provide about each other. See moving_filter.
template <camera::camera_model Camera>
class moving_judge {
 public:
  using depth_view = camera::depth_view<std::uint16_t>;

  struct view {
    std::uint64_t frame = 0;
    image<std::uint16_t> pixels;
    double scale = 1.0;
    float min_depth = 0.0F, max_depth = 0.0F;
    depth_cells cells;
    std::vector<std::uint8_t> through;  ///< number of other views whose rays pass through each cell
    std::vector<std::uint8_t> shown;    ///< number of other views that also show each cell
    std::vector<std::uint8_t> removed;  ///< 1: removed by the last accepted verdict
    bool due = false;                   ///< true if the evidence of the newest view has not been collected
    bool unjudged = false;              ///< true if the view has new evidence since its last evaluation

    [[nodiscard]] depth_view depth() const { return depth_view{pixels.view(), scale, min_depth, max_depth}; }
    [[nodiscard]] std::vector<removed_cell> removed_cells() const {
      std::vector<removed_cell> out;
      for (std::size_t i = 0; i != removed.size(); ++i)
        if (removed[i] != 0) out.push_back({static_cast<std::uint32_t>(i), cells.depth(i)});
      return out;
    }
  };

  /// @pre options.keyframes > 0, min_through > 0; margins, slant, ratio and grow >= 0
  moving_judge(Camera camera, const moving_filter_options& options)
      : camera_{std::move(camera)}, options_{options}, grid_{camera_} {
    assert(options.keyframes > 0 && options.min_through > 0 && options.ratio >= 0 && options.slant >= 0 &&
           options.grow >= 0);
  }

  /// Adds a keyframe, in place of the oldest if the window is full, and collects the evidence of the other views for
  /// its cells. `pose_of(view)` returns the pose of a view, if it has one. Marks the other views as due: the evidence
  /// of the new keyframe for their cells is collected by ask_newest. The result is the same for every policy. O(pixels
  /// + cells x keyframes). @pre the pose is finite; depth has the camera's size; no other view is due
  template <execution_policy Policy, class PoseOf>
  view& add(const Policy& policy, std::uint64_t frame, const depth_view& depth, const se3& T_world_camera,
            const PoseOf& pose_of) {
    view& now = make_view();
    now.frame = frame;
    now.scale = depth.scale();
    now.min_depth = depth.min_depth();
    now.max_depth = depth.max_depth();
    copy_pixels<std::uint16_t>(depth.pixels(), now.pixels);
    now.cells.take(policy, depth, grid_);
    now.through.assign(now.cells.size(), 0);
    now.shown.assign(now.cells.size(), 0);
    now.removed.assign(now.cells.size(), 0);
    now.due = now.unjudged = false;
    for (view& v : views_) {
      if (&v == &now) continue;
      assert(!v.due);
      v.due = true;
      if (const std::optional<se3> pose = pose_of(std::as_const(v)))
        ask(policy, now, v, pose->inverse() * T_world_camera);
    }
    return now;
  }
  /// Collects the evidence of the newest keyframe for the cells of view `about`, if that view is due. O(cells).
  template <execution_policy Policy, class PoseOf>
  void ask_newest(const Policy& policy, view& about, const PoseOf& pose_of) {
    if (!std::exchange(about.due, false)) return;
    const view& newest = views_.back();
    const std::optional<se3> by = pose_of(newest), of = pose_of(std::as_const(about));
    if (by && of) ask(policy, about, newest, by->inverse() * *of);
  }
  /// Evaluates a view using the current evidence; returns the number of cells that differ from the last accepted
  /// verdict. O(cells).
  [[nodiscard]] std::size_t judge(view& v) {
    v.unjudged = false;
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
          // A single cell may be noise or the edge of an object.
          int beside = 0;
          for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx)
              if (y + dy >= 0 && y + dy < down && x + dx >= 0 && x + dx < across && (dx != 0 || dy != 0))
                beside += passed(static_cast<std::size_t>((y + dy) * across + x + dx)) ? 1 : 0;
          verdict_[i] = beside >= 2 ? 1 : 0;
          any = any || beside >= 2;
        }
      }
    for (int n = 0; any && n < options_.grow; ++n) grow(v);
    std::size_t differ = 0;
    for (std::size_t i = 0; i != verdict_.size(); ++i) differ += verdict_[i] != v.removed[i] ? 1 : 0;
    return differ;
  }
  /// Accepts the last verdict. @pre the last verdict is for this view
  void accept(view& v) const { v.removed = verdict_; }
  /// The view's depth image without the removed cells. Valid until the next call.
  [[nodiscard]] depth_view masked(const view& v) {
    copy_pixels<std::uint16_t>(v.pixels, masked_);
    remove_cells(v.depth(), v.removed_cells(), options_, masked_.view());
    return depth_view{masked_.view(), v.scale, v.min_depth, v.max_depth};
  }
  void forget(std::uint64_t frame) {
    const auto at = std::find_if(views_.begin(), views_.end(), [&](const view& v) { return v.frame == frame; });
    if (at == views_.end()) return;
    if (&*at == &views_.back())
      for (view& v : views_) v.due = false;  // no view is left to compare with
    spare_.push_back(std::move(*at));
    views_.erase(at);
  }
  /// The most recent keyframes, the oldest first. If the window is full, the oldest is replaced when the next one is
  /// added.
  [[nodiscard]] std::deque<view>& views() noexcept { return views_; }
  [[nodiscard]] const std::deque<view>& views() const noexcept { return views_; }
  [[nodiscard]] bool is_full() const noexcept { return views_.size() == options_.keyframes; }
  [[nodiscard]] const moving_filter_options& options() const noexcept { return options_; }

 private:
  /// Returns a view for a new keyframe, which reuses the memory of the oldest view if the window is full.
  [[nodiscard]] view& make_view() {
    view next;
    if (views_.size() == options_.keyframes) {
      next = std::move(views_.front());
      views_.pop_front();
    } else if (!spare_.empty()) {
      next = std::move(spare_.back());
      spare_.pop_back();
    }
    views_.push_back(std::move(next));
    return views_.back();
  }
  /// Counts the evidence that view `by` provides about the cells of view `about`.
  template <class Policy>
  void ask(const Policy& policy, view& about, const view& by, const se3& T_by_about) const {
    about.unjudged = true;
    const auto count = [](std::uint8_t& n) { n = static_cast<std::uint8_t>(n + (n != 255 ? 1 : 0)); };
    camera::with_model(camera_, [&](const auto& model) {
      about.cells.ask(
          policy, by.cells, grid_, model, T_by_about, options_.slant,
          [&](float z) { return depth_margin(options_, z); },
          [&](std::size_t cell, visibility seen) {
            count(seen == visibility::through ? about.through[cell] : about.shown[cell]);
          });
    });
  }
  /// Also removes the neighbours of removed cells if they belong to the same surface, see moving_filter_options::grow.
  void grow(const view& v) {
    const int across = grid_.across, down = grid_.down;
    grown_.clear();
    for (int y = 0; y != down; ++y)
      for (int x = 0; x != across; ++x) {
        const auto i = static_cast<std::size_t>(y * across + x);
        const float z = v.cells.depth(i);
        const int excess = v.through[i] != 0 ? 1 : 0;  // two keyframes in succession see a moving object at one place
        if (verdict_[i] != 0 || z == 0.0F || v.shown[i] > v.through[i] + excess) continue;
        const auto reaches = [&](int u, int w) {
          if (u < 0 || u >= across || w < 0 || w >= down) return false;
          const auto j = static_cast<std::size_t>(w * across + u);
          return verdict_[j] != 0 && std::abs(v.cells.depth(j) - z) <= depth_margin(options_, z);
        };
        if (reaches(x - 1, y) || reaches(x + 1, y) || reaches(x, y - 1) || reaches(x, y + 1)) grown_.push_back(i);
      }
    for (const std::size_t i : grown_) verdict_[i] = 1;
  }

  Camera camera_;
  moving_filter_options options_;
  cell_grid grid_;
  std::deque<view> views_;
  std::vector<view> spare_;
  std::vector<std::uint8_t> verdict_;  ///< the most recent verdict; 1: removed
  std::vector<std::size_t> grown_;
  image<std::uint16_t> masked_;
};

}  // namespace orbis::mapping::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of ray_evidence_counter.hpp.
#pragma once

#include <atomic>
#include <cassert>
#include <span>

#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/rays/ray_kernels.hpp>
#include <orbis/cloud/detail/rays/take_depth_windows.hpp>
#include <orbis/cloud/ray_evidence_counter.hpp>

namespace orbis::cloud {
namespace detail {

/// Copies the finite points into blocks in the order of `leaf_order`. O(n), 16 bytes per point, including temporary
/// memory; the same result for every policy. Coordinates are converted to float. @pre fewer than 2^32 points
template <execution_policy Policy>
[[nodiscard]] point_blocks make_point_blocks(const Policy& policy, const point_view& points) {
  constexpr std::size_t size = point_blocks::block_size;
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float inf = std::numeric_limits<float>::infinity();
  leaf_order order{policy, points, std::numeric_limits<std::size_t>::max()};
  point_blocks out;
  out.index.reserve(order.entries().size());
  for (const auto& entry : order.entries()) out.index.push_back(entry.index);
  order.drop_entries();
  if (out.index.empty()) return out;
  const std::size_t count = (out.index.size() + size - 1) / size;
  for (auto& axis : out.axis) axis.resize(count * size, nan);
  out.blocks.resize(count);
  for_each_index(policy, count, 32, [&](std::size_t b) {
    point_blocks::box box{{inf, inf, inf}, {-inf, -inf, -inf}};
    for (std::size_t i = b * size; i != std::min(out.index.size(), (b + 1) * size); ++i) {
      const auto p = order.position(out.index[i]);
      for (std::size_t a = 0; a != 3; ++a) {
        out.axis[a][i] = p[a];
        box.low[a] = std::min(box.low[a], p[a]);
        box.high[a] = std::max(box.high[a], p[a]);
      }
    }
    out.blocks[b] = box;
  });
  for (std::size_t b = 0; b < count; b += point_blocks::group_size) {
    const std::size_t end = std::min(count, b + point_blocks::group_size);
    out.groups.push_back(enclosing_box(std::span{out.blocks}.subspan(b, end - b)));
  }
  return out;
}

}  // namespace detail

template <camera::camera_model Camera>
template <execution_policy Policy>
ray_evidence_counter<Camera>::ray_evidence_counter(const Policy& policy, const detail::point_view& points,
                                                   const Camera& camera, const ray_evidence_options& options)
    : camera_{camera},
      options_{options},
      size_{points.size()},
      blocks_{detail::make_point_blocks(policy, points)},
      through_(blocks_.axis[0].size(), 0),
      supported_(blocks_.axis[0].size(), 0),
      test_{camera_} {
  assert(options.window >= 0 && options.margin >= 0 && options.margin_growth >= 0 && options.slant >= 0);
}

template <camera::camera_model Camera>
template <execution_policy Policy, posed_depth View>
void ray_evidence_counter<Camera>::add(const Policy& policy, const View& view) {
  assert(view.depth.width() == camera_.width() && view.depth.height() == camera_.height());
  if (blocks_.index.empty()) return;
  windows_.take(policy, view.depth, options_.window);
  add(policy, windows_, view.T_world_camera);
}

template <camera::camera_model Camera>
template <execution_policy Policy>
void ray_evidence_counter<Camera>::add(const Policy& policy, const detail::depth_windows& windows,
                                       const se3& T_world_camera) {
  change(policy, windows, T_world_camera, detail::ray_kernels{}.count);
}

template <camera::camera_model Camera>
template <execution_policy Policy, posed_depth View>
void ray_evidence_counter<Camera>::remove(const Policy& policy, const View& view) {
  assert(view.depth.width() == camera_.width() && view.depth.height() == camera_.height());
  assert(refuted_.empty());
  if (blocks_.index.empty()) return;
  windows_.take(policy, view.depth, options_.window);
  change(policy, windows_, view.T_world_camera, detail::ray_kernels{}.take_back);
}

template <camera::camera_model Camera>
template <execution_policy Policy, posed_depth View>
void ray_evidence_counter<Camera>::review(const Policy& policy, const View& view) {
  assert(view.depth.width() == camera_.width() && view.depth.height() == camera_.height());
  const se3 pose = view.T_world_camera;
  if (!all_finite(pose.to_matrix()) || blocks_.index.empty()) return;
  for (auto* counters : {&through_dropped_, &refuted_}) counters->resize(through_.size(), 0);
  windows_.take(policy, view.depth, options_.window);
  const detail::ray_view placed = view_at(pose, windows_);
  test_.place(pose, placed, windows_);

  const int tile = tile_size(placed.width);
  const int across = (placed.width + tile - 1) / tile;
  const int down = (placed.height + tile - 1) / tile;
  const auto tile_of = [&](std::int32_t pixel) {
    return static_cast<std::size_t>(pixel / placed.width / tile * across + pixel % placed.width / tile);
  };
  std::vector<std::atomic<std::int64_t>> balance(static_cast<std::size_t>(across * down));
  const auto weigh = [&](std::size_t first, const detail::seen_block& seen, const detail::block_verdict& verdict) {
    verdict.for_each([&](std::size_t i, bool supported) {
      const std::int64_t views = supported_[first + i];
      const float before = placed.nearest[seen.pixel[i]] - seen.depth[i];
      if (!supported && before > options_.ghost_reach) return;
      balance[tile_of(seen.pixel[i])].fetch_add(supported ? 3 * (views - 1) : -2 * views, std::memory_order_relaxed);
    });
  };
  for_each_seen_block(policy, placed, weigh);
  if (std::ranges::none_of(balance, [](const auto& b) { return b < 0; })) return;
  const auto refute = [&](std::size_t first, const detail::seen_block& seen, const detail::block_verdict& verdict) {
    verdict.for_each([&](std::size_t i, bool supported) {
      if (balance[tile_of(seen.pixel[i])] >= 0) return;
      std::uint16_t& counter = (supported ? refuted_ : through_dropped_)[first + i];
      if (counter != std::numeric_limits<std::uint16_t>::max()) ++counter;
    });
  };
  for_each_seen_block(policy, placed, refute);
}

template <camera::camera_model Camera>
std::vector<ray_evidence> ray_evidence_counter<Camera>::scores() const {
  std::vector<ray_evidence> out(size_);
  for (std::size_t i = 0; i != blocks_.index.size(); ++i) {
    ray_evidence& e = out[blocks_.index[i]];
    e = {through_[i], supported_[i]};
    if (refuted_.empty()) continue;
    e.refuted = refuted_[i];
    e.through = less(e.through, through_dropped_[i]);
    e.supported = less(e.supported, refuted_[i]);
  }
  return out;
}

template <camera::camera_model Camera>
template <class Policy, class Kernel>
void ray_evidence_counter<Camera>::change(const Policy& policy, const detail::depth_windows& windows, const se3& pose,
                                          const Kernel& kernel) {
  assert(windows.width() == camera_.width() && windows.height() == camera_.height());
  if (!all_finite(pose.to_matrix()) || blocks_.index.empty()) return;
  const detail::ray_view placed = view_at(pose, windows);
  test_.place(pose, placed, windows);
  for_each_seen_block(policy, placed, [&](std::size_t first, const auto&, const detail::block_verdict& verdict) {
    kernel(verdict.through, through_.data() + first);
    kernel(verdict.supported, supported_.data() + first);
  });
}

template <camera::camera_model Camera>
detail::ray_view ray_evidence_counter<Camera>::view_at(const se3& pose, const detail::depth_windows& windows) const {
  detail::ray_view view{.width = windows.width(),
                        .height = windows.height(),
                        .min_depth = std::max(0.0F, options_.min_depth),
                        .max_depth = options_.max_depth,
                        .margin = options_.margin,
                        .margin_growth = options_.margin_growth,
                        .slant = options_.slant,
                        .nearest = windows.nearest(),
                        .farthest = windows.farthest(),
                        .middle = windows.middle()};
  detail::place(view, pose);
  if constexpr (std::same_as<Camera, camera::pinhole>) {
    view.fx = static_cast<float>(camera_.k().fx);
    view.fy = static_cast<float>(camera_.k().fy);
    view.cx = static_cast<float>(camera_.k().cx + 0.5);
    view.cy = static_cast<float>(camera_.k().cy + 0.5);
  }
  return view;
}

template <camera::camera_model Camera>
template <execution_policy Policy, class F>
void ray_evidence_counter<Camera>::for_each_seen_block(const Policy& policy, const detail::ray_view& view, F&& f) {
  const detail::ray_kernels kernels;
  for_each_index(policy, blocks_.groups.size(), 2, [&](std::size_t group) {
    if (test_.says_nothing(blocks_.groups[group])) return;
    const std::size_t begin = group * detail::point_blocks::group_size;
    for (std::size_t b = begin; b != std::min(blocks_.blocks.size(), begin + detail::point_blocks::group_size); ++b) {
      if (test_.says_nothing(blocks_.blocks[b])) continue;
      const std::size_t first = b * detail::point_blocks::block_size;
      const detail::block_axes points{blocks_.axis[0].data() + first, blocks_.axis[1].data() + first,
                                      blocks_.axis[2].data() + first};
      detail::seen_block seen;
      if constexpr (std::same_as<Camera, camera::pinhole>) {
        kernels.locate(view, points, seen);
      } else {
        detail::locate_by(camera_, view, points, seen);
      }
      detail::block_verdict verdict;
      kernels.judge(view, seen, verdict);
      f(first, seen, verdict);
    }
  });
}

}  // namespace orbis::cloud

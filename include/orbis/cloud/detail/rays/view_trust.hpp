// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which depth measurements can speak as evidence: not stray pixels, and not views whose pose is wrong.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <ranges>
#include <span>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/cloud/detail/select/log_density.hpp>
#include <orbis/cloud/ray_evidence.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud::detail {

/// The depths of the eight pixels around one, opposite ones at i and 7 - i; 0 outside of the image.
template <camera::depth_source Depth>
[[nodiscard]] std::array<float, 8> depths_around(const Depth& depth, int x, int y) {
  std::array<float, 8> out{};
  std::size_t n = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      const int u = x + dx;
      const int v = y + dy;
      out[n++] = u >= 0 && v >= 0 && u < depth.width() && v < depth.height() ? depth(u, v) : 0.0F;
    }
  }
  return out;
}

/// Whether two of the pixels around agree with depth `z`, or two opposite ones with their mean: a
/// surface seen flat has no two pixels of one depth.
[[nodiscard]] inline bool agrees_with_neighbors(float z, const std::array<float, 8>& around, float margin) noexcept {
  int agree = 0;
  for (const float other : around) agree += other > 0 && std::abs(other - z) <= margin ? 1 : 0;
  if (agree >= 2) return true;
  constexpr float widest = 0.15F;  // of z: opposite pixels further apart lie on two surfaces
  for (std::size_t i = 0; i != 4; ++i) {
    const float a = around[i];
    const float b = around[7 - i];
    if (a > 0 && b > 0 && std::abs(a - b) <= widest * z && std::abs(0.5F * (a + b) - z) <= margin) return true;
  }
  return false;
}

/// The depth image in metres with stray pixels replaced: one with which fewer than two of those around it
/// agree, within `margin + margin_growth z^2`, gets their median, or none where fewer than five have a
/// depth. A stray pixel would testify for itself, and silence the rays of all pixels around it. O(pixels).
/// `out` is resized if it has another size.
template <execution_policy Policy, camera::depth_source Depth>
void remove_stray_pixels(const Policy& policy, const Depth& depth, float margin, float margin_growth,
                         image<float>& out) {
  if (out.width() != depth.width() || out.height() != depth.height()) out = image<float>(depth.width(), depth.height());
  for_each_index(policy, static_cast<std::size_t>(depth.height()), 16, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x != depth.width(); ++x) {
      const float z = depth(x, y);
      out(x, y) = z;
      if (!(z > 0)) continue;
      std::array<float, 8> around = depths_around(depth, x, y);
      if (agrees_with_neighbors(z, around, margin + margin_growth * z * z)) continue;
      const auto end = std::remove_if(around.begin(), around.end(), [](float d) { return !(d > 0); });
      const auto count = end - around.begin();
      out(x, y) = 0;
      if (count < 5) continue;
      std::nth_element(around.begin(), around.begin() + count / 2, end);
      out(x, y) = around[static_cast<std::size_t>(count / 2)];
    }
  });
}

/// Views with the stray pixels of their depth replaced, one at a time.
/// Calls `f(number, view)` for each; false from `f` ends it, and is returned.
template <execution_policy Policy, posed_depth_range Views, class F>
bool for_each_cleaned_view(const Policy& policy, const Views& views, const ray_evidence_options& options, F&& f) {
  struct cleaned_view {
    camera::depth_view<float> depth;
    se3 T_world_camera;
  };
  image<float> depth;
  std::uint32_t number = 0;
  for (const auto& view : views) {
    remove_stray_pixels(policy, view.depth, options.margin, options.margin_growth, depth);
    if (!f(number++, cleaned_view{camera::depth_view<float>(depth), view.T_world_camera})) return false;
  }
  return true;
}

struct view_trust_options {
  double conflict = 0.1;  ///< a view is distrusted beyond this,
  double excess = 3;      ///< and beyond so many times the usual view's
  int samples = 20;       ///< pixels across and down that each view is judged by; > 0
  std::size_t least = 4;  ///< fewer views cannot outvote one
};

/// Views that do not agree with the others, by number, ascending; and how little.
struct view_trust {
  std::vector<std::uint32_t> distrusted;
  double worst_conflict = 0;  ///< of a view with the others, 0 to 1
  double usual_conflict = 0;  ///< the median over the trusted views
};

/// What one view says of a tile of another: how many of its samples it passes through and how many it supports.
struct view_verdict {
  std::uint32_t of;
  std::uint32_t by;
  double conflict;  ///< passed through / (passed through + supported)
};

/// The median of the conflicts that a view has with those not left out; 0 where there are too few.
/// `verdicts`: those that it has a part in; `of` is itself or the other.
[[nodiscard]] inline double conflict_of(std::span<const view_verdict> verdicts, std::span<const char> left_out) {
  std::vector<double> values;
  for (const view_verdict& c : verdicts) {
    if (left_out[c.of] == 0 && left_out[c.by] == 0) values.push_back(c.conflict);
  }
  if (values.size() < 10) return 0;
  return quantile(values, 0.5);
}

/// Finds views whose pose is wrong by what they say of each other. A sample of the pixels of each is
/// tested by all others (`ray_evidence`), tile by tile: a wrong pose is contradicted all over the
/// image, a moving object in a part of it alone, so the median over the tiles counts. The worst view is left
/// out until none stands out; if that would be half of them, all are trusted. Deterministic.
/// O(views (pixels + samples of all views)). @pre views' images have the camera's size
template <execution_policy Policy, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] view_trust find_distrusted_views(const Policy& policy, const Views& views, const Camera& camera,
                                               const ray_evidence_options& evidence = {},
                                               const view_trust_options& options = {}, progress on_progress = {}) {
  constexpr int tiles = 4;   // across and down
  constexpr int enough = 6;  // verdicts on a tile
  const auto count = static_cast<std::uint32_t>(std::ranges::size(views));
  view_trust out;
  if (count < options.least) return out;

  std::vector<vec3f> samples;
  std::vector<std::uint32_t> place;  // view and tile
  std::uint32_t number = 0;
  for (const auto& view : views) {
    const se3 pose = view.T_world_camera;
    const std::uint32_t v = number++;
    if (!pose.to_matrix().allFinite()) continue;
    for (int j = 0; j != options.samples; ++j) {
      for (int i = 0; i != options.samples; ++i) {
        const int x = (2 * i + 1) * camera.width() / (2 * options.samples);
        const int y = (2 * j + 1) * camera.height() / (2 * options.samples);
        const float z = view.depth(x, y);
        if (!(z > 0) || !agrees_with_neighbors(z, depths_around(view.depth, x, y),
                                               evidence.margin + evidence.margin_growth * z * z))
          continue;
        const auto ray = camera.unproject({x, y});
        if (!ray) continue;
        samples.push_back((pose * (double{z} * *ray)).template cast<float>());
        place.push_back(v * tiles * tiles +
                        static_cast<std::uint32_t>(j * tiles / options.samples * tiles + i * tiles / options.samples));
      }
    }
  }

  std::vector<std::vector<view_verdict>> verdicts(count);  // for each view that has a part in them
  ray_evidence_counter<Camera> counter{policy, samples, camera, evidence};
  std::vector<ray_evidence> before = counter.scores();
  const bool finished = for_each_cleaned_view(policy, views, evidence, [&](std::uint32_t by, const auto& view) {
    counter.add(policy, view);
    std::vector<ray_evidence> scores = counter.scores();  // of all views so far
    for (std::size_t begin = 0; begin != place.size();) {
      std::size_t end = begin;
      const std::uint32_t of = place[begin] / (tiles * tiles);
      std::array<int, tiles * tiles> through{};
      std::array<int, tiles * tiles> supported{};
      for (; end != place.size() && place[end] / (tiles * tiles) == of; ++end) {
        through[place[end] % (tiles * tiles)] += scores[end].through - before[end].through;
        supported[place[end] % (tiles * tiles)] += scores[end].supported - before[end].supported;
      }
      begin = end;
      if (of == by) continue;
      for (std::size_t t = 0; t != tiles * tiles; ++t) {
        const int all = through[t] + supported[t];
        if (all < enough) continue;
        const view_verdict verdict{of, by, static_cast<double>(through[t]) / all};
        verdicts[of].push_back(verdict);
        verdicts[by].push_back(verdict);
      }
    }
    before.swap(scores);
    return on_progress(by + 1, count);
  });
  if (!finished) return out;

  std::vector<char> left_out(count, 0);
  std::vector<double> conflicts(count);
  for (;;) {
    std::vector<double> trusted;
    std::uint32_t worst = 0;
    for (std::uint32_t v = 0; v != count; ++v) {
      conflicts[v] = left_out[v] != 0 ? 0 : conflict_of(verdicts[v], left_out);
      if (left_out[v] == 0) trusted.push_back(conflicts[v]);
      if (conflicts[v] > conflicts[worst]) worst = v;
    }
    out.usual_conflict = quantile(trusted, 0.5);
    out.worst_conflict = std::max(out.worst_conflict, conflicts[worst]);
    if (conflicts[worst] <= options.conflict || conflicts[worst] <= options.excess * out.usual_conflict) break;
    left_out[worst] = 1;
    out.distrusted.push_back(worst);
    if (2 * out.distrusted.size() >= count) {  // nobody knows who is right
      out.distrusted.clear();
      break;
    }
  }
  std::sort(out.distrusted.begin(), out.distrusted.end());
  return out;
}

}  // namespace orbis::cloud::detail

// SPDX-License-Identifier: BSD-3-Clause
//
// Which points do rays pass through? Beside it a loop as one would write it: every point into every view,
// and the window around its pixel.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include <orbis/camera/cloud.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/cloud/ray_evidence-inl.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>

#include "mapping/depth_keyframes.hpp"

namespace {

using orbis::bench::depth_keyframes;
using orbis::cloud::ray_evidence;
using orbis::cloud::ray_evidence_options;
using views = std::vector<orbis::mapping::keyframe<>>;

/// The room's keyframes again and again.
views views_of_room(std::size_t count) {
  const auto all = depth_keyframes::room().keyframes();
  views out;
  for (std::size_t i = 0; i != count; ++i) out.push_back(all[i * 7 % all.size()]);
  return out;
}

/// `n` of the keyframes' points, image after image, or in no order.
const std::vector<orbis::vec3f>& points_of_room(std::size_t n, bool shuffled) {
  static std::deque<std::pair<std::pair<std::size_t, bool>, std::vector<orbis::vec3f>>> made;
  for (const auto& [name, points] : made) {
    if (name == std::pair{n, shuffled}) return points;
  }
  const depth_keyframes& scene = depth_keyframes::room();
  std::vector<orbis::vec3f> all;
  for (const auto& k : scene.keyframes()) {
    const auto seen =
        orbis::camera::unproject_depth(orbis::par, k.depth, scene.camera, {.stride = 2}, k.T_world_camera);
    all.insert(all.end(), seen.points.begin(), seen.points.end());
  }
  std::vector<orbis::vec3f> out;
  for (std::size_t i = 0; i != n; ++i) out.push_back(all[i * all.size() / n]);
  orbis::random_bits random{n};
  for (std::size_t i = n; shuffled && i-- > 1;) std::swap(out[i], out[random.below(static_cast<std::uint32_t>(i + 1))]);
  return made.emplace_back(std::pair{n, shuffled}, std::move(out)).second;
}

/// By hand, with the same rules.
std::vector<ray_evidence> plain_loop(const std::vector<orbis::vec3f>& points, const views& all,
                                     const orbis::camera::pinhole& camera, const ray_evidence_options& options) {
  std::vector<ray_evidence> out(points.size());
  for (const auto& view : all) {
    const Eigen::Matrix4f T = view.T_world_camera.inverse().to_matrix().cast<float>();
    for (std::size_t i = 0; i != points.size(); ++i) {
      const orbis::vec3f q = T.topLeftCorner<3, 3>() * points[i] + T.topRightCorner<3, 1>();
      if (q.z() <= 0) continue;
      const int u = static_cast<int>(
          std::floor(static_cast<float>(camera.k().fx) * q.x() / q.z() + static_cast<float>(camera.k().cx) + 0.5F));
      const int v = static_cast<int>(
          std::floor(static_cast<float>(camera.k().fy) * q.y() / q.z() + static_cast<float>(camera.k().cy) + 0.5F));
      if (u < 0 || v < 0 || u >= camera.width() || v >= camera.height()) continue;
      float nearest = std::numeric_limits<float>::infinity();
      float farthest = 0;
      bool whole = true;
      for (int y = v - options.window; y <= v + options.window; ++y) {
        for (int x = u - options.window; x <= u + options.window; ++x) {
          const bool inside = x >= 0 && y >= 0 && x < camera.width() && y < camera.height();
          const float z = inside ? view.depth(x, y) : 0.0F;
          whole = whole && z > 0;
          if (z > 0) nearest = std::min(nearest, z);
          farthest = std::max(farthest, z);
        }
      }
      const float margin = options.margin + options.margin_growth * q.z() * q.z();
      const float middle = view.depth(u, v);
      if (whole && nearest - q.z() > margin + options.slant * (farthest - nearest)) ++out[i].through;
      if ((whole && std::abs(nearest - q.z()) <= margin) || (farthest > 0 && std::abs(farthest - q.z()) <= margin) ||
          (middle > 0 && std::abs(middle - q.z()) <= margin))
        ++out[i].supported;
    }
  }
  return out;
}

void add(std::size_t n, std::size_t count, bool shuffled) {
  const std::string group = "ray_evidence/n:" + std::to_string(n) + "/views:" + std::to_string(count) +
                            (shuffled ? "/shuffled/" : "/640x480/");
  const auto row = [&](const std::string& who, auto scores) {
    benchmark::RegisterBenchmark((group + who).c_str(),
                                 [=](benchmark::State& state) {
                                   const auto& points = points_of_room(n, shuffled);
                                   const views all = views_of_room(count);
                                   for (auto _ : state) benchmark::DoNotOptimize(scores(points, all));
                                 })
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  };
  const ray_evidence_options once{.resolve_ghosts = false};
  const auto ours = [=](const auto& policy, const ray_evidence_options& options) {
    return [=](const std::vector<orbis::vec3f>& points, const views& all) {
      return orbis::cloud::ray_evidence_scores(policy, points, all, depth_keyframes::room().camera, options);
    };
  };
  row("orbis", ours(orbis::seq, once));
  row("orbis_par2", ours(orbis::par.with(2), once));
  row("orbis_with_ghosts", ours(orbis::seq, {}));
  for (const auto& [name, level] :
       {std::pair{"orbis_avx2", orbis::simd::level::avx2}, std::pair{"orbis_portable", orbis::simd::level::portable}}) {
    row(name, [=, level = level](const std::vector<orbis::vec3f>& points, const views& all) {
      const orbis::simd::level_limit limit{level};
      orbis::cloud::ray_evidence_counter counter{orbis::seq, points, depth_keyframes::room().camera, once};
      for (const auto& view : all) counter.add(orbis::seq, view);
      return counter.scores();
    });
  }
  row("plain_loop", [=](const std::vector<orbis::vec3f>& points, const views& all) {
    return plain_loop(points, all, depth_keyframes::room().camera, once);
  });
}

const bool registered = [] {
  add(100'000, 40, false);
  add(1'000'000, 100, false);
  add(1'000'000, 100, true);
  benchmark::RegisterBenchmark("ray_evidence_distorted/n:1000000/views:10/640x480/orbis",
                               [](benchmark::State& state) {
                                 const auto& k = depth_keyframes::room().camera.k();
                                 const orbis::camera::radial_tangential camera{k, {.k1 = 0.1, .k2 = -0.1, .p1 = 1e-3}};
                                 const views all = views_of_room(10);
                                 const auto& points = points_of_room(1'000'000, false);
                                 for (auto _ : state)
                                   benchmark::DoNotOptimize(orbis::cloud::ray_evidence_scores(
                                       orbis::seq, points, all, camera, {.resolve_ghosts = false}));
                               })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
  return true;
}();

}  // namespace

// SPDX-License-Identifier: BSD-3-Clause
//
// How many of the matches between two frames of a real recording are right, by its depth and its poses.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/features/brute_force.hpp>
#include <orbis/features/depth.hpp>
#include <orbis/features/epipolar.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/motion_statistics.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/features/projected.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/io/recording.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

const camera::pinhole kitchen_camera{640, 480, 525.0, 525.0, 320.0, 240.0};

struct seen {
  orbis::features::features features;
  std::vector<std::optional<vec3>> points;  ///< in the world, where there is depth
  se3 T_world_camera;
};

seen look(const io::recording& recording, std::size_t i) {
  const auto frame = recording.frame(i).value();
  seen s;
  s.T_world_camera = frame.T_world_camera.value();
  s.features = orb_extractor{{.max_features = 1000}}(frame.color.view());
  const camera::depth_view<std::uint16_t> depth{frame.depth.view(), 1000.0};
  for (const keypoint& k : s.features.keypoints) {
    const auto z = depth_at(depth, k.x, k.y);
    const auto ray = kitchen_camera.unproject(vec2{k.x, k.y});
    s.points.push_back(z && ray ? std::optional{s.T_world_camera * vec3{z->z * *ray}} : std::nullopt);
  }
  return s;
}

struct rate {
  double right = 0.0, judged = 0.0;
  [[nodiscard]] double share() const { return right / judged; }
};

/// Right: the query's point projects to within `pixels` (of the train's level) of the train.
rate judge(const std::vector<match>& matches, const seen& a, const seen& b, double pixels = 6.0) {
  rate r;
  for (const match& m : matches) {
    if (!a.points[m.query]) continue;
    ++r.judged;
    const auto pixel = kitchen_camera.project(b.T_world_camera.inverse() * *a.points[m.query]);
    const keypoint& k = b.features.keypoints[m.train];
    if (pixel && std::hypot(pixel->x() - double{k.x}, pixel->y() - double{k.y}) < pixels * std::pow(1.2, k.octave))
      ++r.right;
  }
  return r;
}

}  // namespace

TEST_CASE("most matches between frames of the kitchen are right, near and far") {
  ORBIS_NEEDS_DATA("kitchen");
  const auto recording = io::open_recording(test::data_dir() / "kitchen").value();
  REQUIRE(recording.size() > 420);
  constexpr auto strict = brute_force(hamming{}) | ratio_test{0.8F} | cross_check{} | max_distance{64};
  constexpr auto near = windowed(hamming{}) | max_distance{64} | unique{};
  constexpr auto together = brute_force(hamming{}) | motion_statistics{.strictness = 3.0F};
  constexpr auto where = projected(hamming{}, {.radius = 8.0F}) | max_distance{64} | unique{};
  constexpr auto along = epipolar(hamming{}) | ratio_test{0.8F} | cross_check{} | max_distance{64};
  struct bound {
    double share, count;  ///< at least: right ones, and matches with depth for each pair of frames
  };
  struct distance {
    std::size_t gap;
    std::array<bound, 5> at_least;
  };
  const std::array<distance, 3> distances{{{1, {{{0.94, 450}, {0.94, 510}, {0.93, 570}, {0.95, 510}, {0.95, 440}}}},
                                           {5, {{{0.94, 350}, {0.93, 360}, {0.92, 510}, {0.95, 440}, {0.95, 360}}}},
                                           {15, {{{0.88, 200}, {0.81, 240}, {0.85, 370}, {0.94, 300}, {0.93, 180}}}}}};
  for (const auto& [gap, at_least] : distances) {
    std::array<rate, 5> rates;
    for (const std::size_t i : {0U, 100U, 200U, 300U, 400U}) {
      const seen a = look(recording, i), b = look(recording, i + gap);
      const auto add = [&](std::size_t which, const std::vector<match>& matches) {
        const rate r = judge(matches, a, b);
        rates[which].right += r.right;
        rates[which].judged += r.judged;
      };
      add(0, strict(a.features, b.features));
      std::vector<window> windows;
      for (const keypoint& k : a.features.keypoints)
        windows.push_back({k.x, k.y, 10.0F + 4.0F * static_cast<float>(gap), k.octave - 1, k.octave + 1});
      add(1, near(a.features, b.features, windows));
      add(2, together(a.features, b.features));
      std::vector<vec3> points;
      for (const auto& p : a.points) points.push_back(p.value_or(vec3::Constant(std::nan(""))));
      add(3, where(a.features, b.features, points, camera_projection{kitchen_camera, b.T_world_camera}));
      mat3 K;
      K << 525.0, 0.0, 320.0, 0.0, 525.0, 240.0, 0.0, 0.0, 1.0;
      add(4, along(a.features, b.features, fundamental_geometry{K, K, b.T_world_camera.inverse() * a.T_world_camera}));
    }
    const std::array<const char*, 5> names{"brute force", "windowed", "motion statistics", "projected", "epipolar"};
    for (std::size_t i = 0; i != rates.size(); ++i) {
      INFO(names[i] << " at a gap of " << gap << ": " << rates[i].share() << " of " << rates[i].judged / 5.0);
      CHECK(rates[i].share() > at_least[i].share);
      CHECK(rates[i].judged / 5.0 > at_least[i].count);
    }
  }
}

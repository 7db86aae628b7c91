// SPDX-License-Identifier: BSD-3-Clause
//
// How many of the matches between two frames of a real recording are right, by its depth and its poses.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/features/brute_force.hpp>
#include <orbis/features/depth.hpp>
#include <orbis/features/epipolar.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/features/projected.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/io/recording.hpp>

#include "fundamental_geometry.hpp"

namespace orbis::test {

inline const camera::pinhole kitchen_camera{640, 480, 525.0, 525.0, 320.0, 240.0};

/// A frame: its features, and where they are.
struct seen_frame {
  features::features features;
  std::vector<std::optional<vec3>> points;  ///< in the world, where there is depth
  se3 T_world_camera;
};

/// @pre the frame can be read and has a pose
template <class Extract>
seen_frame look(const io::recording& recording, std::size_t i, const Extract& extract) {
  const auto frame = recording.frame(i).value();
  seen_frame s;
  s.T_world_camera = frame.T_world_camera.value();
  s.features = extract(frame.color.view());
  const camera::depth_view<std::uint16_t> depth{frame.depth.view(), 1000.0};
  for (const features::keypoint& k : s.features.keypoints) {
    const auto z = features::depth_at(depth, k.x, k.y);
    const auto ray = kitchen_camera.unproject(vec2{k.x, k.y});
    s.points.push_back(z && ray ? std::optional{s.T_world_camera * vec3{z->z * *ray}} : std::nullopt);
  }
  return s;
}

struct match_rate {
  double right = 0.0, judged = 0.0;
  [[nodiscard]] double share() const { return right / judged; }
};

/// Right: the query's point projects to within `pixels` (of the train's level) of the train.
inline match_rate judge(const std::vector<features::match>& matches, const seen_frame& a, const seen_frame& b,
                        double pixels = 6.0) {
  match_rate r;
  const se3 T_camera_world = b.T_world_camera.inverse();
  for (const features::match& m : matches) {
    if (!a.points[m.query]) continue;
    ++r.judged;
    const auto pixel = kitchen_camera.project(T_camera_world * *a.points[m.query]);
    const features::keypoint& k = b.features.keypoints[m.train];
    if (pixel && std::hypot(pixel->x() - double{k.x}, pixel->y() - double{k.y}) < pixels * std::pow(1.2, k.octave))
      ++r.right;
  }
  return r;
}

/// Ways to match two frames `gap` frames apart.
inline constexpr std::array<const char*, 4> matcher_names{"brute_force", "windowed", "projected", "epipolar"};

inline std::vector<features::match> matches_by(std::size_t which, const seen_frame& a, const seen_frame& b,
                                               std::size_t gap) {
  using namespace orbis::features;
  switch (which) {
    case 0: {
      constexpr auto strict = brute_force(hamming{}) | ratio_test{0.8F} | cross_check{} | max_distance{64};
      return strict(a.features, b.features);
    }
    case 1: {
      constexpr auto near = windowed(hamming{}) | max_distance{64} | unique{};
      std::vector<window> windows;
      for (const keypoint& k : a.features.keypoints)
        windows.push_back({k.x, k.y, 10.0F + 4.0F * static_cast<float>(gap), k.octave - 1, k.octave + 1});
      return near(a.features, b.features, windows);
    }
    case 2: {
      constexpr auto where = projected(hamming{}, {.radius = 8.0F}) | max_distance{64} | unique{};
      std::vector<vec3> points;
      for (const auto& p : a.points) points.push_back(p.value_or(vec3::Constant(std::nan(""))));
      return where(a.features, b.features, points, camera_projection{kitchen_camera, b.T_world_camera});
    }
    default: {
      constexpr auto along = epipolar(hamming{}) | ratio_test{0.8F} | cross_check{} | max_distance{64};
      mat3 K;
      K << 525.0, 0.0, 320.0, 0.0, 525.0, 240.0, 0.0, 0.0, 1.0;
      return along(a.features, b.features, fundamental_geometry{K, K, b.T_world_camera.inverse() * a.T_world_camera});
    }
  }
}

}  // namespace orbis::test

// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

/// Points on a wall, each with a descriptor of its own, and what a camera in front of it sees of them.
struct scene {
  random_bits random{1};
  camera::pinhole camera{640, 480, 525.0, 525.0, 320.0, 240.0};
  slam::camera_rig<camera::pinhole> rig{{camera, 400.0}};
  std::vector<vec3> points;
  std::vector<features::binary_descriptor<256>> descriptors;

  scene() {
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 10; ++x) {
        points.emplace_back(0.2 * x - 0.9, 0.2 * y - 0.7, 2.0 + 0.05 * ((x + y) % 3));
        descriptors.emplace_back();
        for (auto& w : descriptors.back().words) w = random();
      }
  }

  /// All points from a camera at (x, 0, 0): keypoint i shows point i.
  [[nodiscard]] slam::frame look(double x, std::size_t index, double pixel_error = 0.0) {
    slam::frame f;
    f.index = index;
    f.T_world_camera = se3(so3{}, vec3(x, 0, 0));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const vec3 p = f.T_world_camera.inverse() * points[i];
      const vec2 pixel = *camera.project(p) + pixel_error * vec2(random.uniform(-1, 1), random.uniform(-1, 1));
      features::keypoint k;
      k.x = static_cast<float>(pixel.x());
      k.y = static_cast<float>(pixel.y());
      f.features.keypoints.push_back(k);
      f.features.descriptors.push_back(descriptors[i]);
      f.features.descriptors.back().words[0] ^= std::uint64_t{1} << random.below(64);
      f.depth.push_back(static_cast<float>(p.z()));
      f.rays.push_back(*camera.unproject(pixel));
      f.landmarks.push_back(slam::no_id);
    }
    f.grid = features::keypoint_grid(f.features.keypoints);
    return f;
  }
};

}  // namespace

TEST_CASE("Landmarks that two keyframes made of the same points become one") {
  scene s;
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, s.look(0.0, 0), {});
  slam::detail::insert_keyframe(m, s.look(0.1, 1, 0.3), {});
  REQUIRE(m.landmark_count() == 160);
  REQUIRE(m.covisibility().shared(0, 1) == 0);
  const auto own = slam::detail::observed_landmarks(m, {1});
  const auto counts = slam::detail::fuse_into(m, 0, own, s.rig);
  CHECK(counts.fused > 70);
  CHECK(counts.observed == 0);
  CHECK(m.landmark_count() == 160 - counts.fused);
  CHECK(m.covisibility().shared(0, 1) == counts.fused);
  for (std::uint32_t i = 0; i < 80; ++i) {  // the right ones
    const auto l = m.at(1).landmarks[i];
    if (m.landmark_at(l).observations.size() == 2) CHECK(m.at(0).landmarks[i] == l);
    CHECK(m.landmark_at(l).has_current_descriptor);
  }
  CHECK(test::fault_of(m) == "");
  CHECK(slam::detail::fuse_into(m, 0, own, s.rig).fused == 0);  // nothing is left to do
}

TEST_CASE("A keypoint that shows nothing yet becomes an observation") {
  scene s;
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, s.look(0.0, 0), {});
  m.add_keyframe(s.look(0.1, 1));
  const auto counts = slam::detail::fuse_into(m, 1, slam::detail::observed_landmarks(m, {0}), s.rig);
  CHECK(counts.fused == 0);
  CHECK(counts.observed == 80);
  CHECK(m.covisibility().shared(0, 1) == 80);
  CHECK(test::fault_of(m) == "");
}

TEST_CASE("What looks different, or is elsewhere, is not fused") {
  scene s;
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, s.look(0.0, 0), {});
  auto other = s.look(0.1, 1);
  for (std::size_t i = 0; i < 20; ++i)
    for (auto& w : other.features.descriptors[i].words) w = ~w;
  for (std::size_t i = 20; i < 40; ++i) {  // half a metre behind: the same pixel in one image, not in the other
    other.depth[i] += 0.5F;
  }
  slam::detail::insert_keyframe(m, other, {});
  slam::detail::fuse_into(m, 0, slam::detail::observed_landmarks(m, {1}), s.rig);
  for (std::uint32_t i = 0; i < 80; ++i) CHECK((m.at(0).landmarks[i] == m.at(1).landmarks[i]) == (i >= 40));
}

TEST_CASE("The landmark that more keyframes see stays") {
  scene s;
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, s.look(0.0, 0), {});
  slam::detail::insert_keyframe(m, s.look(0.05, 1), {});
  auto third = s.look(0.1, 2);
  third.landmarks = m.at(1).landmarks;
  slam::detail::insert_keyframe(m, third, {});
  const auto many = m.at(1).landmarks[5], few = m.at(0).landmarks[5];
  slam::detail::fuse_into(m, 0, slam::detail::observed_landmarks(m, {1}), s.rig);
  CHECK(m.replacement(few) == many);
  CHECK(m.landmark_at(many).observations.size() == 3);
}

TEST_CASE("Duplicates among neighbours and their neighbours are found, in both directions") {
  scene s;
  slam::map m(8, 1.2);
  for (std::size_t i = 0; i < 5; ++i) {  // a chain: each shares 20 points with the one before, and doubles the rest
    auto f = s.look(0.04 * static_cast<double>(i), i);
    if (i > 0)
      for (std::size_t j = 0; j < 20; ++j)
        f.landmarks[20 * (i % 4) + j] = m.at(m.keyframe_end() - 1).landmarks[20 * (i % 4) + j];
    slam::detail::insert_keyframe(m, std::move(f), {});
  }
  REQUIRE(m.landmark_count() == 80 + 4 * 60);
  for (slam::keyframe_id k = 0; k < 5; ++k) slam::detail::fuse_with_neighbors(m, k, s.rig);
  CHECK(m.landmark_count() == 80);
  for (const auto& l : m.landmarks()) CHECK(l.observations.size() == 5);
  CHECK(m.covisibility().shared(0, 4) == 80);
  CHECK(test::fault_of(m) == "");
}

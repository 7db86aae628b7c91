// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/slam/detail/mapping/landmark_triangulation.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

/// Points in front of cameras on the x axis. The first ones have depth and are landmarks from the start, so that the
/// keyframes are neighbours; the others have none.
struct scene {
  static constexpr std::uint32_t known = 40, all = 100;
  random_bits random{7};
  camera::pinhole camera{640, 480, 525.0, 525.0, 320.0, 240.0};
  slam::camera_rig<camera::pinhole> rig{{camera, 400.0}};
  std::vector<vec3> points;
  std::vector<features::binary_descriptor<256>> descriptors;

  scene() {
    for (std::uint32_t i = 0; i < all; ++i) {
      const double z = random.uniform(2.0, 4.0), x = random.uniform(-0.4, 0.6);
      points.emplace_back(x * z, random.uniform(-0.4, 0.4) * z, z);
      descriptors.emplace_back();
      for (auto& w : descriptors.back().words) w = random();
    }
  }

  void place(slam::frame& f, std::size_t i, const vec2& pixel) const {
    f.features.keypoints[i].x = static_cast<float>(pixel.x());
    f.features.keypoints[i].y = static_cast<float>(pixel.y());
    f.rays[i] = *camera.unproject(f.pixel(i));
  }
  void set_depth(slam::frame& f, std::size_t i, double error = 0.0) const {
    f.depth[i] = static_cast<float>((f.T_world_camera.inverse() * points[i]).z() + error);
  }

  /// All points from a camera somewhere: keypoint i shows point i.
  [[nodiscard]] slam::frame look(const se3& T_world_camera, double pixel_error = 0.0) {
    slam::frame f;
    f.T_world_camera = T_world_camera;
    f.features.keypoints.resize(all);
    f.rays.resize(all);
    f.depth.assign(all, 0.0F);
    f.landmarks.assign(all, slam::no_id);
    f.features.descriptors = descriptors;
    for (std::size_t i = 0; i < all; ++i) {
      const vec2 noise = pixel_error * vec2(random.uniform(-1, 1), random.uniform(-1, 1));
      place(f, i, *camera.project(T_world_camera.inverse() * points[i]) + noise);
      f.features.descriptors[i].words[0] ^= std::uint64_t{1} << random.below(64);
      if (i < known) set_depth(f, i);
    }
    f.grid = features::keypoint_grid(f.features.keypoints);
    return f;
  }
  [[nodiscard]] slam::frame look(double x, double pixel_error = 0.0) {
    return look(se3(so3{}, vec3(x, 0, 0)), pixel_error);
  }

  /// A map of these, each of which shows the known points.
  [[nodiscard]] static slam::map map_of(std::vector<slam::frame> frames) {
    slam::map m(8, 1.2);
    for (slam::frame& f : frames) {
      if (m.keyframe_end() != 0)
        for (std::uint32_t i = 0; i < known; ++i) f.landmarks[i] = m.at(0).landmarks[i];
      const auto id = m.add_keyframe(std::move(f));
      for (std::uint32_t i = 0; id == 0 && i < known; ++i) m.add_landmark(0, i);
    }
    return m;
  }

  /// Triangulates, and says of which points landmarks were made.
  std::vector<std::uint32_t> made_in(slam::map& m, const slam::triangulation_options& o = {}) const {
    const auto newest = m.keyframes().back().id;
    const auto before = m.landmark_end();
    const std::size_t count = slam::detail::triangulate_landmarks(m, newest, rig, o);
    std::vector<std::uint32_t> made;
    for (std::uint32_t i = 0; i < all; ++i)
      if (const auto l = m.at(newest).landmarks[i]; l != slam::no_id && l >= before) made.push_back(i);
    CHECK(made.size() == count);
    CHECK(m.landmark_end() - before == count);
    CHECK(test::fault_of(m) == "");
    return made;
  }
};

std::vector<std::uint32_t> range(std::uint32_t from, std::uint32_t to) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = from; i < to; ++i) all.push_back(i);
  return all;
}

}  // namespace

TEST_CASE("Keypoints without depth become landmarks where their rays meet") {
  scene s;
  const se3 turned(so3::exp(vec3(0.02, -0.05, 0.1)), vec3(0.3, 0.05, -0.05));
  auto m = scene::map_of({s.look(0.0), s.look(turned)});
  CHECK(s.made_in(m) == range(scene::known, scene::all));
  for (std::uint32_t i = scene::known; i < scene::all; ++i) {
    const auto& l = m.landmark_at(m.at(1).landmarks[i]);
    CHECK((l.position - s.points[i]).norm() < 1e-3);
    CHECK(l.created == 1);
    CHECK(l.observations == std::vector<slam::observation>{{0, i}, {1, i}});
    CHECK(l.has_current_descriptor);
    CHECK(l.max_distance > l.min_distance);
  }
  CHECK(m.covisibility().shared(0, 1) == scene::all);
  CHECK(s.made_in(m).empty());  // nothing is left to do
}

TEST_CASE("Noise of a third of a pixel moves triangulated points as far as it should") {
  scene s;
  auto m = scene::map_of({s.look(0.0, 0.5), s.look(0.3, 0.5)});
  const auto made = s.made_in(m);
  CHECK(made.size() > 55);
  double sum = 0.0;
  for (const auto i : made) {
    const double z = s.points[i].z();
    const double expected = z * z / (0.3 * 525.0) * std::sqrt(2.0 / 12.0);  // sigma of a disparity: two uniform errors
    const double error = (m.landmark_at(m.at(1).landmarks[i]).position - s.points[i]).norm() / expected;
    CHECK(error < 4.0);
    sum += error * error;
  }
  const double rms = std::sqrt(sum / static_cast<double>(made.size()));
  CHECK(rms > 0.7);
  CHECK(rms < 1.4);
}

TEST_CASE("Without a baseline nothing is triangulated") {
  scene s;
  auto turned = scene::map_of({s.look(0.0), s.look(se3(so3::exp(vec3(0.0, 0.1, 0.0)), vec3::Zero()))});
  CHECK(s.made_in(turned).empty());
  CHECK(s.made_in(turned, {.min_baseline = 0.0}).empty());
  auto near = scene::map_of({s.look(0.0), s.look(0.02)});
  CHECK(s.made_in(near).empty());
  CHECK(s.made_in(near, {.min_baseline = 0.0}).empty());  // the parallax is too little all the same
  CHECK(s.made_in(near, {.min_baseline = 0.0, .min_parallax = 1e-3}).size() == scene::all - scene::known);
  slam::map alone = scene::map_of({s.look(0.0)});
  CHECK(s.made_in(alone).empty());
}

TEST_CASE("Points that are far compared with the baseline are left alone") {
  scene s;
  for (std::uint32_t i = 60; i < scene::all; ++i) s.points[i] *= 20.0;
  auto m = scene::map_of({s.look(0.0), s.look(0.3)});
  CHECK(s.made_in(m) == range(scene::known, 60));
  CHECK(s.made_in(m, {.min_parallax = 1e-3}) == range(60, scene::all));
}

TEST_CASE("Rays that meet behind the cameras make no point") {
  scene s;
  auto a = s.look(0.0), b = s.look(0.3);
  for (std::uint32_t i = 60; i < scene::all; ++i)  // as far to the other side
    s.place(b, i, vec2(2.0 * a.pixel(i).x() - b.pixel(i).x(), b.pixel(i).y()));
  auto m = scene::map_of({a, b});
  CHECK(s.made_in(m) == range(scene::known, 60));
}

TEST_CASE("Keypoints that lie on no common ray are not one point") {
  scene s;
  auto a = s.look(0.0), b = s.look(0.3);
  for (std::uint32_t i = 60; i < scene::all; ++i) s.place(b, i, b.pixel(i) + vec2(0.0, 8.0));
  auto m = scene::map_of({a, b});
  CHECK(s.made_in(m) == range(scene::known, 60));
  auto again = scene::map_of({a, b});
  CHECK(s.made_in(again, {.line_distance = 10.0F}) == range(scene::known, 60));  // matched, but found out
}

TEST_CASE("Keypoints of levels that do not fit their distances are not one point") {
  scene s;
  auto a = s.look(0.0), b = s.look(0.3);
  for (std::uint32_t i = 60; i < 80; ++i) b.features.keypoints[i].octave = 5;
  for (std::uint32_t i = 80; i < scene::all; ++i) b.features.keypoints[i].octave = 2;
  auto m = scene::map_of({a, b});
  auto made = s.made_in(m);
  for (const auto i : range(60, 80)) CHECK(std::count(made.begin(), made.end(), i) == 0);
  CHECK(made.size() == scene::all - scene::known - 20);
  CHECK(s.made_in(m, {.scale_tolerance = 3.0}) == range(60, 80));
}

TEST_CASE("Depth is used where it is worth more than the parallax") {
  scene s;
  auto a = s.look(0.0), b = s.look(0.3);
  for (std::uint32_t i = 60; i < scene::all; ++i) s.set_depth(i < 80 ? a : b, i, 0.01);
  for (const double bf : {400.0, 40.0}) {
    s.rig.model.bf = bf;
    auto m = scene::map_of({a, b});
    CHECK(s.made_in(m) == range(scene::known, scene::all));
    for (std::uint32_t i = 60; i < scene::all; ++i) {
      const vec3 p = m.landmark_at(m.at(1).landmarks[i]).position;
      const vec3 measured = m.at(i < 80 ? 0 : 1).point_world(i);
      CHECK((p - (bf > 100.0 ? measured : s.points[i])).norm() < 1e-3);
    }
  }
  // With depth, no parallax is needed.
  auto near = s.look(0.04);
  for (std::uint32_t i = 60; i < scene::all; ++i) s.set_depth(near, i);
  s.rig.model.bf = 400.0;
  auto m = scene::map_of({s.look(0.0), near});
  CHECK(s.made_in(m) == range(60, scene::all));
}

TEST_CASE("Depth that contradicts the other image makes no landmark") {
  scene s;
  auto a = s.look(0.0), b = s.look(0.3);
  for (std::uint32_t i = 60; i < 80; ++i) s.set_depth(a, i, 1.0);
  for (std::uint32_t i = 80; i < scene::all; ++i) s.set_depth(b, i, 1.0);
  for (const double bf : {400.0, 150.0}) {
    s.rig.model.bf = bf;  // at 150 the parallax of the nearer points is worth more
    auto m = scene::map_of({a, b});
    CHECK(s.made_in(m) == range(scene::known, 60));
  }
}

TEST_CASE("What shows a landmark already, looks different, or is no keypoint at all stays as it is") {
  scene s;
  auto a = s.look(0.0), b = s.look(0.3), c = s.look(0.6);
  for (std::uint32_t i = 60; i < 80; ++i)
    for (auto& w : c.features.descriptors[i].words) w = ~w;
  for (std::uint32_t i = 80; i < 90; ++i) c.rays[i] = vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  auto m = scene::map_of({a, b});
  REQUIRE(s.made_in(m) == range(scene::known, scene::all));
  for (std::uint32_t i = 0; i < scene::known; ++i) c.landmarks[i] = m.at(0).landmarks[i];
  m.add_keyframe(c);
  CHECK(s.made_in(m).empty());  // in the others all keypoints show landmarks
  for (std::uint32_t i = 50; i < scene::all; ++i) m.remove_landmark(m.at(0).landmarks[i]);
  const auto made = s.made_in(m);  // both others show them: one landmark for each all the same
  CHECK(made.size() == 20);
  for (const auto i : made) CHECK((i < 60 || i >= 90));
}

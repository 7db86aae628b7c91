// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/slam/detail/dynamics/moving_features.hpp>
#include <orbis/slam/measure.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;

/// A camera at rest before a wall of 200 points, and a body of 120 points, the last ones, that goes to and fro.
struct scene {
  slam::options options;
  slam::camera_rig<camera::pinhole> rig =
      slam::make_rig(camera::pinhole{camera::intrinsics{640, 480, 525, 525, 319.5, 239.5}}, options);
  slam::detail::moving_features<camera::pinhole, descriptor, slam::orb_matchers> moving{rig, options};
  slam::map m{8, 1.2};
  std::vector<vec3> points;
  std::vector<descriptor> looks;
  static constexpr std::size_t wall = 200, body = 120;
  slam::frame last;

  scene() {
    random_bits bits{5};
    while (points.size() != wall + body) {
      const bool on_wall = points.size() < wall;
      const double z = on_wall ? bits.uniform(2.5, 3.0) : bits.uniform(0.95, 1.05);
      points.emplace_back(z * bits.uniform(on_wall ? -0.55 : -0.2, on_wall ? 0.55 : 0.1), z * bits.uniform(-0.4, 0.4),
                          z);
      descriptor d;
      for (auto& word : d.words) word = bits();
      looks.push_back(d);
    }
    last = look(0.0, 0.0);
  }
  /// The frame at a time, with the body so far to the right.
  [[nodiscard]] slam::frame look(double time, double right) const {
    features::features seen;
    for (std::size_t i = 0; i != points.size(); ++i) {
      const vec3 p = points[i] + vec3(i < wall ? 0.0 : right, 0.0, 0.0);
      const auto pixel = rig.camera().project(p).value();
      features::keypoint k;
      k.x = static_cast<float>(pixel.x());
      k.y = static_cast<float>(pixel.y());
      seen.keypoints.push_back(k);
      seen.descriptors.push_back(looks[i]);
    }
    slam::frame f = slam::detail::make_frame(rig, std::move(seen), slam::sensor_kind::rgbd);
    for (std::size_t i = 0; i != f.size(); ++i) f.depth[i] = static_cast<float>(points[i].z());
    f.timestamp = time;
    return f;
  }
  /// Tracks a frame, whose pose is right. Returns how many of its features are kept.
  std::size_t track(double time, double right) {
    slam::frame f = look(time, right);
    moving.set_last(se3{});
    moving.find(f);
    slam::detail::search_list<descriptor> list;
    std::vector<features::match> matches;
    for (std::uint32_t i = 0; i != last.size(); ++i) {
      slam::detail::candidate_point p;
      p.position = last.point_world(i);
      list.add(p, last.features.descriptors[i], last.features.keypoints[i], {});
      for (std::uint32_t j = 0; j != f.size(); ++j)
        if (last.features.descriptors[i] == f.features.descriptors[j]) matches.push_back({i, j, 0});
    }
    moving.remove_excluded(matches);
    std::size_t agree = 0;
    for (const auto& found : matches)
      agree += slam::detail::agrees(rig, f, se3{}, found.train, list.points[found.query].position);
    moving.judge(f, m, list, matches, agree, se3{});
    moving.spread(f);
    moving.take_out(f);
    last = f;
    return f.size();
  }
};

}  // namespace

TEST_CASE("Features are taken out of a frame in all its lists") {
  scene s;
  s.last.spreads.resize(s.last.size());
  for (std::size_t i = 0; i < s.last.size(); ++i) s.last.spreads[i].deviation = static_cast<float>(i);
  slam::frame f = s.last;
  std::vector<std::uint8_t> out(f.size());
  for (std::size_t i = 0; i < f.size(); i += 3) out[i] = 1;
  slam::detail::remove_features(f, std::span<const std::uint8_t>(out));
  REQUIRE(f.size() == s.last.size() - (s.last.size() + 2) / 3);
  CHECK(f.features.keypoints.size() == f.size());
  CHECK(f.rays.size() == f.size());
  CHECK(f.landmarks.size() == f.size());
  CHECK(f.features.descriptors[2] == s.last.features.descriptors[4]);
  CHECK(f.features.keypoints[2].x == s.last.features.keypoints[4].x);
  CHECK(f.depth[2] == s.last.depth[4]);
  CHECK(f.rays[2] == s.last.rays[4]);
  CHECK(f.spreads.size() == f.size());
  CHECK(f.spreads[2].deviation == 4.0F);
  std::vector<std::uint32_t> near;
  f.grid.for_each_near(f.features.keypoints[2].x, f.features.keypoints[2].y, 0.5F, 0, 8,
                       [&](std::uint32_t i) { near.push_back(i); });
  CHECK(near == std::vector<std::uint32_t>{2});
}

TEST_CASE("What moves is left out at once, stays so while it stands, and is part of the world again at last") {
  scene s;
  const std::size_t all = s.last.size();
  CHECK(s.track(0.033, 0.0) == all);  // nothing moves
  double time = 0.033, right = 0.0;
  for (int i = 0; i != 20; ++i) {
    time += 0.033, right += 0.02;
    const std::size_t kept = s.track(time, right);
    CHECK(kept >= s.wall);
    CHECK(kept < s.wall + 10);
  }
  CHECK(s.moving.size() > s.body - 10);
  const double stopped = time;
  while (time < stopped + 2.5) CHECK(s.track(time += 0.033, right) < s.wall + 10);
  while (time < stopped + s.options.moving.hold + 1.0) s.track(time += 0.033, right);
  CHECK(s.track(time += 0.033, right) == all);
  CHECK(s.moving.size() == 0);
}

TEST_CASE("Nothing is left out if that is not asked for") {
  scene s;
  s.options.moving.enabled = false;
  for (int i = 1; i != 5; ++i) CHECK(s.track(0.033 * i, 0.02 * i) == s.wall + s.body);
}

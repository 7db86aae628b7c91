// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/features/pyramid.hpp>
#include <orbis/slam/detail/mapping/keyframe_insertion.hpp>
#include <orbis/slam/detail/tracking/patch_tracker.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;

/// A wall two metres away, and a camera that moves before it.
struct wall {
  camera::pinhole camera{320, 240, 260.0, 260.0, 160.0, 120.0};
  slam::camera_rig<camera::pinhole> rig{{camera, 400.0}, {4, 1.2}};
  slam::options options;
  image<std::uint8_t> grey;
  features::image_pyramid levels;

  static double texture(double x, double y) {  // metres
    return 128.0 + 40.0 * std::sin(70.0 * x + 27.0 * y) + 35.0 * std::sin(22.0 * x - 80.0 * y + 1.0) +
           25.0 * std::sin(108.0 * x + 96.0 * y + 2.0);
  }
  /// Returns the point of the wall at a pixel.
  [[nodiscard]] vec3 seen(const se3& T_world_camera, const vec2& pixel) const {
    const vec3 ray = T_world_camera.rotation() * *camera.unproject(pixel), from = T_world_camera.translation();
    return from + (2.0 - from.z()) / ray.z() * ray;
  }
  /// Renders the image of a camera that moves by `twist` for `exposure` seconds around its pose.
  void render(const se3& T_world_camera, const vec6& twist = zeros<vec6>(), double exposure = 0.0) {
    grey = image<std::uint8_t>(320, 240);
    const int steps = exposure > 0.0 ? 12 : 1;
    for (int y = 0; y != 240; ++y)
      for (int x = 0; x != 320; ++x) {
        double sum = 0.0;
        for (int k = 0; k != steps; ++k) {
          const se3 there = T_world_camera * se3::exp(((k + 0.5) / steps - 0.5) * exposure * twist);
          const vec3 p = seen(there, vec2(x, y));
          sum += texture(p.x(), p.y());
        }
        grey(x, y) = static_cast<std::uint8_t>(sum / steps + 0.5);
      }
    levels.build(std::as_const(grey).view(), 4, 1.2, 32);
  }
  [[nodiscard]] slam::detail::frame_image frame_image(const se3& T_world_camera) const {
    return {&levels, [this, T_world_camera](const vec2& pixel) {
              return (T_world_camera.inverse() * seen(T_world_camera, pixel)).z();
            }};
  }
  /// A frame with keypoints in a grid.
  [[nodiscard]] slam::frame frame_at(const se3& T_world_camera, std::size_t index) const {
    slam::frame f;
    f.index = index;
    f.timestamp = 0.1 * static_cast<double>(index);
    f.T_world_camera = T_world_camera;
    for (int y = 60; y <= 180; y += 20)
      for (int x = 60; x <= 260; x += 20) {
        features::keypoint k{.x = static_cast<float>(x), .y = static_cast<float>(y), .octave = (x / 20) % 3};
        f.features.keypoints.push_back(k);
        f.features.descriptors.emplace_back();
        f.rays.push_back(*camera.unproject(f.pixel(f.rays.size())));
        f.depth.push_back(static_cast<float>((T_world_camera.inverse() * seen(T_world_camera, vec2(x, y))).z()));
      }
    f.landmarks.assign(f.size(), slam::no_id);
    f.grid.assign(f.features.keypoints);
    return f;
  }
};

using tracker = slam::detail::patch_tracker<camera::pinhole, descriptor>;

/// The mean error of the keypoints that observe landmarks, pixels.
double error_of(const wall& w, const slam::frame& f, const slam::map& m, const se3& T_world_camera) {
  double sum = 0.0;
  for (std::size_t i = 0; i != f.size(); ++i)
    sum += norm(f.pixel(i) - *w.camera.project(T_world_camera.inverse() * m.landmark_at(f.landmarks[i]).position));
  return sum / static_cast<double>(f.size());
}

/// A keyframe with patches, and the next frame, whose keypoints are some pixels off.
struct scene {
  wall w;
  slam::map m{4, 1.2};
  tracker patches{w.rig, w.options.patches};
  vec6 twist;
  se3 T_world_next;
  slam::frame next;

  scene(const vec6& motion, double exposure) : twist{motion}, T_world_next{se3::exp(0.1 * motion)} {
    w.render(se3{}, twist, exposure);
    patches.set_image(w.frame_image(se3{}));
    const slam::frame first = w.frame_at(se3{}, 0);
    patches.add_patches(m, slam::detail::insert_keyframe(m, first, w.options), first, twist);
    w.render(T_world_next, twist, exposure);
    patches.set_image(w.frame_image(T_world_next));
    next = w.frame_at(T_world_next, 1);
    for (std::size_t i = 0; i != next.size(); ++i) {
      const auto l = m.at(0).landmarks[i];
      const vec2 pixel = *w.camera.project(T_world_next.inverse() * m.landmark_at(l).position);
      next.landmarks[i] = l;
      next.features.keypoints[i].x = static_cast<float>(pixel.x() + 1.5 * std::sin(2.0 * static_cast<double>(i)));
      next.features.keypoints[i].y = static_cast<float>(pixel.y() + 1.5 * std::cos(3.0 * static_cast<double>(i)));
    }
  }
};

const vec6 moves = stacked(vec3(0.1, -0.05, 0.08), vec3(0.05, 0.4, 0.1));

}  // namespace

TEST_CASE("Keypoints move to where their landmarks are, and are trusted more") {
  scene s(moves, 0.0);
  CHECK(error_of(s.w, s.next, s.m, s.T_world_next) > 1.0);
  REQUIRE(s.patches.align(s.next, s.m, s.twist));
  CHECK(error_of(s.w, s.next, s.m, s.T_world_next) < 0.1);
  REQUIRE(s.next.spreads.size() == s.next.size());
  for (std::size_t i = 0; i != s.next.size(); ++i) {  // rays and depths follow
    CHECK(norm(s.next.point_world(i) - s.w.seen(s.T_world_next, s.next.pixel(i))) < 1e-3);
    CHECK(s.next.spread(i).deviation < 1.0F);
    CHECK(s.m.at(0).spread(i).deviation < 1.0F);  // the keyframe defines the landmarks
  }
}

TEST_CASE("Keypoints as read by a rolling shutter keep their delay") {
  scene s(moves, 0.0);
  slam::detail::keep_as_read(s.next);
  const vec2 delay(0.7, -0.4);  // the image shows everything this much later
  for (std::size_t i = 0; i != s.next.size(); ++i) {
    s.next.features.keypoints[i].x -= static_cast<float>(delay.x());
    s.next.features.keypoints[i].y -= static_cast<float>(delay.y());
  }
  REQUIRE(s.patches.align(s.next, s.m, s.twist));
  for (std::size_t i = 0; i != s.next.size(); ++i) {
    const vec2 read(s.next.as_read[i].x, s.next.as_read[i].y);
    CHECK(norm(read - s.next.pixel(i) - delay) < 1e-3);
  }
}

TEST_CASE("The exposure is found from the blur of patches") {
  constexpr double exposure = 0.02;
  scene s(3.0 * moves, 0.0);  // the patches are sharp
  CHECK(s.patches.exposure() == 0.0);
  s.w.render(s.T_world_next, s.twist, exposure);
  for (auto& l : s.m.landmarks()) {
    slam::landmark_patch still = l.patch;
    still.motion = zeros<vec2>();
    s.m.set_patch(l.id, still);
  }
  for (int k = 0; k != 60; ++k) {
    slam::frame again = s.next;
    static_cast<void>(s.patches.align(again, s.m, s.twist));
  }
  CHECK(std::abs(s.patches.exposure() - exposure) < 0.003);
  slam::frame blurred = s.next;
  REQUIRE(s.patches.align(blurred, s.m, s.twist));
  CHECK(error_of(s.w, blurred, s.m, s.T_world_next) < 0.2);
}

TEST_CASE("Positions in a blurred image are uncertain along the motion") {
  wall w;
  w.options.patches.exposure = 0.02;
  tracker patches{w.rig, w.options.patches};
  const vec6 twist = stacked(zeros<vec3>(), vec3(0.0, 1.5, 0.0));  // streaks of about 8 pixels along the rows
  w.render(se3{}, twist, *w.options.patches.exposure);
  patches.set_image(w.frame_image(se3{}));
  slam::map m{4, 1.2};
  const slam::frame first = w.frame_at(se3{}, 0);
  patches.add_patches(m, slam::detail::insert_keyframe(m, first, w.options), first, twist);
  slam::frame next = w.frame_at(se3{}, 1);
  next.landmarks = m.at(0).landmarks;
  next.landmarks[0] = slam::no_id;
  REQUIRE(patches.align(next, m, twist));
  const double scale = w.rig.scales.scale(next.features.keypoints[0].octave);
  const slam::pixel_spread corner = next.spread(0);  // anywhere on its streak
  CHECK(corner.deviation == 1.0F);
  CHECK(std::abs(corner.smear_x) == Catch::Approx(0.02 * 1.5 * 260.0 / scale / std::sqrt(12.0)).epsilon(0.2));
  CHECK(std::abs(corner.smear_y) < 0.2F);
  std::size_t aligned = 0;
  for (std::size_t i = 1; i != next.size(); ++i) {
    CHECK(m.at(0).spread(i).smear_x == 0.0F);
    if (!(next.spread(i).deviation < 1.0F)) continue;  // the blur left too little texture
    ++aligned;
    CHECK(std::abs(next.spread(i).smear_x) > 0.01F);
    CHECK(std::abs(next.spread(i).smear_x) < 0.5F * std::abs(corner.smear_x));
  }
  CHECK(aligned > next.size() / 2);
}

TEST_CASE("Positions are uncertain along the longer streak of patch and image") {
  wall w;
  w.options.patches.exposure = 0.02;
  tracker patches{w.rig, w.options.patches};
  const vec6 twist = stacked(zeros<vec3>(), vec3(0.0, 1.5, 0.0));  // along the rows
  w.render(se3{}, twist, *w.options.patches.exposure);
  patches.set_image(w.frame_image(se3{}));
  slam::map m{4, 1.2};
  const slam::frame first = w.frame_at(se3{}, 0);
  patches.add_patches(m, slam::detail::insert_keyframe(m, first, w.options), first, twist);
  const vec6 slow = stacked(zeros<vec3>(), vec3(0.01, 0.0, 0.0));  // along the columns
  w.render(se3{}, slow, *w.options.patches.exposure);
  patches.set_image(w.frame_image(se3{}));
  slam::frame next = w.frame_at(se3{}, 1);
  next.landmarks = m.at(0).landmarks;
  REQUIRE(patches.align(next, m, slow));
  std::size_t aligned = 0;
  for (std::size_t i = 0; i != next.size(); ++i) {
    if (!(next.spread(i).deviation < 1.0F)) continue;
    ++aligned;
    CHECK(std::abs(next.spread(i).smear_x) > 0.01F);
    CHECK(std::abs(next.spread(i).smear_y) < 0.3F * std::abs(next.spread(i).smear_x));
  }
  CHECK(aligned > next.size() / 2);
}

TEST_CASE("Patches with long streaks are taken from a coarser level") {
  const auto coarseness = [](double turn) {
    wall w;
    w.options.patches.exposure = 0.02;
    tracker patches{w.rig, w.options.patches};
    const vec6 twist = stacked(zeros<vec3>(), vec3(0.0, turn, 0.0));
    w.render(se3{});  // sharp, so that there is something to align
    patches.set_image(w.frame_image(se3{}));
    slam::map m{4, 1.2};
    const slam::frame first = w.frame_at(se3{}, 0);
    patches.add_patches(m, slam::detail::insert_keyframe(m, first, w.options), first, twist);
    for (auto& l : m.landmarks()) {
      slam::landmark_patch still = l.patch;
      still.motion = zeros<vec2>();
      m.set_patch(l.id, still);
    }
    slam::frame next = w.frame_at(se3{}, 1);
    next.landmarks = m.at(0).landmarks;
    REQUIRE(patches.align(next, m, zeros<vec6>()));
    CHECK(error_of(w, next, m, se3{}) < 0.05);  // found where they were taken
    std::vector<float> of_level(3);             // of keypoints in the middle of the image: equal streaks
    for (std::size_t i = 0; i != first.size(); ++i)
      if (const features::keypoint& k = first.features.keypoints[i]; std::abs(k.x - 160.0F) <= 20.0F)
        of_level[static_cast<std::size_t>(k.octave)] = m.landmark_at(m.at(0).landmarks[i]).patch.coarseness;
    return of_level;
  };
  CHECK(coarseness(1.0) == std::vector{1.0F, 1.0F, 1.0F});  // 5 pixels
  const std::vector<float> of_level = coarseness(2.2);      // 11.5 pixels
  CHECK(of_level[0] == Catch::Approx(1.2));
  CHECK(of_level[1] == 1.0F);
  CHECK(of_level[2] == 1.0F);
}

TEST_CASE("Patches that show several surfaces are trusted less") {
  const auto spread = [](double step) {
    wall w;
    tracker patches{w.rig, w.options.patches};
    w.render(se3{});
    const auto depth_at = [step](const vec2& pixel) { return pixel.x() > 162.0 ? 2.0 - step : 2.0; };
    patches.set_image({&w.levels, depth_at});
    slam::map m{4, 1.2};
    const slam::frame first = w.frame_at(se3{}, 0);
    patches.add_patches(m, slam::detail::insert_keyframe(m, first, w.options), first, zeros<vec6>());
    slam::frame next = w.frame_at(se3{}, 1);
    next.landmarks = m.at(0).landmarks;
    CHECK(patches.align(next, m, zeros<vec6>()));
    std::size_t i = 0;
    while (!(first.features.keypoints[i].x == 160.0F)) ++i;
    return next.spread(i).deviation;
  };
  CHECK(spread(0.2) == Catch::Approx(3.0 * spread(0.0)));
  CHECK(spread(0.02) == spread(0.0));
}

TEST_CASE("Without an image, or without patches, keypoints stay") {
  scene s(moves, 0.0);
  s.patches.set_image({});
  CHECK_FALSE(s.patches.is_ready());
  s.patches.set_image(s.w.frame_image(s.T_world_next));
  CHECK(s.patches.is_ready());
  for (auto& l : s.m.landmarks()) s.m.set_patch(l.id, {});
  const slam::frame before = s.next;
  CHECK_FALSE(s.patches.align(s.next, s.m, s.twist));
  CHECK(s.next.features.keypoints == before.features.keypoints);
  CHECK(s.next.spreads.empty());
}

TEST_CASE("Keypoints that lose their landmark move back to where the detector found them") {
  scene s(moves, 0.0);
  slam::detail::keep_as_read(s.next);
  const slam::frame before = s.next;
  REQUIRE(s.patches.align(s.next, s.m, s.twist));
  s.next.landmarks[3] = slam::no_id;
  s.patches.move_back(s.next, false);
  CHECK(s.next.features.keypoints[3] == before.features.keypoints[3]);
  CHECK(s.next.rays[3] == before.rays[3]);
  CHECK(s.next.depth[3] == before.depth[3]);
  CHECK(s.next.as_read[3].x == before.as_read[3].x);
  CHECK(s.next.spread(3).deviation >= 1.0F);
  CHECK_FALSE(s.next.features.keypoints[4] == before.features.keypoints[4]);
  s.patches.move_back(s.next, true);
  CHECK(s.next.features.keypoints == before.features.keypoints);
}

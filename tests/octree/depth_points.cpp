// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/occupancy_octree-inl.hpp>
#include <orbis/octree/files.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

const camera::pinhole small_camera{64, 48, 60.0, 60.0, 31.5, 23.5};
const se3 a_pose{so3::exp({0.3, -0.5, 0.1}), {0.4, -0.2, 1.1}};

[[nodiscard]] image<float> wavy_depth() {
  image<float> depth{64, 48};
  for (int y = 0; y != 48; ++y)
    for (int x = 0; x != 64; ++x) depth(x, y) = 1.5F + 0.01F * static_cast<float>((x * 7 + y * 13) % 40);
  return depth;
}

}  // namespace

TEST_CASE("Pixels without a measurement give no point and the others lie on their rays") {
  image<float> depth = wavy_depth();
  depth(3, 4) = 0.0F;
  depth(4, 4) = std::numeric_limits<float>::quiet_NaN();
  depth(5, 4) = -1.0F;
  std::vector<vec3f> points;
  append_world_points(camera::depth_view<float>{depth.view()}, small_camera, a_pose, points);
  REQUIRE(points.size() == 64U * 48U - 3U);
  for (const std::size_t i : {std::size_t{0}, std::size_t{63}, points.size() - 1}) {
    const int x = i == 0 ? 0 : 63, y = i + 1 == points.size() ? 47 : 0;
    const vec3 in_camera = a_pose.inverse() * points[i].cast<double>();
    CHECK(in_camera.z() == Approx(static_cast<double>(depth(x, y))).epsilon(1e-5));
    CHECK((*small_camera.project(in_camera) - vec2{x, y}).norm() < 1e-3);
  }
}

TEST_CASE("A depth image is integrated like its points") {
  const image<float> depth = wavy_depth();
  const camera::depth_view<float> view{depth.view()};
  std::vector<vec3f> points;
  append_world_points(view, small_camera, a_pose, points);
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    const integration_options options{.max_range = 1.8, .mode = mode};
    occupancy_octree<> from_depth{0.05}, from_points{0.05}, on_threads{0.05};
    const auto a = from_depth.integrate(view, small_camera, a_pose, options);
    const auto b = from_points.integrate(points, a_pose.translation(), options);
    on_threads.integrate(par.with(2), view, small_camera, a_pose, options);
    CHECK(ot_bytes(from_depth) == ot_bytes(from_points));
    CHECK(ot_bytes(from_depth) == ot_bytes(on_threads));
    CHECK(a.used == b.used);
    CHECK(a.truncated == b.truncated);
    CHECK(a.truncated > 0);
  }
}

TEST_CASE("Frames of a real kitchen give OctoMap's map bit for bit") {
  ORBIS_NEEDS_DATA("kitchen");
  const auto recording = io::open_recording(test::data_dir() / "kitchen");
  REQUIRE(recording);
  // Every ray at 10 cm, discretized at the finer resolutions: OctoMap takes its time.
  struct run {
    double resolution;
    ray_mode mode;
  };
  for (const auto& [resolution, mode] :
       {run{0.1, ray_mode::every_ray}, run{0.05, ray_mode::discretized}, run{0.02, ray_mode::discretized}}) {
    occupancy_octree<> ours{resolution};
    octomap::OcTree theirs{resolution};
    for (const std::size_t i : {std::size_t{0}, std::size_t{150}, std::size_t{151}}) {
      const auto frame = recording->frame(i);
      REQUIRE(frame);
      REQUIRE(frame->T_world_camera);
      const integration_options options{.max_range = 3.0, .mode = mode};
      recording->camera().model.visit([&](const auto& camera) {
        ours.integrate(frame->depth_metres(), camera, *frame->T_world_camera, options);
        std::vector<vec3f> points;
        append_world_points(frame->depth_metres(), camera, *frame->T_world_camera, points);
        CHECK(points.size() > 100000);
        test::insert(theirs, points, frame->T_world_camera->translation().template cast<float>(), options);
      });
    }
    CHECK(ours.num_occupied_leaves() > 1000);
    CHECK(ot_bytes(ours) == test::ot_of(theirs));
    CHECK(bt_bytes(ours) == test::bt_of(theirs));
  }
}

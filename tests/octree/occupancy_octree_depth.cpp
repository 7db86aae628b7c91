// SPDX-License-Identifier: BSD-3-Clause
//
// Maps of depth images against maps of the same points, ours and OctoMap's.
#include <csignal>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#ifdef __unix__
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <orbis/camera/pinhole.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

constexpr double no_limit = std::numeric_limits<double>::infinity();

struct small_frame {
  image<float> depth;
  camera::pinhole camera;
  se3 T_world_camera;
};

/// Every `step`-th pixel of every `step`-th row, so that OctoMap can keep up.
template <class Recording>
std::vector<small_frame> small_frames(const Recording& recording, std::size_t count, std::size_t stride, int step) {
  std::vector<small_frame> frames;
  const auto model = recording.camera().model;
  const auto* const whole = model.template get_if<camera::pinhole>();
  REQUIRE(whole != nullptr);
  const auto& k = whole->k();
  const int width = k.width / step, height = k.height / step;
  for (std::size_t i = 0; i != count; ++i) {
    const auto frame = recording.frame(i * stride).value();
    const auto depth = frame.depth_metres();
    small_frame f{image<float>(width, height),
                  camera::pinhole{width, height, k.fx / step, k.fy / step, k.cx / step, k.cy / step},
                  *frame.T_world_camera};
    for (int y = 0; y != height; ++y)
      for (int x = 0; x != width; ++x) f.depth(x, y) = depth(step * x, step * y);
    frames.push_back(std::move(f));
  }
  return frames;
}

std::vector<vec3f> points_of(const small_frame& f) {
  std::vector<vec3f> points;
  append_world_points(camera::depth_view(f.depth), f.camera, f.T_world_camera, points);
  return points;
}

void check_against_octomap(const std::vector<small_frame>& frames, double resolution,
                           const integration_options& options) {
  occupancy_octree<> ours{resolution};
  octomap::OcTree theirs{resolution};
  std::size_t used = 0;
  for (const small_frame& f : frames) {
    const auto summary = ours.integrate(camera::depth_view(f.depth), f.camera, f.T_world_camera, options);
    used += summary.used + summary.truncated;
    test::insert(theirs, points_of(f), f.T_world_camera.translation().cast<float>(), options);
  }
  INFO(resolution << " m, mode " << static_cast<int>(options.mode) << ", range " << options.max_range);
  CHECK(used > 100);
  CHECK(ot_bytes(ours) == test::ot_of(theirs));
}

template <class Recording>
void check_recording(const Recording& recording, std::size_t stride) {
  const auto frames = small_frames(recording, 3, stride, 5), few_rays = small_frames(recording, 2, stride, 10);
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    for (const double resolution : {0.01, 0.02})
      check_against_octomap(few_rays, resolution, {.max_range = 5.0, .mode = mode});
    for (const double resolution : {0.05, 0.1}) {
      auto saturated = frames;  // over and over, until most voxels are at their bounds
      for (int i = 0; i != 3; ++i) saturated.insert(saturated.end(), frames.begin(), frames.end());
      check_against_octomap(saturated, resolution, {.max_range = 5.0, .mode = mode});
    }
  }
  for (const double range : {1.2, no_limit}) {
    check_against_octomap(frames, 0.05, {.max_range = range});
    check_against_octomap(frames, 0.05, {.max_range = range, .mode = ray_mode::discretized});
  }
}

}  // namespace

TEST_CASE("Depth images of a synthetic room give OctoMap's map") {
  const io::synthetic_recording room{{.frames = 100}};
  check_recording(room, 23);
}

TEST_CASE("Depth images of a real kitchen give OctoMap's map") {
  ORBIS_NEEDS_DATA("kitchen");
  const auto kitchen = io::open_recording(test::data_dir() / "kitchen");
  REQUIRE(kitchen);
  check_recording(*kitchen, 90);
}

TEST_CASE("A depth image gives the map of its points whatever the options and the number of threads") {
  const auto frames = small_frames(io::synthetic_recording{{.frames = 100}}, 2, 30, 4);
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized})
    for (const double range : {no_limit, 2.0}) {
      const integration_options options{.max_range = range, .mode = mode};
      occupancy_octree<> map{0.04}, threads{0.04}, reference{0.04};
      for (int round = 0; round != 3; ++round)
        for (const small_frame& f : frames) {
          const camera::depth_view depth{f.depth};
          const auto got = map.integrate(depth, f.camera, f.T_world_camera, options);
          const auto also = threads.integrate(par.with(3), depth, f.camera, f.T_world_camera, options);
          const auto expected = reference.integrate(points_of(f), f.T_world_camera.translation(), options);
          REQUIRE(got.used == expected.used);
          REQUIRE(got.truncated == expected.truncated);
          REQUIRE(got.rejected == expected.rejected);
          REQUIRE(got.occupied == expected.occupied);
          REQUIRE(got.free == expected.free);
          REQUIRE(also.free == got.free);
        }
      CHECK(ot_bytes(map) == ot_bytes(reference));
      CHECK(ot_bytes(threads) == ot_bytes(reference));
    }
}

TEST_CASE("A depth image without measurements or with a pose that is no number changes nothing") {
  image<float> depth(64, 48, 0.0F);
  const camera::pinhole camera{64, 48, 50.0, 50.0, 31.5, 23.5};
  occupancy_octree<> map{0.05};
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    const auto nothing = map.integrate(camera::depth_view(depth), camera, se3{}, {.mode = mode});
    CHECK(nothing.used + nothing.rejected + nothing.free + nothing.occupied == 0);
  }
  depth(10, 10) = 1.0F;
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    const se3 nowhere{so3{}, vec3{std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}};
    const auto lost = map.integrate(camera::depth_view(depth), camera, nowhere, {.mode = mode});
    CHECK(lost.rejected == 1);
    CHECK(lost.used == 0);
  }
  CHECK(map.num_leaves() == 0);
}

TEST_CASE("A depth image without pixels changes nothing") {
  occupancy_octree<> map{0.05};
  for (const auto& [width, height] : {std::pair{0, 0}, std::pair{64, 0}, std::pair{0, 48}})
    for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
      const image<float> depth(width, height, 1.0F);
      const camera::pinhole camera{width, height, 50.0, 50.0, 31.5, 23.5};
      const auto nothing = map.integrate(camera::depth_view(depth), camera, se3{}, {.mode = mode});
      CHECK(nothing.used + nothing.truncated + nothing.rejected + nothing.free + nothing.occupied == 0);
    }
  CHECK(map.empty());
}

#if defined(__unix__) && !defined(NDEBUG)
TEST_CASE("A negative range of a depth image is a broken precondition, found before any work") {
  const image<float> depth(160, 120, 2.0F);
  const camera::pinhole camera{160, 120, 160.0, 160.0, 79.5, 59.5};
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGABRT, SIG_DFL);
    ::close(STDERR_FILENO);
    occupancy_octree<> map{0.05};
    map.integrate(camera::depth_view(depth), camera, se3{}, {.max_range = -1.0});
    ::_exit(0);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK((WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT));
}
#endif

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/presets.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/octree/detail/mark/scan_buffers.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

constexpr double no_limit = std::numeric_limits<double>::infinity();

/// The voxels that walking every ray of the image's points marks.
struct walked {
  point_integrator marker;
  integration_summary summary;

  template <class Depth, class Camera>
  walked(const voxel_grid& grid, const Depth& depth, const Camera& camera, const se3& pose,
         const integration_options& options) {
    std::vector<vec3f> points;
    append_world_points(depth, camera, pose, points);
    summary = marker.mark(seq, grid, point_reader{}.view(points), coordinates<float>(pose.translation()), options);
  }
};

/// Marks depth images, as maps and histories do.
struct depth_marker {
  scan_buffers buffers;

  template <class Policy>
  integration_summary mark(const Policy& policy, const voxel_grid& grid, const depth_scan& scan, const se3& pose,
                           const integration_options& options, scan_masks& found,
                           const saturated_voxels& saturated = {}) {
    integration_summary summary;
    found = mark_depth(policy, buffers, grid, scan, pose, options, summary, saturated);
    return summary;
  }
};

/// Saturated voxels of a brick, any.
void hide_some(std::uint64_t name, std::array<std::uint64_t, 8>& mask) {
  random_bits bits{name};
  if (bits.below(3) == 0) mask.fill(~std::uint64_t{0});
  if (bits.below(2) == 0)
    for (std::uint64_t& word : mask)
      word |= bits.below(2) == 0 ? ~std::uint64_t{0} : std::uint64_t{0xff} << (8 * bits.below(8));
}

[[nodiscard]] std::uint64_t free_word(const scan_brick* b, std::size_t i) {
  return b == nullptr ? 0 : b->free[i] & ~b->occupied[i];
}

/// Voxels that are not the same in both, but for free ones that are `saturated`.
template <class Saturated>
[[nodiscard]] std::size_t differences(const scan_masks& expected, const scan_masks& found, Saturated&& saturated) {
  std::size_t count = 0;
  const auto compare = [&](const scan_brick* a, const scan_brick* b, std::uint64_t name) {
    std::array<std::uint64_t, 8> known{};
    saturated(name, known);
    for (std::size_t i = 0; i != 8; ++i) {
      count += static_cast<std::size_t>(std::popcount((free_word(a, i) ^ free_word(b, i)) & ~known[i]));
      count += static_cast<std::size_t>(
          std::popcount((a == nullptr ? 0 : a->occupied[i]) ^ (b == nullptr ? 0 : b->occupied[i])));
    }
  };
  for (const scan_brick& a : expected.bricks()) compare(&a, found.find(a.name), a.name);
  for (const scan_brick& b : found.bricks())
    if (expected.find(b.name) == nullptr) compare(nullptr, &b, b.name);
  return count;
}

[[nodiscard]] std::size_t count_free(const scan_masks& masks) {
  std::size_t count = 0;
  for (const scan_brick& b : masks.bricks())
    for (std::size_t i = 0; i != 8; ++i) count += static_cast<std::size_t>(std::popcount(free_word(&b, i)));
  return count;
}

/// Marks with every instruction set and requires what the walk marks, and the same summary.
template <class Depth, class Camera>
void require_walked(double resolution, const Depth& depth, const Camera& camera, const se3& pose,
                    const integration_options& options = {}) {
  const voxel_grid grid{resolution};
  const walked expected{grid, depth, camera, pose, options};
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    INFO("resolution " << resolution << ", level " << static_cast<int>(level));
    depth_marker marker;
    scan_masks found;
    const auto summary = marker.mark(seq, grid, depth_scan{depth, camera}, pose, options, found);
    REQUIRE(differences(expected.marker.masks(), found, saturated_voxels{}) == 0);
    REQUIRE(summary.used == expected.summary.used);
    REQUIRE(summary.truncated == expected.summary.truncated);
    REQUIRE(summary.rejected == expected.summary.rejected);
  }
}

[[nodiscard]] camera::pinhole camera_of(int width, int height, double field = 1.2) {
  const double f = 0.5 * std::max({width, height, 1}) / std::tan(0.5 * field);
  return {width, height, f, f * 1.01, 0.5 * width - 0.3, 0.5 * height - 0.6};
}

[[nodiscard]] se3 random_pose(random_bits& random, double reach) {
  const auto at = [&](double half) { return random.uniform(-half, half); };
  return {so3::exp({at(2.0), at(2.0), at(2.0)}), {at(reach), at(reach), at(reach)}};
}

/// Slanted planes and steps, holes, speckles, noise.
[[nodiscard]] image<float> random_depth(random_bits& random, int width, int height) {
  image<float> depth{width, height};
  const double near = random.uniform(0.3, 2.0), slope_u = random.uniform(-1.0, 1.0),
               slope_v = random.uniform(-1.0, 1.0);
  const double noise = random.below(3) == 0 ? 0.3 : random.below(2) == 0 ? 0.01 : 0.0;
  const double step = random.uniform(0.0, 2.0), edge = random.uniform(0.0, 1.0);
  const std::uint32_t holes = 1 + random.below(40);
  for (int v = 0; v != height; ++v)
    for (int u = 0; u != width; ++u) {
      const double x = u / static_cast<double>(width), y = v / static_cast<double>(height);
      double z = near + slope_u * x + slope_v * y + (x + 0.3 * y > edge ? step : 0.0) + random.uniform(-noise, noise);
      if (random.below(holes) == 1 || (x > 0.6 && x < 0.7 && y < 0.5)) z = 0.0;
      depth(u, v) = static_cast<float>(z);
    }
  return depth;
}

}  // namespace

TEST_CASE("A depth image marks the voxels that walking each of its rays marks") {
  random_bits random{101};
  for (int run = 0; run != 120; ++run) {
    const int width = 1 + static_cast<int>(random.below(run % 4 == 0 ? 5 : 120));
    const int height = 1 + static_cast<int>(random.below(run % 5 == 0 ? 5 : 90));
    const image<float> depth = random_depth(random, width, height);
    const double field = random.uniform(0.3, 2.2);
    const camera::pinhole camera = camera_of(width, height, field);
    // From less than a pixel for a voxel, where rays are walked, to many.
    const double resolution = std::clamp(random.uniform(1.5, 15.0) / camera.k().fx, 0.005, 0.3);
    const integration_options options{.max_range = run % 3 == 0 ? random.uniform(0.2, 2.0) : no_limit};
    INFO("run " << run << ": " << width << " x " << height);
    require_walked(resolution, camera::depth_view<float>{depth.view()}, camera, random_pose(random, 2.0), options);
  }
}

TEST_CASE("Cameras with distortion mark what the walk marks") {
  random_bits random{108};
  using camera::kannala_brandt;
  using camera::radial_tangential;
  const std::array<camera::any_camera, 7> cameras{
      radial_tangential{{96, 72, 75.0, 76.0, 47.0, 36.5}, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
      radial_tangential{{96, 72, 60.0, 61.0, 49.0, 33.5}, {-0.35, 0.12, 0.003, -0.004}},
      radial_tangential{{90, 66, 40.0, 40.0, 44.5, 32.5}, {-0.30, 0.02, 0.01, 0.01}},  // folds inside the image
      kannala_brandt{{96, 96, 30.0, 30.0, 47.5, 47.5}, {-0.01, 0.02, -0.004, 0.001}},  // sees to the sides and behind
      kannala_brandt{{100, 60, 60.0, 60.0, 50.0, 29.0}, {0.05, -0.02, 0.01, 0.0}},
      radial_tangential{{3, 5, 3.0, 3.0, 1.0, 2.0}, {0.1, 0.01, 0.0, 0.0}},
      camera::pinhole{80, 60, 70.0, 70.0, 39.5, 29.5}};
  for (const camera::any_camera& camera : cameras)
    for (int run = 0; run != 3; ++run) {
      const image<float> depth = random_depth(random, camera.width(), camera.height());
      const se3 pose = random_pose(random, 1.0);
      const integration_options options{.max_range = run == 1 ? 1.5 : no_limit};
      INFO(camera.model_name() << ", run " << run);
      require_walked(run == 2 ? 0.1 : 0.05, camera::depth_view<float>{depth.view()}, camera, pose, options);
    }
}

TEST_CASE("A change of the camera is noticed") {
  random_bits random{109};
  const image<float> depth = random_depth(random, 96, 72);
  const camera::depth_view<float> view{depth.view()};
  const se3 pose = random_pose(random, 1.0);
  const voxel_grid grid{0.05};
  depth_marker marker;
  scan_masks found;
  const camera::radial_tangential wide{{96, 72, 70.0, 70.0, 47.0, 36.5}, {-0.2, 0.05}};
  const camera::radial_tangential narrow{{96, 72, 90.0, 90.0, 47.0, 36.5}, {-0.2, 0.05}};
  const auto check = [&](const auto& camera) {
    marker.mark(seq, grid, depth_scan{view, camera}, pose, {}, found);
    CHECK(differences(walked(grid, view, camera, pose, {}).marker.masks(), found, saturated_voxels{}) == 0);
  };
  check(wide);
  check(narrow);
  check(narrow);
  check(camera::pinhole{96, 72, 90.0, 90.0, 47.0, 36.5});
  check(camera::any_camera{wide});
}

TEST_CASE("A camera on a face, an edge or a corner of its voxel marks what the walk marks") {
  random_bits random{102};
  const image<float> depth = random_depth(random, 97, 61);
  const camera::depth_view<float> view{depth.view()};
  // The optical axis in the middle of a pixel: its column and row of rays lie in the voxels' faces.
  const camera::pinhole camera{97, 61, 90.0, 90.0, 48.0, 30.0};
  for (const double resolution : {0.05, 0.02})
    for (const vec3& centre : {vec3{0, 0, 0}, vec3{0.35, 0.7, -0.05}, vec3{0.1, 0.013, 0.017}, vec3{0.02, 0.02, 0.021},
                               vec3{0.05000001, 0.1, 0.3}, vec3{0.2, 0.1000003, 0.012}})
      for (const vec3& axis : {vec3{0, 0, 0}, vec3{0, 1.5707963267948966, 0}, vec3{1.5707963267948966, 0, 0},
                               vec3{0, 0.7853981633974483, 0}, vec3{0.4, -0.3, 0.2}})
        require_walked(resolution, view, camera, se3{so3::exp(axis), centre}, {.max_range = 2.0});
}

TEST_CASE("Far from the world's origin floats are coarse, and the voxels still the same") {
  random_bits random{103};
  const image<float> depth = random_depth(random, 80, 60);
  for (const double far : {20.0, 150.0, 500.0, 1200.0}) {
    se3 pose = random_pose(random, 1.0);
    pose = se3{pose.rotation(), pose.translation() + vec3{far, -far, 0.3 * far}};
    require_walked(0.05, camera::depth_view<float>{depth.view()}, camera_of(80, 60), pose);
  }
}

TEST_CASE("A frame at the border of the grid marks what the walk marks") {
  random_bits random{104};
  const image<float> depth = random_depth(random, 40, 30);
  for (const double at : {327.5, -327.6, 330.0})
    require_walked(0.01, camera::depth_view<float>{depth.view()}, camera_of(40, 30),
                   se3{random_pose(random, 1.0).rotation(), {at, 0.0, 0.0}}, {.max_range = 3.0});
}

TEST_CASE("Single pixels that see far do not change what is marked") {
  random_bits random{105};
  image<float> depth = random_depth(random, 64, 48);
  depth(10, 10) = 65.0F;
  depth(50, 40) = 64.0F;
  depth(30, 20) = 1e9F;
  depth(31, 20) = std::numeric_limits<float>::infinity();
  depth(32, 20) = std::numeric_limits<float>::quiet_NaN();
  depth(33, 20) = -1.0F;
  depth(34, 20) = 1e-20F;
  require_walked(0.05, camera::depth_view<float>{depth.view()}, camera_of(64, 48), random_pose(random, 1.0));
  require_walked(0.1, camera::depth_view<float>{depth.view()}, camera_of(64, 48), random_pose(random, 1.0),
                 {.max_range = 30.0});
}

TEST_CASE(
    "Images without a measurement, poses that are not finite and origins outside the grid mark what the walk marks") {
  random_bits random{106};
  const image<float> nothing{40, 30}, depth = random_depth(random, 40, 30);
  const camera::pinhole camera = camera_of(40, 30);
  require_walked(0.05, camera::depth_view<float>{nothing.view()}, camera, random_pose(random, 1.0));
  require_walked(0.05, camera::depth_view<float>{depth.view()}, camera, random_pose(random, 1.0), {.max_range = 0.0});
  require_walked(0.01, camera::depth_view<float>{depth.view()}, camera, se3{so3{}, {328.5, 0.0, 0.0}});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  require_walked(0.05, camera::depth_view<float>{depth.view()}, camera, se3{so3{}, {0.0, nan, 0.0}});
  const image<float> no_image;
  require_walked(0.05, camera::depth_view<float>{no_image.view()}, camera_of(0, 0), se3{});
}

TEST_CASE("Saturated voxels are left out and the others are the walk's") {
  random_bits random{107};
  depth_marker marker;
  scan_masks found;
  std::size_t left_out = 0;
  for (int run = 0; run != 12; ++run) {
    const image<float> depth = random_depth(random, 90, 70);
    const camera::depth_view<float> view{depth.view()};
    const camera::pinhole camera = camera_of(90, 70);
    const se3 pose = random_pose(random, 1.0);
    const voxel_grid grid{run % 2 == 0 ? 0.1 : 0.06};
    const walked expected{grid, view, camera, pose, {}};
    marker.mark(
        seq, grid, depth_scan{view, camera}, pose, {}, found,
        {.find = [](const void*, std::uint64_t name, saturated_voxels::words& mask) { hide_some(name, mask); }});
    REQUIRE(differences(expected.marker.masks(), found, hide_some) == 0);
    left_out += count_free(expected.marker.masks()) - count_free(found);
  }
  CHECK(left_out > 5000);
}

TEST_CASE("Every number of threads marks the same voxels") {
  const io::synthetic_recording room{{.frames = 40}};
  const auto frame = room.frame(7).value();
  room.camera().model.visit([&](const auto& camera) {
    const voxel_grid grid{0.05};
    const integration_options options{.max_range = 4.0};
    depth_marker marker;
    scan_masks alone, together;
    const auto depth = frame.depth_metres();
    const depth_scan scan{depth, camera};
    const auto a = marker.mark(seq, grid, scan, *frame.T_world_camera, options, alone);
    for (const unsigned threads : {2U, 3U, 8U}) {
      const auto b = marker.mark(par.with(threads), grid, scan, *frame.T_world_camera, options, together);
      CHECK(differences(alone, together, saturated_voxels{}) == 0);
      CHECK(a.used == b.used);
      CHECK(a.truncated == b.truncated);
    }
    CHECK(count_free(alone) > 10000);
  });
}

TEST_CASE("Frames of a synthetic room mark what the walk marks") {
  const io::synthetic_recording room{{.frames = 40}};
  for (const std::size_t i : {std::size_t{0}, std::size_t{23}}) {
    const auto frame = room.frame(i).value();
    room.camera().model.visit([&](const auto& camera) {
      for (const double resolution : {0.1, 0.04})
        require_walked(resolution, frame.depth_metres(), camera, *frame.T_world_camera,
                       {.max_range = i == 0 ? no_limit : 3.0});
    });
  }
}

TEST_CASE("Frames of a real kitchen mark what the walk marks") {
  ORBIS_NEEDS_DATA("kitchen");
  const auto recording = io::open_recording(test::data_dir() / "kitchen");
  REQUIRE(recording);
  for (const std::size_t i : {std::size_t{20}, std::size_t{110}}) {
    const auto frame = recording->frame(i);
    REQUIRE(frame);
    REQUIRE(frame->T_world_camera);
    recording->camera().model.visit([&](const auto& camera) {
      for (const double resolution : {0.1, 0.05, 0.02, 0.01})
        require_walked(resolution, frame->depth_metres(), camera, *frame->T_world_camera,
                       {.max_range = resolution < 0.03 ? 2.0 : no_limit});
      const auto distorted = camera::preset("tum_fr1").value();
      distorted.model.visit(
          [&](const auto& other) { require_walked(0.04, frame->depth_metres(), other, *frame->T_world_camera); });
    });
  }
}

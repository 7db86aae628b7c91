// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/cloud/ray_evidence.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>

#include "cloud/posed_scene.hpp"
#include "support/catch.hpp"

using orbis::cloud::ray_evidence;
using orbis::cloud::ray_evidence_options;
using orbis::cloud::ray_evidence_scores;
using orbis::test::box_scene;
using orbis::test::posed_image;
using orbis::test::views_of;

namespace {

constexpr float quiet_nan = std::numeric_limits<float>::quiet_NaN();
constexpr float inf = std::numeric_limits<float>::infinity();

/// What the docstring says, point by point and pixel by pixel.
template <class Camera>
std::vector<ray_evidence> reference(const std::vector<orbis::vec3f>& points, const std::vector<posed_image>& views,
                                    const Camera& camera, const ray_evidence_options& options) {
  std::vector<ray_evidence> out(points.size());
  for (const posed_image& view : views) {
    if (!view.T_world_camera.to_matrix().allFinite()) continue;
    orbis::cloud::detail::ray_view placed;
    orbis::cloud::detail::place(placed, view.T_world_camera);
    for (std::size_t i = 0; i != points.size(); ++i) {
      if (!points[i].allFinite()) continue;
      const auto q = orbis::cloud::detail::in_camera(placed, points[i].x(), points[i].y(), points[i].z());
      const float z = q[2];
      if (!(z > options.min_depth && z <= options.max_depth)) continue;
      int u = -1;
      int v = -1;
      if constexpr (std::same_as<Camera, orbis::camera::pinhole>) {
        const float x = static_cast<float>(camera.k().fx) * (q[0] / z) + static_cast<float>(camera.k().cx + 0.5);
        const float y = static_cast<float>(camera.k().fy) * (q[1] / z) + static_cast<float>(camera.k().cy + 0.5);
        if (!(x >= 0 && x < static_cast<float>(camera.width()) && y >= 0 && y < static_cast<float>(camera.height())))
          continue;
        u = static_cast<int>(x);
        v = static_cast<int>(y);
      } else {
        const auto pixel = camera.project(orbis::vec3{q[0], q[1], q[2]});
        if (!pixel) continue;
        const double x = std::floor(pixel->x() + 0.5);
        const double y = std::floor(pixel->y() + 0.5);
        if (!(x >= 0 && x < camera.width() && y >= 0 && y < camera.height())) continue;
        u = static_cast<int>(x);
        v = static_cast<int>(y);
      }
      float nearest = inf;
      float farthest = -inf;
      bool whole = true;
      for (int b = v - options.window; b <= v + options.window; ++b) {
        for (int a = u - options.window; a <= u + options.window; ++a) {
          const bool inside = a >= 0 && b >= 0 && a < camera.width() && b < camera.height();
          const float d = inside ? view.depth(a, b) : 0.0F;
          if (d > 0) {
            nearest = std::min(nearest, d);
            farthest = std::max(farthest, d);
          } else {
            whole = false;
          }
        }
      }
      const float margin = options.margin + options.margin_growth * (z * z);
      const auto near = [&](float d) { return std::abs(d - z) <= margin; };
      const float middle = view.depth(u, v);
      if (whole && nearest - z > margin + options.slant * (farthest - nearest)) ++out[i].through;
      if ((whole && near(nearest)) || near(farthest) || (middle > 0 && near(middle))) ++out[i].supported;
    }
  }
  return out;
}

orbis::camera::pinhole small_camera() {
  return orbis::camera::pinhole{{.width = 83, .height = 61, .fx = 70, .fy = 72, .cx = 40.3, .cy = 31.1}};
}

/// Points of the scene's surfaces, anywhere, behind the cameras, and not finite.
std::vector<orbis::vec3f> probing_points(const std::vector<posed_image>& views, const orbis::camera::pinhole& camera) {
  std::vector<orbis::vec3f> out;
  for (const posed_image& view : views) {
    if (!view.T_world_camera.to_matrix().allFinite()) continue;
    const auto seen =
        orbis::camera::unproject_depth(orbis::seq, view.depth, camera, {.stride = 3}, view.T_world_camera);
    out.insert(out.end(), seen.points.begin(), seen.points.end());
  }
  orbis::random_bits random{5};
  for (int i = 0; i != 3000; ++i) {
    const double x = random.uniform(-4, 4);
    const double y = random.uniform(-3, 3);
    out.emplace_back(orbis::vec3{x, y, random.uniform(-4, 8)}.cast<float>());
  }
  out.emplace_back(quiet_nan, 0.0F, 1.0F);
  out.emplace_back(0.0F, inf, 1.0F);
  out.emplace_back(0.0F, 0.0F, 0.0F);
  out.emplace_back(1e30F, -1e30F, 1e30F);
  out.emplace_back(3e38F, 3e38F, -3e38F);
  return out;
}

std::vector<posed_image> room_views(const auto& camera) {
  auto views = views_of(box_scene::room(), camera, 6, {.noise = 0.002, .holes = 8});
  views[3].T_world_camera = orbis::se3{orbis::so3{}, orbis::vec3{0, quiet_nan, 0}};
  views[4].image(7, 9) = quiet_nan;
  views[4].image(8, 9) = inf;
  views[4].image(9, 9) = -1.0F;
  return views;
}

}  // namespace

TEST_CASE("ray evidence is what every ray says of every point") {
  const auto camera = small_camera();
  const auto views = room_views(camera);
  const auto points = probing_points(views, camera);
  for (const int window : {0, 1, 2, 5, 40}) {
    for (const float slant : {0.0F, 1.0F}) {
      const ray_evidence_options options{.window = window, .margin = 0.01F, .slant = slant, .max_depth = 5.5F};
      const auto wanted = reference(points, views, camera, options);
      INFO("window " << window << ", slant " << slant);
      std::size_t through = 0;
      for (const auto& e : wanted) through += e.through;
      CHECK((through > 50 || window > 2));
      CHECK(ray_evidence_scores(orbis::seq, points, views, camera, options) == wanted);
      for (const unsigned threads : {2U, 7U})
        CHECK(ray_evidence_scores(orbis::par.with(threads), points, views, camera, options) == wanted);
      for (const auto level : {orbis::simd::level::portable, orbis::simd::level::avx2, orbis::simd::level::avx512}) {
        orbis::cloud::ray_evidence_counter counter{orbis::seq, points, camera, options, level};
        for (const auto& view : views) counter.add(orbis::seq, view);
        CHECK(counter.scores() == wanted);
      }
    }
  }
}

TEST_CASE("ray evidence through any lens") {
  const orbis::camera::intrinsics k{.width = 83, .height = 61, .fx = 60, .fy = 61, .cx = 40.3, .cy = 31.1};
  const auto check = [](const auto& camera) {
    const auto views = room_views(camera);
    const auto points = probing_points(room_views(small_camera()), small_camera());
    const ray_evidence_options options{.window = 1};
    const auto wanted = reference(points, views, camera, options);
    std::size_t through = 0;
    for (const auto& e : wanted) through += e.through;
    CHECK(through > 200);
    CHECK(ray_evidence_scores(orbis::seq, points, views, camera, options) == wanted);
    CHECK(ray_evidence_scores(orbis::par.with(3), points, views, camera, options) == wanted);
    CHECK(ray_evidence_scores(orbis::par.with(3), points, views, orbis::camera::any_camera{camera}, options) == wanted);
  };
  check(orbis::camera::radial_tangential{k, {.k1 = -0.25, .k2 = 0.07, .p1 = 1e-3, .p2 = -2e-3}});
  check(orbis::camera::kannala_brandt{k, {.k1 = 0.05, .k2 = -0.01}});
  // So wide that pixels in the corners have no ray: nothing can be skipped.
  check(orbis::camera::kannala_brandt{{.width = 83, .height = 61, .fx = 22, .fy = 22, .cx = 41, .cy = 30}, {}});
}

TEST_CASE("ray evidence of nothing") {
  const auto camera = small_camera();
  const auto views = room_views(camera);
  CHECK(ray_evidence_scores(orbis::par, std::vector<orbis::vec3f>{}, views, camera).empty());
  const std::vector<orbis::vec3f> none(300, orbis::vec3f::Constant(quiet_nan));
  CHECK(ray_evidence_scores(orbis::par, none, views, camera) == std::vector<ray_evidence>(300));
  CHECK(orbis::cloud::ray_evidence_inliers(orbis::par, none, views, camera).empty());
  const auto points = probing_points(views, camera);
  const auto unseen = ray_evidence_scores(orbis::par, points, std::vector<posed_image>{}, camera);
  CHECK(unseen == std::vector<ray_evidence>(points.size()));
  CHECK(orbis::cloud::ray_evidence_decision(unseen).inliers.size() == points.size());
  CHECK(orbis::cloud::ray_evidence_decision(unseen).seen == 0);
  CHECK(orbis::cloud::ray_evidence_decision({}).inliers.empty());
  auto blind = views;
  for (auto& view : blind) view.image = orbis::image<float>(camera.width(), camera.height(), 0.0F);
  for (auto& view : blind) view.depth = orbis::camera::depth_view<float>(view.image);
  CHECK(ray_evidence_scores(orbis::par, points, blind, camera) == unseen);
}

TEST_CASE("ray evidence far from the origin") {
  // A float's step is 6 cm at 10^6 m, but the camera is known better than that.
  const auto camera = small_camera();
  auto views = views_of(box_scene::room(), camera, 3, {});
  const auto near = probing_points(views, camera);
  const auto wanted = ray_evidence_scores(orbis::seq, near, views, camera);
  const orbis::vec3 shift{0.0, 65536.03125, -4096.0};
  for (auto& view : views)
    view.T_world_camera = orbis::se3{view.T_world_camera.rotation(), view.T_world_camera.translation() + shift};
  std::vector<orbis::vec3f> far;
  for (const auto& p : near) far.push_back((p.cast<double>() + shift).cast<float>());
  const auto got = ray_evidence_scores(orbis::seq, far, views, camera);
  std::size_t different = 0;
  for (std::size_t i = 0; i != far.size(); ++i) different += got[i] == wanted[i] ? 0 : 1;
  CHECK(different < far.size() / 20);
}

TEST_CASE("ray evidence can be watched and stopped") {
  const auto camera = small_camera();
  const auto views = views_of(box_scene::room(), camera, 4, {});
  const auto points = probing_points(views, camera);
  std::size_t calls = 0;
  const auto watch = [&](std::size_t done, std::size_t total) {
    CHECK(done == ++calls);
    CHECK(total == 4);
    return true;
  };
  const auto all = ray_evidence_scores(orbis::seq, points, views, camera, {}, watch);
  CHECK(calls == 4);
  CHECK(all == ray_evidence_scores(orbis::seq, points, views, camera));
  const auto stop = [](std::size_t done, std::size_t) { return done < 2; };
  CHECK(ray_evidence_scores(orbis::seq, points, views, camera, {}, stop) ==
        ray_evidence_scores(orbis::seq, points, std::vector<posed_image>{views[0], views[1]}, camera));
}

TEST_CASE("counts end at their largest number") {
  for (const auto level : {orbis::simd::level::portable, orbis::simd::level::avx2, orbis::simd::level::avx512}) {
    std::vector<std::uint16_t> counters(orbis::cloud::point_blocks::block_size, 65534);
    std::array<std::uint16_t, orbis::cloud::detail::block_verdict::words> words{};
    words.fill(0xa5c3);
    const auto kernels = orbis::cloud::detail::ray_kernels_at(level);
    for (int again = 0; again != 3; ++again) kernels.count(words, counters.data());
    for (std::size_t i = 0; i != counters.size(); ++i)
      CHECK(counters[i] == ((0xa5c3U >> (i % 16) & 1U) != 0 ? 65535 : 65534));
  }
}

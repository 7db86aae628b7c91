// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/cloud/ray_evidence-inl.hpp>
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

/// What a view says of a point, in which tile; or the start of a view.
struct said {
  std::size_t point;
  int x, y;
  bool supported;
  float before;
  bool start = false;
  [[nodiscard]] bool is_start() const { return start; }
};

/// What the docstrings say, point by point and pixel by pixel.
template <class Camera>
std::vector<ray_evidence> reference(const std::vector<orbis::vec3f>& points, const std::vector<posed_image>& views,
                                    const Camera& camera, const ray_evidence_options& options) {
  std::vector<ray_evidence> out(points.size());
  std::vector<said> all;  // view after view
  for (const posed_image& view : views) {
    all.push_back({0, 0, 0, false, 0.0F, true});
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
      const bool through = whole && nearest - z > margin + options.slant * (farthest - nearest);
      const bool supported = (whole && near(nearest)) || near(farthest) || (middle > 0 && near(middle));
      if (through) ++out[i].through;
      if (supported) ++out[i].supported;
      if (through || supported) all.push_back({i, u / 4, v / 4, supported, nearest - z});
    }
  }
  if (!options.resolve_ghosts) return out;
  const auto counted = out;
  for (auto first = all.begin(); first != all.end();) {
    const auto last = std::find_if(first + 1, all.end(), [](const said& s) { return s.is_start(); });
    std::map<std::pair<int, int>, std::int64_t> balance;
    for (auto s = first + 1; s != last; ++s) {
      const std::int64_t views_of_point = counted[s->point].supported;
      if (s->supported) balance[{s->x, s->y}] += 3 * (views_of_point - 1);
      if (!s->supported && s->before <= options.ghost_reach) balance[{s->x, s->y}] -= 2 * views_of_point;
    }
    for (auto s = first + 1; s != last; ++s) {
      if (balance[{s->x, s->y}] >= 0) continue;
      if (s->supported) {
        --out[s->point].supported;
        ++out[s->point].refuted;
      } else {
        --out[s->point].through;
      }
    }
    first = last;
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
  views[2].T_world_camera = orbis::se3{orbis::so3{}, orbis::vec3{0, 0, 0.2}} * views[2].T_world_camera;
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
    for (const bool ghosts : {false, true}) {
      const ray_evidence_options options{.window = window,
                                         .margin = 0.01F,
                                         .slant = window == 1 ? 0.0F : 1.0F,
                                         .max_depth = 5.5F,
                                         .resolve_ghosts = ghosts,
                                         .ghost_reach = 0.6F};
      const auto wanted = reference(points, views, camera, options);
      INFO("window " << window << ", ghosts " << ghosts);
      std::size_t through = 0;
      std::size_t refuted = 0;
      for (const auto& e : wanted) through += e.through;
      for (const auto& e : wanted) refuted += e.refuted;
      CHECK((refuted > 0) == (ghosts && window < 3));
      CHECK((through > 50 || window > 2));
      CHECK(ray_evidence_scores(orbis::seq, points, views, camera, options) == wanted);
      for (const unsigned threads : {2U, 7U})
        CHECK(ray_evidence_scores(orbis::par.with(threads), points, views, camera, options) == wanted);
      for (const auto level : {orbis::simd::level::portable, orbis::simd::level::avx2, orbis::simd::level::avx512}) {
        const orbis::simd::level_limit limit{level};
        orbis::cloud::ray_evidence_counter counter{orbis::seq, points, camera, options};
        for (const auto& view : views) counter.add(orbis::seq, view);
        for (const auto& view : views) {
          if (ghosts) counter.review(orbis::seq, view);
        }
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
    for (const auto level : orbis::simd::available_levels()) {
      const orbis::simd::level_limit limit{level};
      CHECK(ray_evidence_scores(orbis::seq, points, views, camera, options) == wanted);
    }
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
    CHECK(total == 8);
    return true;
  };
  const auto all = ray_evidence_scores(orbis::seq, points, views, camera, {}, watch);
  CHECK(calls == 8);
  CHECK(all == ray_evidence_scores(orbis::seq, points, views, camera));
  const auto stop = [](std::size_t done, std::size_t) { return done < 2; };
  CHECK(ray_evidence_scores(orbis::seq, points, views, camera, {}, stop) ==
        ray_evidence_scores(orbis::seq, points, std::vector<posed_image>{views[0], views[1]}, camera,
                            {.resolve_ghosts = false}));
}

namespace {

/// The points of some views, with the view each is of.
struct seen_cloud {
  std::vector<orbis::vec3f> points;
  std::vector<std::size_t> view;
};

seen_cloud cloud_of(const std::vector<posed_image>& views, const orbis::camera::pinhole& camera, int stride = 1) {
  seen_cloud out;
  for (std::size_t v = 0; v != views.size(); ++v) {
    const auto seen =
        orbis::camera::unproject_depth(orbis::seq, views[v].depth, camera, {.stride = stride}, views[v].T_world_camera);
    out.points.insert(out.points.end(), seen.points.begin(), seen.points.end());
    out.view.resize(out.points.size(), v);
  }
  return out;
}

/// Of the points that `chosen` says are meant, the share that the filter keeps.
template <class F>
double kept(const seen_cloud& cloud, const std::vector<std::uint32_t>& inliers, F&& chosen) {
  double all = 0;
  double left = 0;
  for (std::size_t i = 0; i != cloud.points.size(); ++i) all += chosen(i) ? 1 : 0;
  for (const std::uint32_t i : inliers) left += chosen(i) ? 1 : 0;
  REQUIRE(all > 100);
  return left / all;
}

orbis::camera::pinhole filter_camera() {
  return orbis::camera::pinhole{{.width = 160, .height = 120, .fx = 131, .fy = 131, .cx = 79.5, .cy = 59.5}};
}

orbis::se3 shaken(const orbis::se3& pose, double metres, double radians, std::uint64_t seed) {
  orbis::random_bits random{seed};
  orbis::vec6 xi;
  for (Eigen::Index a = 0; a != 6; ++a) xi[a] = (a < 3 ? metres : radians) * random.normal();
  return pose * orbis::se3::exp(xi);
}

}  // namespace

TEST_CASE("ray evidence leaves a clean cloud alone") {
  const auto camera = filter_camera();
  const auto scene = box_scene::room();
  auto views = views_of(scene, camera, 16, {.noise = 0.002, .holes = 10});
  for (std::size_t v = 0; v != views.size(); ++v)
    views[v].T_world_camera = shaken(views[v].T_world_camera, 0.003, 0.001, v);
  const auto cloud = cloud_of(views, camera);
  const auto inliers = orbis::cloud::ray_evidence_inliers(orbis::par, cloud.points, views, camera);
  CHECK(kept(cloud, inliers, [](std::size_t) { return true; }) > 0.998);
  // The pole is two pixels wide, the board is seen from its edge, the floor at a grazing angle.
  CHECK(kept(cloud, inliers, [&](std::size_t i) {
          const auto& p = cloud.points[i];
          return std::abs(p.x() + 0.4F) < 0.03F && std::abs(p.z() - 1.9F) < 0.03F && p.y() < 0.35F;
        }) > 0.97);
  CHECK(kept(cloud, inliers, [&](std::size_t i) {
          const auto& p = cloud.points[i];
          return std::abs(p.z() - 2.4F) < 0.04F && p.x() > 0.6F && p.x() < 1.6F && std::abs(p.y()) < 0.6F;
        }) > 0.99);
  CHECK(kept(cloud, inliers, [&](std::size_t i) { return cloud.points[i].y() > 1.48F; }) > 0.998);
}

TEST_CASE("ray evidence removes what was there for a while") {
  const auto camera = filter_camera();
  auto scene = box_scene::room();
  const box_scene::box person{{0.3, -0.3, 1.2}, {0.7, 1.5, 1.5}};
  std::vector<posed_image> views;
  for (std::size_t v = 0; v != 12; ++v) {
    scene.boxes.resize(3);
    if (v % 4 == 0) scene.boxes.push_back(person);
    views.push_back(view_of(scene, camera, orbis::test::walking_pose(v), {.noise = 0.002, .seed = v}));
  }
  const auto cloud = cloud_of(views, camera, 2);
  const auto of_person = [&](std::size_t i) {
    const orbis::vec3 p = cloud.points[i].cast<double>();
    return ((p - person.low).array() > -0.02).all() && ((person.high - p).array() > -0.02).all() && p.y() < 1.45;
  };
  const auto inliers = orbis::cloud::ray_evidence_inliers(orbis::par, cloud.points, views, camera);
  CHECK(kept(cloud, inliers, of_person) < 0.05);
  CHECK(kept(cloud, inliers, [&](std::size_t i) { return !of_person(i); }) > 0.998);
}

TEST_CASE("of two surfaces ray evidence keeps the one that more views saw") {
  const auto camera = filter_camera();
  // Displaced towards the wall ahead, away from it, and turned: ghosts before and behind the surfaces.
  for (const orbis::se3& error :
       {orbis::se3{orbis::so3{}, orbis::vec3{0, 0, 0.15}}, orbis::se3{orbis::so3{}, orbis::vec3{0, 0, -0.15}},
        orbis::se3{orbis::so3::exp(orbis::vec3{0.01, 0.035, 0}), orbis::vec3{0.02, 0.03, -0.13}}}) {
    auto views = views_of(box_scene::room(), camera, 12, {.noise = 0.002});
    const auto is_wrong = [](std::size_t view) { return view % 4 == 1; };
    const auto truth = cloud_of(views, camera, 2);
    for (std::size_t v = 0; v != views.size(); ++v) {
      if (is_wrong(v)) views[v].T_world_camera = error * views[v].T_world_camera;
    }
    const auto cloud = cloud_of(views, camera, 2);
    const auto inliers = orbis::cloud::ray_evidence_inliers(orbis::par, cloud.points, views, camera);
    const auto on_board = [&](std::size_t i) {
      const auto& p = truth.points[i];
      return std::abs(p.z() - 2.4F) < 0.05F && std::abs(p.x() - 1.1F) < 0.45F && std::abs(p.y()) < 0.55F;
    };
    INFO("displaced by " << error.translation().transpose());
    CHECK(kept(cloud, inliers, [&](std::size_t i) {
            return is_wrong(cloud.view[i]) && on_board(i) && std::abs(cloud.points[i].z() - 2.4F) > 0.09F;
          }) < 0.15);  // what is left lies along its edges
    CHECK(kept(cloud, inliers, [&](std::size_t i) { return !is_wrong(cloud.view[i]); }) > 0.99);
  }
}

TEST_CASE("ray evidence removes stray points that are seen through, and no others") {
  const auto camera = filter_camera();
  const auto views = views_of(box_scene::room(), camera, 12, {.noise = 0.002});
  seen_cloud cloud;
  orbis::random_bits random{3};
  for (int i = 0; i != 4000; ++i) {
    const double x = random.uniform(-2.9, 2.9);
    const double y = random.uniform(-1.4, 1.4);
    cloud.points.emplace_back(orbis::vec3{x, y, random.uniform(-2.9, 3.9)}.cast<float>());
  }
  const auto decided =
      orbis::cloud::ray_evidence_decision(orbis::cloud::ray_evidence_scores(orbis::par, cloud.points, views, camera));
  CHECK(decided.scores.size() == cloud.points.size());
  const auto is_seen = [&](std::size_t i) { return decided.scores[i].through > 1; };
  CHECK(kept(cloud, decided.inliers, is_seen) < 0.05);
  // Nothing is known of those behind the cameras, or behind the walls.
  CHECK(kept(cloud, decided.inliers, [&](std::size_t i) { return cloud.points[i].z() < -1.5F; }) == 1.0);
}

TEST_CASE("a point that one view alone has seen stays") {
  const auto camera = filter_camera();
  const std::vector<posed_image> one{
      view_of(box_scene::room(), camera, orbis::test::walking_pose(0), {.noise = 0.002})};
  const auto cloud = cloud_of(one, camera);
  const auto scores = ray_evidence_scores(orbis::seq, cloud.points, one, camera);
  for (const auto& e : scores) CHECK(e == ray_evidence{.supported = 1});
  CHECK(orbis::cloud::ray_evidence_decision(scores).inliers.size() == cloud.points.size());
}

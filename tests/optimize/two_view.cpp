// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/optimize/triangulation.hpp>
#include <orbis/optimize/two_view.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

/// A made-up pair of images.
struct view_options {
  double baseline = 0.3;  ///< metres; points are one to `far` metres away
  double turn = 0.15;     ///< of each angle, radians, at most
  bool forward = false;   ///< the translation is along the axis, nearly
  double in_plane = 0.0;  ///< share of the points
  double wrong = 0.3;     ///< share of the matches that are anywhere within 100 pixels
  double moving = 0.0;    ///< share of the matches that move as another body
  double noise = 1.0;     ///< pixels
  double far = 5.0;
  std::size_t n = 400;
};

struct two_images {
  se3 T_first_second;
  std::vector<vec2> first, second;
  std::vector<vec3> points;  ///< where the matches are right
};

template <class Camera>
two_images make_images(const Camera& camera, std::uint64_t seed, const view_options& o) {
  random_bits random(mix64(seed));
  two_images s;
  vec3 t = test::random_vector(random, 1.0).normalized();
  if (o.forward) t = (vec3::UnitZ() + test::random_vector(random, 0.1)).normalized();
  s.T_first_second = se3(so3::exp(test::random_vector(random, o.turn)), o.baseline * t);
  const se3 body(so3::exp(test::random_vector(random, 0.1)), 0.3 * test::random_vector(random, 1.0).normalized());
  const vec3 normal(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 1.0);
  while (s.first.size() < o.n) {
    const vec2 pixel(random.uniform(10, camera.width() - 10), random.uniform(10, camera.height() - 10));
    const double kind = random.uniform(0, 1), depth = 1.0 / random.uniform(1.0 / o.far, 1.0);
    const bool in_plane = random.uniform(0, 1) < o.in_plane;
    const vec2 noise_a(random.normal(), random.normal()), noise_b(random.normal(), random.normal());
    const vec2 aside(random.uniform(-100, 100), random.uniform(-100, 100));
    const auto ray = camera.unproject(pixel);
    if (!ray) continue;
    const double z = in_plane ? 2.5 / ray->dot(normal) : depth;
    if (!(z > 0.1 && z < 50.0)) continue;
    const vec3 p = z * *ray;
    const vec3 q = s.T_first_second.inverse() * (kind < o.moving ? body * p : p);
    const auto seen = q.z() > 0.1 ? camera.project(q) : std::nullopt;
    if (!seen || seen->x() < 0 || seen->y() < 0 || seen->x() > camera.width() || seen->y() > camera.height()) continue;
    const bool wrong = kind >= o.moving && kind < o.moving + o.wrong;
    s.first.push_back(pixel + o.noise * noise_a);
    s.second.push_back(*seen + (wrong ? aside : vec2(o.noise * noise_b)));
    s.points.push_back(p);
  }
  return s;
}

const camera::pinhole pinhole_camera{{.width = 640, .height = 480, .fx = 525, .fy = 520, .cx = 320, .cy = 240}};

struct tally {
  int right = 0, wrong = 0;
};

/// How often a scene is reconstructed in 50 pairs of images, and how often wrongly.
template <class Camera>
tally reconstruct(const Camera& camera, const view_options& o) {
  tally count;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const two_images s = make_images(camera, seed, o);
    const auto found = optimize::reconstruct_two_views(s.first, s.second, camera, {.seed = seed});
    if (!found) continue;
    const double turned = test::angle_between(found->T_first_second, s.T_first_second);
    const double apart =
        optimize::detail::angle_between_directions(found->T_first_second.translation(), s.T_first_second.translation());
    ++(o.baseline > 0.0 && turned < 0.0175 && apart < 0.175 ? count.right : count.wrong);
  }
  return count;
}

}  // namespace

TEST_CASE("A scene is reconstructed from two images of it in every one of 50 seeds") {
  for (const double noise : {0.3, 1.0})
    for (const double wrong : {0.0, 0.3}) {
      const tally t = reconstruct(pinhole_camera, {.baseline = 0.5, .wrong = wrong, .noise = noise});
      CHECK(t.wrong == 0);
      CHECK(t.right == 50);
    }
  // More noise than was said.
  const tally noisy = reconstruct(pinhole_camera, {.baseline = 0.5, .noise = 1.5});
  CHECK(noisy.wrong == 0);
  CHECK(noisy.right >= 45);
}

TEST_CASE("Half of the matches may be wrong or a fifth move otherwise") {
  const tally half = reconstruct(pinhole_camera, {.baseline = 0.5, .wrong = 0.5});
  CHECK(half.wrong == 0);
  CHECK(half.right >= 45);
  const tally fifth = reconstruct(pinhole_camera, {.wrong = 0.1, .moving = 0.2});
  CHECK(fifth.wrong == 0);
  CHECK(fifth.right >= 45);
  const tally third = reconstruct(pinhole_camera, {.wrong = 0.1, .moving = 0.35});
  CHECK(third.wrong == 0);
}

TEST_CASE("Two images on the way forward are enough") {
  for (const double baseline : {0.3, 1.0}) {
    const tally t = reconstruct(pinhole_camera, {.baseline = baseline, .forward = true});
    CHECK(t.wrong == 0);
    CHECK(t.right >= 48);
  }
}

TEST_CASE("Two images through any camera are enough") {
  const camera::kannala_brandt fisheye{{.width = 640, .height = 480, .fx = 240, .fy = 240, .cx = 320, .cy = 240},
                                       {.k1 = 0.01, .k2 = 0.01}};
  const camera::radial_tangential distorting{
      {.width = 640, .height = 480, .fx = 517.3, .fy = 516.5, .cx = 318.6, .cy = 255.3},
      {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .p2 = 0.0026, .k3 = 1.1633}};
  const tally wide = reconstruct(fisheye, {.noise = 0.5});
  CHECK(wide.wrong == 0);
  CHECK(wide.right >= 48);
  const tally narrow = reconstruct(distorting, {.baseline = 0.5, .noise = 0.5});
  CHECK(narrow.wrong == 0);
  CHECK(narrow.right >= 48);
  CHECK(reconstruct(fisheye, {.baseline = 0.0, .noise = 0.5}).wrong == 0);
}

TEST_CASE("A camera that only turns sees no scene") {
  for (const double wrong : {0.0, 0.3, 0.5})
    CHECK(reconstruct(pinhole_camera, {.baseline = 0.0, .wrong = wrong}).wrong == 0);
  for (const double moving : {0.2, 0.4})
    CHECK(reconstruct(pinhole_camera, {.baseline = 0.0, .wrong = 0.1, .moving = moving}).wrong == 0);
}

TEST_CASE("A small baseline is waited out") {
  const tally none = reconstruct(pinhole_camera, {.baseline = 0.01});
  CHECK(none.right + none.wrong == 0);
  CHECK(reconstruct(pinhole_camera, {.baseline = 0.1}).wrong == 0);
}

TEST_CASE("Of a plane there is the right motion or none and few points beside it decide") {
  for (const double baseline : {0.1, 0.3, 0.5, 1.0}) {
    CHECK(reconstruct(pinhole_camera, {.baseline = baseline, .in_plane = 1.0}).wrong == 0);
    CHECK(reconstruct(pinhole_camera, {.baseline = baseline, .in_plane = 0.95}).wrong == 0);
  }
  const tally t = reconstruct(pinhole_camera, {.baseline = 0.5, .in_plane = 0.8});
  CHECK(t.wrong == 0);
  CHECK(t.right >= 40);
  // The more matches there are, the smaller is the share of them that suffices.
  const view_options nearly_plane{.baseline = 0.5, .in_plane = 0.93, .wrong = 0.1};
  view_options many = nearly_plane;
  many.n = 1600;
  const tally of_few = reconstruct(pinhole_camera, nearly_plane), of_many = reconstruct(pinhole_camera, many);
  CHECK(of_few.wrong + of_many.wrong == 0);
  CHECK(of_many.right >= 40);
  CHECK(of_many.right > of_few.right);
  for (const double moving : {0.2, 0.3, 0.4})
    CHECK(reconstruct(pinhole_camera, {.in_plane = 1.0, .wrong = 0.1, .moving = moving}).wrong == 0);
}

TEST_CASE("The points of a reconstruction are those of the scene at the scale of their median depth") {
  const two_images s = make_images(pinhole_camera, 3, {.baseline = 0.5, .wrong = 0.0, .noise = 0.05});
  const auto found = optimize::reconstruct_two_views(s.first, s.second, pinhole_camera);
  REQUIRE(found.has_value());
  REQUIRE(found->points.size() == found->matches.size());
  REQUIRE(found->points.size() > 300);
  CHECK(std::is_sorted(found->matches.begin(), found->matches.end()));
  std::vector<double> depths, truth;
  for (std::size_t i = 0; i != found->points.size(); ++i) {
    depths.push_back(found->points[i].z());
    truth.push_back(s.points[found->matches[i]].z());
  }
  const auto middle = [](std::vector<double> x) {
    std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2), x.end());
    return x[x.size() / 2];
  };
  CHECK(middle(depths) == Approx(1.0));
  const double unit = middle(truth);
  CHECK(unit * found->T_first_second.translation().norm() == Approx(0.5).epsilon(0.01));
  for (std::size_t i = 0; i != found->points.size(); ++i)
    CHECK((unit * found->points[i] - s.points[found->matches[i]]).norm() < 0.03 * truth[i]);
  CHECK(found->rmse < 0.1);
  CHECK(found->inliers >= found->points.size());
  CHECK(found->parallax > 0.05);
  CHECK_FALSE(found->from_homography);
  const auto again = optimize::reconstruct_two_views(s.first, s.second, pinhole_camera);
  REQUIRE(again.has_value());
  CHECK(again->T_first_second.to_matrix() == found->T_first_second.to_matrix());
}

TEST_CASE("The deviations of a reconstruction are those of its errors") {
  double turned = 0.0, apart = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const two_images s = make_images(pinhole_camera, seed, {.wrong = 0.0});
    const auto found = optimize::reconstruct_two_views(s.first, s.second, pinhole_camera);
    if (!found) continue;
    ++count;
    const double r = test::angle_between(found->T_first_second, s.T_first_second) / found->rotation_deviation;
    const double d = optimize::detail::angle_between_directions(found->T_first_second.translation(),
                                                                s.T_first_second.translation()) /
                     found->direction_deviation;
    turned += r * r;
    apart += d * d;
  }
  REQUIRE(count > 45);
  // Of the largest axis; the others add less.
  CHECK(std::sqrt(turned / count) < 2.5);
  CHECK(std::sqrt(turned / count) > 0.4);
  CHECK(std::sqrt(apart / count) < 2.5);
  CHECK(std::sqrt(apart / count) > 0.4);
}

TEST_CASE("A reconstruction says why there is none") {
  const auto why = [](const two_images& s, const optimize::two_view_options& options = {},
                      std::span<const double> deviations = {}) {
    const auto found = optimize::reconstruct_two_views(s.first, s.second, pinhole_camera, options, deviations);
    return found ? error{} : found.error();
  };
  const two_images turned = make_images(pinhole_camera, 4, {.baseline = 0.0, .wrong = 0.0});
  CHECK(why(turned).code == errc::degenerate);
  CHECK(why(turned).message.find("no parallax") == 0);
  const two_images planar = make_images(pinhole_camera, 4, {.baseline = 0.5, .in_plane = 1.0, .wrong = 0.0});
  CHECK(why(planar).code == errc::degenerate);
  CHECK(why(planar).message.find("two motions") == 0);
  const two_images nonsense = make_images(pinhole_camera, 4, {.wrong = 1.0});
  CHECK(why(nonsense).code == errc::degenerate);
  for (const double bad : test::bad_thresholds) CHECK(why(turned, {.deviation = bad}).code == errc::invalid_argument);
  CHECK(why(turned, {.confidence = 1.0}).code == errc::invalid_argument);
  const std::vector<double> one(1, 1.0);
  CHECK(why(turned, {}, one).code == errc::invalid_argument);
  two_images few = make_images(pinhole_camera, 4, {});
  few.first.resize(30);
  CHECK(why(few).code == errc::invalid_argument);
  few.second.resize(30);
  CHECK(why(few).code == errc::no_data);
  two_images bad = make_images(pinhole_camera, 4, {});
  for (auto& p : bad.first) p.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(why(bad).code == errc::no_data);
}

TEST_CASE("Matches that are known to be less exact count less") {
  int better = 0, both = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    two_images s = make_images(pinhole_camera, seed, {.baseline = 0.5, .wrong = 0.0, .noise = 0.3});
    random_bits random(seed);
    std::vector<double> deviations(s.first.size(), 0.3);
    for (std::size_t i = 0; i < s.first.size(); i += 2) {
      deviations[i] = 3.0;
      s.second[i] += 3.0 * vec2(random.normal(), random.normal());
    }
    const auto error_of = [&](std::span<const double> d) {
      const auto found = optimize::reconstruct_two_views(s.first, s.second, pinhole_camera, {}, d);
      return found ? test::angle_between(found->T_first_second, s.T_first_second) : 1.0;
    };
    const double with = error_of(deviations), without = error_of({});
    ++both;
    better += with < without;
  }
  CHECK(better > both / 2);
}

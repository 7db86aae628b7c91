// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/stereo.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::camera;

namespace {

const se3 turned{so3::exp(vec3{0.02, -0.03, 0.04}), vec3{0.12, 0.004, -0.006}};

/// Brightness of a wall at depth 3 in the left camera's frame.
double wall(double x, double y) { return 125.0 + 60.0 * std::sin(9.0 * x) + 60.0 * std::cos(11.0 * y + 2.0 * x); }

/// What a camera at `T_left_camera` sees of the wall.
template <class Camera>
image<std::uint8_t> picture(const Camera& camera, const se3& T_left_camera) {
  image<std::uint8_t> out{camera.width(), camera.height()};
  for (int y = 0; y != out.height(); ++y)
    for (int x = 0; x != out.width(); ++x)
      if (const auto ray = camera.unproject({x, y})) {
        const vec3 d = T_left_camera.rotation() * *ray;
        const vec3 p = T_left_camera.translation() + (3.0 - T_left_camera.translation().z()) / d.z() * d;
        out(x, y) = static_cast<std::uint8_t>(wall(p.x(), p.y()) + 0.5);
      }
  return out;
}

/// Points that both cameras see: their pixels, looked up in the remap tables, are on the same row, and their disparity
/// says how far they are. Returns how many there were.
template <class Left, class Right>
int check_rows(const stereo_rig<Left, Right>& rig, const rectification& r) {
  const pinhole& k = r.camera();
  // The place in a rectified image whose source is `pixel`, found by Newton's steps in the table.
  const auto place_of = [](const undistortion& map, const vec2& pixel, vec2 start) -> std::optional<vec2> {
    const auto source = [&](const vec2& at) -> std::optional<vec2> {
      const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
      if (x < 0 || y < 0 || x + 1 >= map.width() || y + 1 >= map.height()) return std::nullopt;
      const double u = at.x() - x, v = at.y() - y;
      const auto s = [&](int dx, int dy) { return vec2(map.source(x + dx, y + dy).template cast<double>()); };
      return vec2((1 - v) * ((1 - u) * s(0, 0) + u * s(1, 0)) + v * ((1 - u) * s(0, 1) + u * s(1, 1)));
    };
    for (int step = 0; step != 30; ++step) {
      const auto at = source(start), dx = source(start + vec2(1, 0)), dy = source(start + vec2(0, 1));
      if (!at || !dx || !dy) return std::nullopt;
      matrix<2, 2> j;
      j << *dx - *at, *dy - *at;
      const vec2 move = j.inverse() * (pixel - *at);
      start += move;
      if (move.norm() < 1e-4) return start;
    }
    return std::nullopt;
  };
  random_bits random{3};
  int seen = 0;
  for (int i = 0; i != 400; ++i) {
    const double z = random.uniform(1.0, 12.0);
    const vec3 p{random.uniform(-0.6, 0.6) * z, random.uniform(-0.4, 0.4) * z, z};
    const auto left = rig.left.project(p), right = rig.right.project(rig.T_left_right.inverse() * p);
    if (!left || !right) continue;
    const vec3 in_rectified = r.R_left_rectified().inverse() * p;
    const auto expected = k.project(in_rectified);
    if (!expected) continue;
    const auto a = place_of(r.left(), *left, *expected), b = place_of(r.right(), *right, *expected);
    if (!a || !b) continue;
    ++seen;
    CHECK(std::abs(a->y() - b->y()) < 0.05);
    CHECK(std::abs(a->x() - b->x() - k.k().fx * r.baseline() / in_rectified.z()) < 0.05);
    CHECK((*a - *expected).norm() < 0.05);
  }
  return seen;
}

}  // namespace

TEST_CASE("points lie on the same row of both rectified images, whatever the cameras") {
  const intrinsics a{640, 480, 458.0, 457.0, 367.0 - 50, 248.0}, b{640, 480, 457.0, 456.0, 379.0 - 50, 255.0};
  SECTION("pinhole") {
    const stereo_rig rig{pinhole{a}, pinhole{b}, turned};
    CHECK(check_rows(rig, rectify(rig).value()) > 100);
  }
  SECTION("radial-tangential") {
    const stereo_rig rig{radial_tangential{a, {-0.283, 0.074, 0.0002, 1.8e-5}},
                         radial_tangential{b, {-0.286, 0.075, -0.0001, -3.6e-5}}, turned};
    CHECK(check_rows(rig, rectify(rig).value()) > 100);
  }
  SECTION("Kannala-Brandt") {
    const intrinsics wide{512, 512, 190.0, 190.0, 254.0, 256.0};
    const stereo_rig rig{kannala_brandt{wide, {0.0034, 0.0007, -0.002, 0.0002}},
                         kannala_brandt{wide, {0.0032, 0.0017, -0.003, 0.0006}}, turned};
    CHECK(check_rows(rig, rectify(rig).value()) > 100);
  }
  SECTION("one of each, of different sizes, as values") {
    const stereo_rig rig{any_camera{radial_tangential{a, {-0.283, 0.074, 0.0002, 1.8e-5}}},
                         any_camera{kannala_brandt{{512, 400, 300.0, 301.0, 254.0, 201.0}, {0.003, 0.0, 0.0, 0.0}}},
                         turned};
    CHECK(check_rows(rig, rectify(rig).value()) > 100);
  }
}

TEST_CASE("rectified images of a wall are shifted against each other by its disparity") {
  // Without a turn of the right camera and with a baseline along x the wall stays at one depth.
  const intrinsics k{320, 240, 230.0, 229.0, 155.0, 122.0};
  const stereo_rig rig{radial_tangential{k, {-0.28, 0.07, 0.0002, 1e-5}}, radial_tangential{k, {-0.25, 0.05}},
                       se3{so3::exp(vec3{0.03, -0.02, 0.01}), vec3{0.12, 0.0, 0.0}}};
  const rectification r = rectify(rig).value();
  const auto left = r.left().bilinear(picture(rig.left, se3{}).view());
  const auto right = r.right().bilinear(picture(rig.right, rig.T_left_right).view());
  CHECK(left.width() == 320);
  CHECK(left.height() == 240);
  // Each pixel of the left image: where its ray meets the wall, and what the right image has there.
  double sum = 0.0;
  int count = 0;
  for (int y = 5; y != 235; ++y)
    for (int x = 5; x != 315; ++x) {
      const vec3 d = r.R_left_rectified() * *r.camera().unproject({x, y});
      const double depth = 3.0 / d.z();  // along the rectified axis
      const double u = x - r.camera().k().fx * r.baseline() / depth;
      const int u0 = static_cast<int>(std::floor(u));
      if (u0 < 0 || right(u0, y) == 0 || right(u0 + 1, y) == 0 || left(x, y) == 0) continue;
      const double seen = (1 - (u - u0)) * right(u0, y) + (u - u0) * right(u0 + 1, y);
      sum += std::abs(seen - left(x, y));
      ++count;
    }
  CHECK(count > 50000);
  CHECK(sum / count < 1.5);
}

TEST_CASE("the default focal length leaves no pixel without a source where a little more does that") {
  const intrinsics k{640, 480, 458.0, 457.0, 317.0, 248.0};
  const stereo_rig rig{radial_tangential{k, {-0.283, 0.074, 0.0002, 1.8e-5}},
                       radial_tangential{k, {-0.286, 0.075, -0.0001, -3.6e-5}}, turned};
  const auto missing = [](const rectification& r) {
    int n = 0;
    for (int y = 0; y != r.camera().height(); ++y)
      for (int x = 0; x != r.camera().width(); ++x)
        for (const undistortion* map : {&r.left(), &r.right()}) {
          const vec2f s = map->source(x, y);
          n += !(s.x() >= 0.0F && s.y() >= 0.0F && s.x() <= 639.0F && s.y() <= 479.0F);
        }
    return n;
  };
  const rectification r = rectify(rig).value();
  CHECK(missing(r) == 0);
  CHECK(r.camera().k().fx < 1.3 * 457.0);
  const rectification wide = rectify(rig, {.width = 320, .height = 200, .focal = 150.0}).value();
  CHECK(missing(wide) > 0);
  CHECK(wide.camera().width() == 320);
  CHECK(wide.camera().height() == 200);
  CHECK(wide.camera().k().fx == 150.0);
}

TEST_CASE("rigs that are rectified already stay as they are") {
  const pinhole k{1226, 370, 707.0912, 707.0912, 601.8873, 183.1104};
  const rectification r = rectify(stereo_rig{k, k, se3{so3{}, vec3{0.5371507, 0.0, 0.0}}}).value();
  CHECK(r.is_identity());
  CHECK(r.camera() == k);
  CHECK(r.baseline() == 0.5371507);
  CHECK(r.R_left_rectified().angle() == 0.0);
  CHECK(rectify(stereo_rig<any_camera>{k, k, se3{so3{}, vec3{0.5, 0.0, 0.0}}}).value().is_identity());
  const auto is_not = [&](const any_camera& left, const any_camera& right, const se3& T) {
    return !rectify(stereo_rig<any_camera>{left, right, T}).value().is_identity();
  };
  const se3 beside{so3{}, vec3{0.5, 0.0, 0.0}};
  CHECK(is_not(k, pinhole{1226, 370, 707.0912, 707.0912, 602.8873, 183.1104}, beside));
  CHECK(is_not(k, radial_tangential{k.k(), {0.01, 0.0, 0.0, 0.0}}, beside));
  CHECK(is_not(k, k, se3{so3{}, vec3{0.5, 0.001, 0.0}}));
  CHECK(is_not(k, k, se3{so3::exp(vec3{0.0, 0.001, 0.0}), vec3{0.5, 0.0, 0.0}}));
}

TEST_CASE("cameras that do not stand side by side are refused") {
  const pinhole k{640, 480, 500.0, 500.0, 320.0, 240.0};
  const auto code = [&](const se3& T) {
    const auto r = rectify(stereo_rig{k, k, T});
    return r ? std::optional<errc>{} : r.error().code;
  };
  CHECK(code(se3{so3{}, vec3{-0.1, 0.0, 0.0}}) == errc::invalid_argument);  // exchanged
  CHECK(code(se3{so3{}, vec3{0.0, 0.1, 0.0}}) == errc::invalid_argument);   // one above the other
  CHECK(code(se3{so3{}, vec3{0.0, 0.0, 0.1}}) == errc::invalid_argument);
  CHECK(code(se3{}) == errc::invalid_argument);
  CHECK(code(se3{so3::exp(vec3{0.0, 2.0, 0.0}), vec3{0.1, 0.0, 0.0}}) == errc::invalid_argument);  // look apart
  CHECK(code(se3{so3::exp(vec3{0.0, 0.0, 3.1}), vec3{0.1, 0.0, 0.0}}) == errc::invalid_argument);  // upside down
  CHECK(!code(se3{so3::exp(vec3{0.0, 0.3, 0.0}), vec3{0.1, 0.0, 0.0}}));
}

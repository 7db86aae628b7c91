// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/mapping/upright.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"

namespace {

using namespace orbis;
using mapping::find_upright;
using mapping::upright_options;
using mapping::upright_source;
using mapping::upright_view;

constexpr double degree = std::numbers::pi / 180.0;

double angle(const vec3& a, const vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

const camera::pinhole& small_camera() {
  static const camera::pinhole camera{{.width = 320, .height = 240, .fx = 260, .fy = 260, .cx = 159.5, .cy = 119.5}};
  return camera;
}

/// What a camera `height` metres above a floor sees of it, and of the walls x = 3 and y = 2 where they are there.
image<float> room(const so3& R_world_camera, double height, bool floor, bool wall_x, bool wall_y) {
  const camera::pinhole& camera = small_camera();
  image<float> out(camera.width(), camera.height());
  for (int y = 0; y != out.height(); ++y)
    for (int x = 0; x != out.width(); ++x) {
      const vec3 ray = R_world_camera * *camera.unproject({x, y});
      double z = std::numeric_limits<double>::infinity();
      if (floor && ray.z() < 0) z = std::min(z, -height / ray.z());
      if (wall_x && ray.x() > 0) z = std::min(z, 3.0 / ray.x());
      if (wall_y && ray.y() > 0) z = std::min(z, 2.0 / ray.y());
      out(x, y) = z < 8.0 ? static_cast<float>(z) : 0.0F;
    }
  return out;
}

/// A camera that looks along world x, turned to the left, then down, then rolled, in radians.
so3 looking(double left, double down, double roll) {
  mat3 level;  // columns: the camera's right, down and forward in the world
  level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return so3::exp(vec3(0, 0, left)) * so3::exp(vec3(0, down, 0)) * so3{level} * so3::exp(vec3(0, 0, roll));
}

upright_view look_at(const image<float>& depth, const upright_options& options = {}) {
  return find_upright(camera::depth_view<float>(depth.view()), camera::ray_table{small_camera()}, options);
}

TEST_CASE("an upright rotation has z up and the view along x") {
  for (const double down : {-1.2, -0.3, 0.0, 0.5, 1.3})
    for (const double roll : {-0.7, 0.0, 0.2}) {
      const so3 truth = looking(0.4, down, roll);
      const vec3 up = truth.inverse() * vec3::UnitZ();
      const so3 R = mapping::upright_rotation(up);
      CHECK(angle(R * up, vec3::UnitZ()) < 1e-7);
      const vec3 ahead = R * vec3::UnitZ();
      CHECK(std::abs(ahead.y()) < 1e-9);
      CHECK(ahead.x() > 0);
    }
  for (const double sign : {-1.0, 1.0}) {  // straight up, straight down
    const vec3 up(0, 0, sign);
    const so3 R = mapping::upright_rotation(up);
    CHECK(angle(R * up, vec3::UnitZ()) < 1e-7);
    CHECK(angle(R * vec3(0, sign, 0), vec3::UnitX()) < 1e-7);
  }
}

TEST_CASE("gravity decides where it is known") {
  const image<float> depth = room(looking(0, 0.3, 0), 1.4, true, true, true);
  const upright_view view = look_at(depth, {.gravity_camera = vec3(0.3, 9.0, -2.0)});
  CHECK(view.source == upright_source::gravity);
  CHECK(view.confidence == 1.0);
  CHECK(angle(view.up_camera(), vec3(-0.3, -9.0, 2.0)) < 1e-7);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const vec3& none : {vec3(0, 0, 0), vec3(0, nan, 0)})
    CHECK(look_at(depth, {.gravity_camera = none}).source == upright_source::floor);
}

TEST_CASE("up is found from a floor, with and without walls, however the camera is held") {
  for (const bool walls : {false, true})
    for (const double left : {0.0, 0.6})
      for (const double down : {0.25, 0.6})
        for (const double roll : {-0.3, 0.0, 0.2}) {
          INFO("walls " << walls << " left " << left << " down " << down << " roll " << roll);
          const so3 truth = looking(left, down, roll);
          const upright_view view = look_at(room(truth, 1.4, true, walls, walls));
          CHECK(view.source == upright_source::floor);
          CHECK(view.confidence > 0.1);
          CHECK(angle(truth * view.up_camera(), vec3::UnitZ()) < 0.2 * degree);
        }
}

TEST_CASE("up is found from two walls") {
  for (const double down : {-0.3, 0.0, 0.2})
    for (const double roll : {0.0, 0.25}) {
      INFO("down " << down << " roll " << roll);
      const so3 truth = looking(0.6, down, roll);
      const upright_view view = look_at(room(truth, 1.4, false, true, true));
      CHECK(view.source == upright_source::walls);
      CHECK(view.confidence > 0.1);
      CHECK(angle(truth * view.up_camera(), vec3::UnitZ()) < 0.2 * degree);
    }
}

TEST_CASE("the camera is taken to be level where nothing says otherwise") {
  const auto is_assumed = [](const upright_view& view) {
    return view.source == upright_source::assumed && view.confidence == 0.0 &&
           angle(view.up_camera(), -vec3::UnitY()) < 1e-7;
  };
  CHECK(is_assumed(look_at(image<float>(320, 240))));
  CHECK(is_assumed(look_at(room(looking(0, 0.2, 0.1), 1.4, false, true, false))));  // one wall
  image<float> rough(320, 240);
  for (int y = 0; y != 240; ++y)
    for (int x = 0; x != 320; ++x)
      rough(x, y) = 1.0F + 0.3F * static_cast<float>((x * 7919 + y * 104729) % 101) / 101.0F;
  CHECK(is_assumed(look_at(rough)));
  image<float> bad(320, 240, std::numeric_limits<float>::quiet_NaN());
  CHECK(is_assumed(look_at(bad)));
  const image<float> tiny(3, 2, 1.0F);
  CHECK(is_assumed(find_upright(camera::depth_view<float>(tiny.view()),
                                camera::ray_table{camera::pinhole{{.width = 3, .height = 2, .fx = 3, .fy = 3}}})));
}

TEST_CASE("a tilt beyond the limit is not found") {
  const so3 truth = looking(0, 0.6, 0);
  const image<float> depth = room(truth, 1.4, true, false, false);
  CHECK(look_at(depth).source == upright_source::floor);
  CHECK(look_at(depth, {.max_tilt = 0.2}).source == upright_source::assumed);
  CHECK(look_at(depth, {.min_support = 1.01}).source == upright_source::assumed);
}

TEST_CASE("a simulated room stands upright within a degree") {
  const io::synthetic_recording recording{io::synthetic_options{.frames = 360, .width = 320, .height = 240}};
  const camera::ray_table rays{recording.camera().model};
  std::size_t found = 0, asked = 0;
  for (std::size_t i = 0; i < recording.size(); i += 45) {
    const camera::rgbd_frame frame = recording.frame(i).value();
    const upright_view view = find_upright(frame.depth_metres(), rays);
    ++asked;
    if (view.source == upright_source::assumed) continue;
    ++found;
    INFO(i << " " << to_string(view.source) << " " << view.confidence);
    CHECK(angle(frame.T_world_camera->rotation() * view.up_camera(), vec3::UnitZ()) < 1.0 * degree);
  }
  CHECK(4 * found >= 3 * asked);
}

/// Up in the world of a recording's ground truth, as found in some of its frames, and how far each is from their mean,
/// in radians; the first one is that of the first frame.
std::vector<double> disagreement(const char* name) {
  const io::recording recording = io::open_recording(test::data_dir() / name).value();
  const camera::ray_table rays{recording.camera().model};
  std::vector<vec3> ups;
  vec3 mean = vec3::Zero();
  for (std::size_t i = 0; i < recording.size(); i += std::max<std::size_t>(1, recording.size() / 8)) {
    const camera::rgbd_frame frame = recording.frame(i).value();
    const upright_view view = find_upright(frame.depth_metres(), rays);
    INFO(name << " " << i << " " << to_string(view.source) << " " << view.confidence);
    CHECK(view.source != upright_source::assumed);
    ups.push_back(frame.T_world_camera->rotation() * view.up_camera());
    mean += ups.back();
  }
  std::vector<double> off;
  for (const vec3& up : ups) off.push_back(angle(up, mean));
  return off;
}

TEST_CASE("frames of a real recording agree on where up is") {
  ORBIS_NEEDS_DATA("kitchen");
  std::vector<double> off = disagreement("kitchen");
  CHECK(off.front() < 2.0 * degree);
  std::sort(off.begin(), off.end());
  CHECK(off[off.size() / 2] < 1.5 * degree);
  CHECK(off.back() < 4.0 * degree);
}

TEST_CASE("frames of a rendered living room agree on where up is within a degree") {
  ORBIS_NEEDS_DATA("livingroom");
  for (const double off : disagreement("livingroom")) CHECK(off < 1.0 * degree);
}

}  // namespace

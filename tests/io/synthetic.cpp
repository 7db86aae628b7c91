// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iterator>

#include <orbis/core/random.hpp>
#include <orbis/io/detail/synthetic/scene.hpp>
#include <orbis/io/detail/synthetic/sensor.hpp>
#include <orbis/io/synthetic.hpp>

#include "support/catch.hpp"

using namespace orbis;
using io::synthetic_recording;

static_assert(std::input_iterator<synthetic_recording::iterator>);

namespace {

std::uint64_t checksum(const camera::rgbd_frame& f) {
  std::uint64_t h = 0;
  for (const rgb8 c : f.color.pixels()) h = mix64(h ^ (c.r + 256U * c.g + 65536U * c.b));
  for (const std::uint16_t d : f.depth.pixels()) h = mix64(h ^ d);
  return h;
}

const synthetic_recording& small() {
  static const synthetic_recording recording{{.frames = 40, .seed = 1, .width = 160, .height = 120}};
  return recording;
}

}  // namespace

TEST_CASE("exact depth can be had from any pose: that of a frame is the frame's, and nothing is seen from outside") {
  const synthetic_recording& room = small();
  const auto model = room.camera().model;
  for (const std::size_t i : {0U, 17U}) {
    const auto frame = room.exact(seq, i).value().depth;
    const auto depth = room.exact_depth(par, model, room.T_world_camera(i));
    REQUIRE((depth.width() == 160 && depth.height() == 120));
    std::size_t different = 0;
    for (int y = 0; y != 120; ++y)
      for (int x = 0; x != 160; ++x) different += std::abs(depth(x, y) - frame(x, y)) > 1e-5F ? 1 : 0;
    CHECK(different < 20);  // at edges, the last bit of the pose decides
  }
  const auto outside = room.exact_depth(seq, model, se3{so3{}, vec3{0.0, 0.0, 50.0}});
  for (const float d : outside.pixels()) REQUIRE(d == 0.0F);
}

TEST_CASE("the renderer sees what single rays through the whole scene see") {
  const synthetic_recording& room = small();
  const auto model = room.camera().model;
  for (std::size_t i = 0; i < room.size(); i += 7) {
    const auto exact = room.exact(seq, i).value();
    const se3 T = room.T_world_camera(i);
    for (int y = 0; y != 120; y += 2)
      for (int x = 0; x != 160; x += 2) {
        const vec3 ray = model.unproject(vec2(x, y)).value();
        const auto t = room.scene().cast(T.translation(), T.rotation() * ray);
        REQUIRE(t);
        CHECK(static_cast<double>(exact.depth(x, y)) == Approx(*t).epsilon(1e-6));
      }
  }
}

TEST_CASE("frames are the same bytes for every policy and in every order") {
  const synthetic_recording again{small().options()};
  const auto last = checksum(again.frame(39).value());
  const auto first = checksum(again.frame(0).value());
  CHECK(first == checksum(small().render(seq, 0).value()));
  CHECK(first == checksum(small().render(par.with(3), 0).value()));
  CHECK(last == checksum(small().render(par.with(7), 39).value()));
  CHECK(first != last);
}

TEST_CASE("pictures are the same on every machine") {
  // Taken once; holds for g++ and clang at every optimisation level and instruction set.
  CHECK(checksum(small().frame(3).value()) == 0xf47c94eceeb12cd0ULL);
  const synthetic_recording other{
      {.frames = 30, .seed = 2, .width = 96, .height = 64, .scene = {.person = true}, .sensor = {.motion_blur = 2}}};
  CHECK(checksum(other.frame(20).value()) == 0xfb50fb84dec3c364ULL);
}

TEST_CASE("another seed gives another recording") {
  auto options = small().options();
  options.seed = 2;
  const synthetic_recording other{options};
  CHECK(checksum(other.frame(0).value()) != checksum(small().frame(0).value()));
  CHECK(other.scene().size() != small().scene().size());
}

TEST_CASE("frames carry time and pose and the camera's scale") {
  const synthetic_recording& room = small();
  CHECK(room.size() == 40);
  const auto truth = room.ground_truth();
  REQUIRE(truth.size() == 40);
  const camera::rgbd_frame f = room.frame(30).value();
  CHECK(f.timestamp == Approx(1.0));
  CHECK(f.timestamp == room.timestamp(30));
  CHECK(truth[30].timestamp == f.timestamp);
  REQUIRE(f.T_world_camera);
  CHECK((truth[30].T_world_camera.inverse() * *f.T_world_camera).log().norm() < 1e-12);
  CHECK(f.depth_scale == room.camera().depth_scale);
  CHECK(f.color.width() == room.camera().model.width());
  CHECK(f.depth.height() == room.camera().model.height());
  CHECK(room.camera().model.k().fx == Approx(525.0 / 4.0));
}

TEST_CASE("a frame that does not exist is an error and no crash") {
  CHECK(small().frame(40).error().code == errc::invalid_argument);
  CHECK(small().exact(seq, 99).error().code == errc::invalid_argument);
  const synthetic_recording none{{.frames = 0, .width = 16, .height = 16}};
  CHECK(none.empty());
  CHECK(none.begin() == none.end());
}

TEST_CASE("iteration gives every frame once") {
  const synthetic_recording few{{.frames = 4, .width = 33, .height = 17}};
  std::size_t i = 0;
  for (const camera::rgbd_frame& f : few) {
    CHECK(checksum(f) == checksum(few.frame(i).value()));
    ++i;
  }
  CHECK(i == 4);
}

TEST_CASE("a short clip of a long path is walked slowly") {
  const synthetic_recording clip{{.frames = 10, .width = 32, .height = 24, .frames_around = 400}};
  const synthetic_recording whole{{.frames = 400, .width = 32, .height = 24}};
  CHECK((clip.T_world_camera(9).inverse() * whole.T_world_camera(9)).log().norm() < 1e-12);
}

TEST_CASE("every part of nearly every picture has edges") {
  int poor_frames = 0;
  for (std::size_t i = 0; i != small().size(); ++i) {
    const auto picture = small().exact(par, i).value();
    std::array<int, 12> edges{};  // in 4 x 3 parts
    for (int y = 1; y != 120; ++y)
      for (int x = 1; x != 160; ++x) {
        const int across = std::abs(picture.color(x, y).g - picture.color(x - 1, y).g);
        const int down = std::abs(picture.color(x, y).g - picture.color(x, y - 1).g);
        if (across > 20 || down > 20) ++edges[static_cast<std::size_t>(y / 40 * 4 + x / 40)];
      }
    int rich = 0;
    for (const int e : edges) rich += e > 60 ? 1 : 0;
    if (rich < 7) ++poor_frames;
  }
  CHECK(poor_frames <= 4);
}

TEST_CASE("motion blur averages the pictures of the exposure time") {
  auto options = small().options();
  options.sensor = io::synthetic_sensor_options::ideal();
  options.sensor.motion_blur = 4;
  options.sensor.exposure = 0.0;
  const synthetic_recording still{options};
  options.sensor.exposure = 0.1;
  const synthetic_recording moving{options};
  const auto sharp = small().exact(seq, 20).value();
  CHECK(still.frame(20).value().color == sharp.color);
  const auto roughness = [](const image<rgb8>& c) {
    double sum = 0;
    for (int y = 0; y != c.height(); ++y)
      for (int x = 1; x != c.width(); ++x) sum += std::abs(c(x, y).g - c(x - 1, y).g);
    return sum;
  };
  CHECK(roughness(moving.frame(20).value().color) < 0.8 * roughness(sharp.color));
}

TEST_CASE("The integration time of a depth image smears edges along the motion, and keeps planes") {
  auto options = small().options();
  options.sensor = io::synthetic_sensor_options::ideal();
  const synthetic_recording sharp{options};
  constexpr std::size_t at = 25;
  options.sensor.depth_blur = 8;
  options.sensor.depth_exposure = 0.0;
  CHECK(synthetic_recording{options}.frame(at).value().depth == sharp.frame(at).value().depth);
  options.sensor.depth_exposure = 0.01;  // about six pixels of motion
  const synthetic_recording smeared{options};
  const camera::rgbd_frame frame = smeared.frame(at).value();
  const auto blurred = frame.depth_metres();
  CHECK(frame.color == sharp.frame(at).value().color);
  const auto exact = sharp.exact(seq, at).value().depth;
  int plane = 0, edge = 0, between = 0;
  for (int y = 4; y != 116; ++y)
    for (int x = 10; x != 150; ++x) {
      // Planes have linear disparities.
      double bend = 0.0;
      float nearest = exact(x, y), farthest = nearest;
      for (int v = y - 4; v <= y + 4; ++v)
        for (int u = x - 9; u <= x + 9; ++u) {
          const auto disparity = [&](int du) { return 1.0 / static_cast<double>(exact(u + du, v)); };
          bend = std::max(bend, std::abs(disparity(-1) - 2.0 * disparity(0) + disparity(1)));
          nearest = std::min(nearest, exact(u, v));
          farthest = std::max(farthest, exact(u, v));
        }
      const double z = static_cast<double>(exact(x, y)), seen = static_cast<double>(blurred(x, y));
      if (bend < 1e-5) {
        ++plane;
        CHECK(std::abs(seen - z) < 0.002 * z);
      }
      if (std::abs(exact(x + 1, y) - exact(x, y)) < 0.2F) continue;
      ++edge;
      CHECK(seen > static_cast<double>(nearest) - 0.02);
      CHECK(seen < static_cast<double>(farthest) + 0.02);
      const double other = static_cast<double>(exact(x + 1, y));
      between += std::min(std::abs(seen - z), std::abs(seen - other)) > 0.04 ? 1 : 0;
    }
  CHECK(plane > 2000);
  REQUIRE(edge > 50);
  CHECK(between > edge / 2);
}

TEST_CASE("In a darker room the exposure is longer, and then the noise is stronger") {
  auto options = small().options();
  options.sensor.motion_blur = 3;
  options.sensor.exposure = 0.02;
  const auto bright = synthetic_recording{options}.frame(20).value();
  options.scene.light = 0.5;
  options.sensor.exposure = 0.01;
  CHECK(synthetic_recording{options}.frame(20).value().color == bright.color);
  using io::detail::synthetic::exposed;
  const io::synthetic_sensor_options dark = exposed({.exposure = 0.02, .max_exposure = 0.03}, 0.2);
  CHECK(dark.exposure == 0.03);
  CHECK(dark.colour_noise == Approx(2.0 * std::sqrt(0.1 / 0.03)));
  CHECK(exposed({.exposure = 0.02}, 2.0).exposure == 0.01);
  CHECK(exposed({.exposure = 0.05, .max_exposure = 0.03}, 1.0).exposure == 0.05);
}

TEST_CASE("depths are mostly those of a room") {
  double valid = 0, near = 0, all = 0;
  for (const camera::rgbd_frame& f : small()) {
    const auto metres = f.depth_metres();
    for (int y = 0; y != metres.height(); ++y)
      for (int x = 0; x != metres.width(); ++x) {
        const float z = metres(x, y);
        all += 1;
        valid += z > 0.0F ? 1 : 0;
        near += z > 0.8F && z < 4.0F ? 1 : 0;
      }
  }
  CHECK(valid / all > 0.9);
  CHECK(valid / all < 0.999);
  CHECK(near / all > 0.85);
}

TEST_CASE("Each row of a rolling shutter shows what is there to see at its time") {
  io::synthetic_options o{.frames = 102, .seed = 4, .width = 160, .height = 120, .frames_around = 400};
  o.sensor = io::synthetic_sensor_options::ideal();
  o.path.jitter = 5.0;
  const synthetic_recording global{o};
  o.sensor.shutter = {.color_read_out = 0.03, .depth_read_out = 0.02, .depth_delay = 0.01};
  const synthetic_recording rolling{o};
  const camera::rgbd_frame f = rolling.frame(100).value();
  CHECK((f.T_world_camera->translation() - global.T_world_camera(100).translation()).norm() == 0.0);
  const double depth_unit = 1.0 / o.depth_scale;
  const auto model = rolling.camera().model;
  const auto motion = [&](std::size_t i) {  // per second, around frame i
    return vec6((global.T_world_camera(i - 1).inverse() * global.T_world_camera(i + 1)).log() * (0.5 * o.fps));
  };
  // The middle of the depth image is 10 ms late: the camera is there then, and a row's time after that.
  std::size_t closer = 0, all = 0;
  const auto distance = [&](int x, int y, double time) {
    const se3 T_world_row = *f.T_world_camera * se3::exp(time * motion(100));
    return global.surface_distance(T_world_row * vec3(f.depth(x, y) * depth_unit * *model.unproject(vec2(x, y))));
  };
  for (int y = 0; y < 120; y += 7)
    for (int x = 0; x < 160; x += 7) {
      const double in_time = distance(x, y, rolling.options().sensor.shutter.depth_time(y, 120));
      CHECK(in_time < 0.002);
      closer += in_time < distance(x, y, 0.0) - depth_unit;
      ++all;
    }
  CHECK(closer > all / 2);
  // Rows in the middle of the colour image are those of the global shutter, and the first ones are not.
  const image<rgb8> color = global.frame(100).value().color;
  const auto differs = [&](int y) {
    int sum = 0;
    for (int x = 0; x != 160; ++x) sum += std::abs(color(x, y).g - f.color(x, y).g);
    return sum;
  };
  CHECK(differs(59) + differs(60) < 320);
  CHECK(differs(0) + differs(119) > 4 * (differs(59) + differs(60)));
}

TEST_CASE("The right image of a stereo pair shows each point where its depth says") {
  const synthetic_recording room{
      {.frames = 12, .seed = 4, .width = 320, .height = 240, .sensor = io::synthetic_sensor_options::ideal()}};
  const auto settings = room.stereo_camera();
  REQUIRE(settings.baseline);
  const double bf = settings.model.k().fx * *settings.baseline;
  for (const std::size_t i : {0U, 7U}) {
    const camera::stereo_frame pair = room.stereo_frame(i).value();
    CHECK(pair.timestamp == room.timestamp(i));
    CHECK(pair.left == room.frame(i).value().color);
    CHECK(pair.T_world_camera->translation() == room.T_world_camera(i).translation());
    const auto exact = room.exact(seq, i).value();
    int same = 0, all = 0;
    for (int y = 0; y != 240; ++y)
      for (int x = 0; x != 320; ++x) {
        const double u = x - bf / static_cast<double>(exact.depth(x, y));
        const int u0 = static_cast<int>(std::floor(u));
        if (u0 < 0) continue;
        const double right = (1.0 - (u - u0)) * pair.right(u0, y).g + (u - u0) * pair.right(u0 + 1, y).g;
        same += std::abs(right - pair.left(x, y).g) < 20.0;
        ++all;
      }
    CHECK(same > 0.93 * all);
    CHECK(pair.right != pair.left);
  }
}

TEST_CASE("Stereo pairs are the same for every policy, and their noise is not that of one image") {
  const camera::stereo_frame pair = small().stereo_frame(3).value(), again = small().render_stereo(seq, 3).value();
  CHECK(pair.left == again.left);
  CHECK(pair.right == again.right);
  CHECK(pair.left == small().frame(3).value().color);
  synthetic_recording twice{{.frames = 2, .width = 160, .height = 120, .sensor = {.stereo_baseline = 0.0}}};
  const camera::stereo_frame from_one_place = twice.stereo_frame(0).value();
  CHECK(from_one_place.left != from_one_place.right);
  const auto none = small().stereo_frame(40);
  REQUIRE(!none);
  CHECK(none.error().code == errc::invalid_argument);
}

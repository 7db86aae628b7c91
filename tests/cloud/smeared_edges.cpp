// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <random>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/cloud/smeared_edges.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/synthetic.hpp>

#include "support/catch.hpp"

namespace {

using orbis::image;
using orbis::vec6;
using orbis::camera::depth_view;
using orbis::cloud::remove_smeared_edges;

constexpr int width = 100, height = 70;
const orbis::camera::pinhole camera{width, height, 200.0, 200.0, 49.5, 34.5};

/// A turn that moves the centre of the image by (u, v) pixels in one second.
vec6 turn(double u, double v) {
  vec6 twist = orbis::zeros<vec6>();
  twist[3] = -v / 200.0;
  twist[4] = u / 200.0;
  return twist;
}

/// Mean of the inverse depths while the image moves by (u, v) pixels, as depth.
image<float> smeared(const std::function<double(double, double)>& inverse, double u, double v) {
  constexpr int steps = 16;
  image<float> depth(width, height);
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x) {
      double sum = 0.0;
      for (int i = 0; i != steps; ++i) {
        const double t = (i + 0.5) / steps - 0.5;
        sum += inverse(x - t * u, y - t * v);
      }
      depth(x, y) = static_cast<float>(steps / sum);
    }
  return depth;
}

}  // namespace

TEST_CASE("the ramp that a motion makes of an edge is removed, and nothing else", "[smeared_edges]") {
  for (const double degrees : {0.0, 20.0, 45.0, 70.0, 90.0})
    for (const double motion : {4.0, 8.0, 16.0}) {
      const double angle = degrees * 0.017453292519943295, c = std::cos(angle), s = std::sin(angle);
      const auto across = [&](double x, double y) { return c * (x - 49.5) + s * (y - 34.5); };
      const auto inverse = [&](double x, double y) { return (across(x, y) > 0.0 ? 0.6 : 0.5) + 0.0004 * (x - y); };
      const image<float> depth = smeared(inverse, c * motion, s * motion);
      image<float> out(width, height);
      const std::size_t removed =
          remove_smeared_edges(orbis::seq, depth_view{depth.view()}, camera, turn(c * motion, s * motion), 1.0, out);
      std::size_t zeros = 0, ramp = 0, of_ramp = 0, far = 0;
      for (int y = 20; y != height - 20; ++y)
        for (int x = 20; x != width - 20; ++x) {
          const double error = std::abs(1.0 / static_cast<double>(depth(x, y)) - inverse(x, y));
          const bool is_ramp = error > 0.012;  // 4 cm
          ramp += is_ramp ? 1 : 0;
          of_ramp += is_ramp && out(x, y) == 0.0F ? 1 : 0;
          far += out(x, y) == 0.0F && std::abs(across(x, y)) > motion + 2.0 ? 1 : 0;
        }
      for (int y = 0; y != height; ++y)
        for (int x = 0; x != width; ++x) {
          zeros += out(x, y) == 0.0F ? 1 : 0;
          CHECK((out(x, y) == 0.0F || out(x, y) == depth(x, y)));
        }
      CAPTURE(degrees, motion, ramp, of_ramp);
      CHECK(removed == zeros);
      CHECK(ramp > 50);
      CHECK(static_cast<double>(of_ramp) > 0.95 * static_cast<double>(ramp));
      CHECK(far == 0);
    }
}

TEST_CASE("surfaces of any slant and their creases stay, also with noise", "[smeared_edges]") {
  std::mt19937 random{7};
  std::normal_distribution<double> noise{0.0, 1.425e-3};
  for (const double slant : {0.0, 0.002, 0.004})
    for (const double crease : {-0.003, 0.0, 0.003}) {
      const auto inverse = [&](double x, double y) {
        return 0.9 + slant * (x - 49.5) - 0.3 * slant * y + crease * std::abs(x - 49.5);
      };
      const image<float> exact = smeared(inverse, 10.0, 5.0);
      image<float> noisy(width, height), out(width, height);
      for (int y = 0; y != height; ++y)
        for (int x = 0; x != width; ++x)
          noisy(x, y) = static_cast<float>(1.0 / (1.0 / static_cast<double>(exact(x, y)) + noise(random)));
      CAPTURE(slant, crease);
      CHECK(remove_smeared_edges(orbis::seq, depth_view{exact.view()}, camera, turn(10.0, 5.0), 1.0, out) == 0);
      CHECK(std::ranges::equal(out.pixels(), exact.pixels()));
      CHECK(remove_smeared_edges(orbis::seq, depth_view{noisy.view()}, camera, turn(10.0, 5.0), 1.0, out) <
            width * height / 50);
    }
}

TEST_CASE("a camera that hardly moves smears no edge; translation smears near ones", "[smeared_edges]") {
  image<float> depth = smeared([](double x, double) { return x > 49.5 ? 1.0 : 0.5; }, 8.0, 0.0), out(width, height);
  const depth_view view{depth.view()};
  CHECK(remove_smeared_edges(orbis::seq, view, camera, orbis::zeros<vec6>(), 1.0, out) == 0);
  CHECK(remove_smeared_edges(orbis::seq, view, camera, turn(8.0, 8.0), 0.1, out) == 0);  // shorter than two pixels
  vec6 twist = orbis::zeros<vec6>();
  twist[0] = 0.04;  // eight pixels at one metre
  CHECK(remove_smeared_edges(orbis::seq, view, camera, twist, 1.0, out) > std::size_t{6 * height});
  twist[0] = 0.0;
  twist[2] = 0.04;  // along the optical axis
  CHECK(remove_smeared_edges(orbis::seq, view, camera, twist, 1.0, out) == 0);
}

TEST_CASE("missing depth stays missing, and is not counted as removed", "[smeared_edges]") {
  image<float> depth(width, height, 1.5F), out(width, height);
  depth(40, 30) = 0.0F;
  depth(41, 30) = -1.0F;
  depth(42, 30) = std::numeric_limits<float>::infinity();
  depth(43, 30) = std::numeric_limits<float>::quiet_NaN();
  CHECK(remove_smeared_edges(orbis::seq, depth_view{depth.view()}, camera, turn(6.0, 6.0), 1.0, out) == 0);
  CHECK(std::ranges::count(out.pixels(), 0.0F) == 4);
  for (int x = 40; x != 44; ++x) CHECK(out(x, 30) == 0.0F);
}

TEST_CASE("the result is the same for every policy, and in place", "[smeared_edges]") {
  const image<float> depth =
      smeared([](double x, double y) { return std::hypot(x - 50.0, y - 35.0) < 20.0 ? 0.8 : 0.5; }, 7.0, 4.0);
  image<float> expected(width, height);
  const std::size_t removed =
      remove_smeared_edges(orbis::seq, depth_view{depth.view()}, camera, turn(7.0, 4.0), 1.0, expected);
  CHECK(removed > 500);
  orbis::cloud::smeared_edge_workspace workspace;
  for (const unsigned threads : {1U, 2U, 5U}) {
    image<float> out = depth;
    CHECK(remove_smeared_edges(orbis::par.with(threads), depth_view{out.view()}, camera, turn(7.0, 4.0), 1.0, out, {},
                               workspace) == removed);
    CHECK(std::ranges::equal(out.pixels(), expected.pixels()));
  }
}

TEST_CASE("most of the false depths of a turning camera in a synthetic room are removed", "[smeared_edges]") {
  orbis::io::synthetic_options options{.frames = 120, .width = 320, .height = 240};  // 3 degrees per frame
  options.sensor.depth_blur = 6;
  options.sensor.stray_depths = 0.0;
  const orbis::io::synthetic_recording room{options};
  for (const std::size_t f : {30U, 50U, 70U}) {
    const auto frame = room.frame(f).value();
    const auto exact = room.exact(orbis::seq, f).value();
    const orbis::se3 T_before_after = room.T_world_camera(f - 1).inverse() * room.T_world_camera(f + 1);
    const vec6 twist = T_before_after.log() * (0.5 * options.fps);
    const depth_view depth{frame.depth.view(), frame.depth_scale};
    image<float> out(depth.width(), depth.height());
    remove_smeared_edges(orbis::seq, depth, room.camera().model, twist, options.sensor.depth_exposure, out,
                         {.resolution = 1.0 / frame.depth_scale});
    std::size_t wrong = 0, wrong_left = 0, right = 0, right_left = 0;
    for (int y = 0; y != out.height(); ++y)
      for (int x = 0; x != out.width(); ++x) {
        const float z = depth(x, y);
        if (!(z > 0.0F)) continue;
        // Wrong: the depth of no surface within ten pixels.
        float error = std::numeric_limits<float>::max();
        for (int u = std::max(0, x - 10); u <= std::min(out.width() - 1, x + 10); ++u)
          error = std::min(error, std::abs(exact.depth(u, y) - z));
        (error > 0.08F ? wrong : right) += 1;
        if (out(x, y) != 0.0F) (error > 0.08F ? wrong_left : right_left) += 1;
      }
    CAPTURE(f, wrong, wrong_left, right, right_left);
    CHECK(wrong > 200);
    CHECK(static_cast<double>(wrong_left) < 0.3 * static_cast<double>(wrong));
    CHECK(static_cast<double>(right_left) > 0.85 * static_cast<double>(right));
  }
}

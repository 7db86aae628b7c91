// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <random>
#include <utility>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/cloud/smeared_edges.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/synthetic.hpp>

#include "support/allocations.hpp"
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

TEST_CASE("the ramp that a motion makes of an edge is removed", "[smeared_edges]") {
  for (const double degrees : {0.0, 20.0, 45.0, 70.0, 90.0, 110.0, 180.0, 225.0, 300.0})
    for (const double motion : {4.0, 8.0, 16.0}) {
      const double angle = degrees * 0.017453292519943295, c = std::cos(angle), s = std::sin(angle);
      const auto across = [&](double x, double y) { return c * (x - 49.5) + s * (y - 34.5); };
      const auto inverse = [&](double x, double y) { return (across(x, y) > 0.0 ? 0.6 : 0.5) + 0.0004 * (x - y); };
      const image<float> depth = smeared(inverse, c * motion, s * motion);
      image<float> out(width, height);
      const std::size_t removed =
          remove_smeared_edges(orbis::seq, depth_view{depth.view()}, camera, turn(c * motion, s * motion), 1.0, out);
      std::size_t zeros = 0, changed = 0, ramp = 0, of_ramp = 0, far = 0;
      for (int y = 0; y != height; ++y)
        for (int x = 0; x != width; ++x) {
          const bool is_zero = out(x, y) == 0.0F;
          zeros += is_zero ? 1 : 0;
          changed += is_zero || out(x, y) == depth(x, y) ? 0 : 1;
          far += is_zero && std::abs(across(x, y)) > motion + 2.0 ? 1 : 0;
          const bool is_inside = x >= 20 && x < width - 20 && y >= 20 && y < height - 20;
          const double error = std::abs(1.0 / static_cast<double>(depth(x, y)) - inverse(x, y));
          const bool is_ramp = is_inside && error > 0.012;  // 4 cm
          ramp += is_ramp ? 1 : 0;
          of_ramp += is_ramp && is_zero ? 1 : 0;
        }
      CAPTURE(degrees, motion, ramp, of_ramp);
      CHECK(removed == zeros);
      CHECK(changed == 0);
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
            width * height / 50);  // noise exceeds 2.5 deviations in one pixel of eighty; both signs are needed
    }
}

TEST_CASE("a camera that hardly moves smears no edge, and translation smears near ones", "[smeared_edges]") {
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

TEST_CASE("single wrong depths do not change the motion of a block", "[smeared_edges]") {
  const auto edge = [](double x, double) { return x > 49.5 ? 0.5 : 0.4; };
  const image<float> depth = smeared(edge, 4.0, 0.0);
  vec6 twist = orbis::zeros<vec6>();
  twist[0] = 0.04;  // four pixels at two metres; the camera passes depths of 2 cm
  twist[2] = 0.04;
  image<float> out(width, height), dusty = depth;
  for (int y = 0; y < 64; y += 16)
    for (int x = 0; x < 96; x += 16) dusty(x, y) = (x + y) % 32 == 0 ? 0.15F : 0.02F;
  orbis::cloud::smeared_edge_workspace clean, other;
  CHECK(remove_smeared_edges(orbis::seq, depth_view{depth.view()}, camera, twist, 1.0, out, {}, clean) > 3 * height);
  remove_smeared_edges(orbis::seq, depth_view{dusty.view()}, camera, twist, 1.0, out, {}, other);
  REQUIRE(clean.blocks.size() == other.blocks.size());
  for (std::size_t i = 0; i != clean.blocks.size(); ++i) {
    CHECK(clean.blocks[i].x == other.blocks[i].x);
    CHECK(clean.blocks[i].y == other.blocks[i].y);
  }
}

/// Depths as they are, also those that no camera measures.
struct raw_depth {
  const image<float>& pixels;
  [[nodiscard]] int width() const { return pixels.width(); }
  [[nodiscard]] int height() const { return pixels.height(); }
  [[nodiscard]] float operator()(int x, int y) const { return pixels(x, y); }
};

TEST_CASE("missing depth stays missing, is not counted, and is no edge", "[smeared_edges]") {
  image<float> depth(width, height, 1.5F), out(width, height);
  constexpr float inf = std::numeric_limits<float>::infinity();
  for (const float missing : {0.0F, -1.0F, inf, -inf, std::numeric_limits<float>::quiet_NaN()}) {
    for (int y = 20; y != 40; ++y)
      for (int x = 40; x != 60; ++x) depth(x, y) = missing;
    CHECK(remove_smeared_edges(orbis::seq, raw_depth{depth}, camera, turn(6.0, 6.0), 1.0, out) == 0);
    CHECK(std::ranges::count(out.pixels(), 0.0F) == 400);
    CHECK(out(40, 20) == 0.0F);
    CHECK(out(59, 39) == 0.0F);
  }
}

TEST_CASE("the result is the same for every policy, in place, and with a used workspace", "[smeared_edges]") {
  const image<float> depth =
      smeared([](double x, double y) { return std::hypot(x - 50.0, y - 35.0) < 20.0 ? 0.8 : 0.5; }, 7.0, -4.0);
  image<float> expected(width, height);
  const std::size_t removed =
      remove_smeared_edges(orbis::seq, depth_view{depth.view()}, camera, turn(7.0, -4.0), 1.0, expected);
  CHECK(removed > 500);
  orbis::cloud::smeared_edge_workspace workspace;
  for (const unsigned threads : {1U, 2U, 5U}) {
    image<float> out = depth;
    CHECK(remove_smeared_edges(orbis::par.with(threads), depth_view{out.view()}, camera, turn(7.0, -4.0), 1.0, out, {},
                               workspace) == removed);
    CHECK(std::ranges::equal(out.pixels(), expected.pixels()));
    // Other motions and sizes in between, also longer than a block and smaller than one.
    for (const auto& [w, h] : {std::pair{1, 1}, {31, 90}, {width, height}, {97, 64}}) {
      const orbis::camera::pinhole other{w, h, 200.0, 200.0, 0.5 * w, 0.5 * h};
      image<float> small(w, h, 2.0F), outer(w + 2, h + 2, -1.0F);
      const orbis::image_view<float> inner{&outer(1, 1), w, h, w + 2};
      for (const double motion : {-90.0, -5.0, 0.0, 25.0, 90.0})
        CHECK(remove_smeared_edges(orbis::seq, depth_view{small.view()}, other, turn(motion, 0.5 * motion), 1.0, inner,
                                   {}, workspace) == 0);
      CHECK(std::ranges::count(outer.pixels(), 2.0F) == w * h);
      CHECK(std::ranges::count(outer.pixels(), -1.0F) == 2 * (w + h + 2));
    }
  }
  image<float> out(width, height);
  remove_smeared_edges(orbis::seq, depth_view{depth.view()}, camera, turn(7.0, -4.0), 1.0, out, {}, workspace);
  const std::size_t before = orbis::test::allocations();
  remove_smeared_edges(orbis::seq, depth_view{depth.view()}, camera, turn(-3.0, 9.0), 1.0, out, {}, workspace);
  CHECK(orbis::test::allocations() == before);
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
        // Wrong: the depth of no surface within ten pixels of its row.
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

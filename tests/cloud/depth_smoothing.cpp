// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>

#include <orbis/camera/depth.hpp>
#include <orbis/cloud/depth_smoothing.hpp>
#include <orbis/cloud/flying_pixels.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/io/synthetic.hpp>

#include "support/catch.hpp"

namespace {

using orbis::image;
using orbis::camera::depth_view;
using orbis::cloud::depth_smoothing_options;
using orbis::cloud::smooth_depth;

constexpr int width = 70, height = 50;
constexpr float noise = 1.425e-3F;

image<float> smoothed(const image<float>& depth, const depth_smoothing_options& options = {}) {
  image<float> out(depth.width(), depth.height());
  smooth_depth(orbis::seq, depth_view{depth.view()}, out, options);
  return out;
}

/// A plane whose inverse depth changes by `across` and `down` from pixel to pixel, with noise.
image<float> noisy_plane(float across, float down, float sigma = noise) {
  std::mt19937 random{4};
  std::normal_distribution<float> deviation{0.0F, 1.0F};
  image<float> depth(width, height);
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x)
      depth(x, y) = 1.0F / (0.5F + across * static_cast<float>(x) + down * static_cast<float>(y) +
                            sigma * std::clamp(deviation(random), -2.5F, 2.5F));
  return depth;
}

}  // namespace

TEST_CASE("the noise of planes of any slant is reduced without bias", "[depth_smoothing]") {
  for (const float slope : {0.0F, 0.001F, 0.003F}) {
    const image<float> depth = noisy_plane(slope, -0.4F * slope), out = smoothed(depth);
    double before = 0.0, after = 0.0, sum = 0.0;
    std::size_t count = 0;
    for (int y = 3; y != height - 3; ++y)
      for (int x = 3; x != width - 3; ++x) {
        const double exact = 0.5 + static_cast<double>(slope) * (x - 0.4 * y);
        before += std::pow(1.0 / static_cast<double>(depth(x, y)) - exact, 2);
        const double error = 1.0 / static_cast<double>(out(x, y)) - exact;
        after += error * error;
        sum += error;
        ++count;
      }
    CAPTURE(slope, std::sqrt(before / static_cast<double>(count)), std::sqrt(after / static_cast<double>(count)));
    CHECK(after < 0.16 * before);  // 36 neighbours; those pairs that disagree do not count
    CHECK(std::abs(sum) < 0.05 * static_cast<double>(noise) * static_cast<double>(count));
  }
}

TEST_CASE("edges, corners and thin objects of any orientation stay as they are", "[depth_smoothing]") {
  for (const double degrees : {0.0, 10.0, 20.0, 30.0, 45.0, 70.0, 90.0}) {
    const double angle = degrees * 0.017453292519943295;
    const auto across = [&](int x, int y) { return std::cos(angle) * (x - 35) + std::sin(angle) * (y - 25); };
    const auto along = [&](int x, int y) { return std::cos(angle) * (y - 25) - std::sin(angle) * (x - 35); };
    image<float> edge(width, height, 2.0F), corner = edge, bar = edge;
    for (int y = 0; y != height; ++y)
      for (int x = 0; x != width; ++x) {
        if (across(x, y) > 0.0) edge(x, y) = 1.0F;
        if (across(x, y) > 0.0 && along(x, y) > 0.0) corner(x, y) = 1.0F;
        if (std::abs(across(x, y)) < 1.2) bar(x, y) = 1.0F;
      }
    for (const image<float>& depth : {edge, corner, bar}) {
      const image<float> out = smoothed(depth);
      std::size_t changed = 0;
      for (int y = 4; y != height - 4; ++y)
        for (int x = 4; x != width - 4; ++x) changed += std::abs(out(x, y) - depth(x, y)) > 1e-5F ? 1 : 0;
      CAPTURE(degrees);
      CHECK(changed <= 1);  // the tip of a sharp corner may be one pixel wide
    }
  }
}

TEST_CASE("missing depth stays missing and does not count", "[depth_smoothing]") {
  image<float> depth = noisy_plane(0.001F, 0.0F);
  depth(5, 5) = 0.0F;
  depth(6, 5) = -1.0F;
  depth(7, 5) = std::numeric_limits<float>::infinity();
  depth(8, 5) = std::numeric_limits<float>::quiet_NaN();
  depth(0, 0) = 0.0F;
  const image<float> out = smoothed(depth);
  for (int x = 5; x != 9; ++x) CHECK(out(x, 5) == 0.0F);
  CHECK(out(0, 0) == 0.0F);
  CHECK(std::ranges::count(out.pixels(), 0.0F) == 5);
  const image<float> single = smoothed(image<float>(1, 1, 3.0F));
  CHECK(single(0, 0) == Approx(3.0F));
}

TEST_CASE("smoothing gives the same bits for every policy and level, and in place", "[depth_smoothing]") {
  const image<float> depth = noisy_plane(0.002F, 0.001F), expected = smoothed(depth);
  for (const orbis::simd::level level : orbis::simd::available_levels()) {
    const orbis::simd::level_limit limit{level};
    image<float> memory;
    for (const unsigned threads : {1U, 3U}) {
      image<float> out(width, height);
      smooth_depth(orbis::par.with(threads), depth_view{depth.view()}, out, {}, memory);
      CHECK(std::ranges::equal(out.pixels(), expected.pixels()));
    }
  }
  image<float> in_place = depth;
  smooth_depth(orbis::par.with(2), depth_view{in_place.view()}, in_place);
  CHECK(std::ranges::equal(in_place.pixels(), expected.pixels()));
}

TEST_CASE("only the output's pixels are written, at every size and radius", "[depth_smoothing]") {
  image<float> memory;
  for (const int radius : {1, 3, 8})
    for (const int w : {1, 15, 16, 17, 70}) {
      image<float> depth(w, 9, 1.5F), outer(w + 2, 11, -1.0F);
      const orbis::image_view<float> out{&outer(1, 1), w, 9, w + 2};
      smooth_depth(orbis::seq, depth_view{depth.view()}, out, {.radius = radius}, memory);
      CAPTURE(radius, w);
      for (int y = 0; y != 11; ++y)
        for (int x = 0; x != w + 2; ++x)
          CHECK(outer(x, y) == Approx(x == 0 || y == 0 || x == w + 1 || y == 10 ? -1.0F : 1.5F));
    }
}

TEST_CASE("smoothing halves the depth error of a synthetic room", "[depth_smoothing]") {
  const orbis::io::synthetic_recording room{{.frames = 60, .width = 320, .height = 240}};
  for (const std::size_t f : {0U, 25U, 50U}) {
    const auto frame = room.frame(f).value();
    const auto exact = room.exact(orbis::seq, f).value();
    const depth_view depth{frame.depth.view(), frame.depth_scale};
    image<float> measured(depth.width(), depth.height()), out = measured;
    orbis::cloud::remove_flying_pixels(orbis::seq, depth, measured);
    smooth_depth(orbis::seq, depth_view{measured.view()}, out,
                 {.resolution = 1.0 / frame.depth_scale, .steepest = 0.015});
    double before = 0.0, after = 0.0;
    std::size_t missing = 0;
    for (int y = 0; y != out.height(); ++y)
      for (int x = 0; x != out.width(); ++x) {
        const float z = measured(x, y), truth = exact.depth(x, y);
        missing += (z > 0.0F) != (out(x, y) > 0.0F) ? 1 : 0;
        if (!(z > 0.0F)) continue;
        const auto squared = [&](float d) { return std::pow(static_cast<double>(1.0F / d - 1.0F / truth), 2); };
        if (std::abs(z - truth) > 0.1F) continue;  // another flying pixel
        before += squared(z);
        after += squared(out(x, y));
      }
    CAPTURE(f, before, after);
    CHECK(after < 0.25 * before);
    CHECK(missing == 0);
  }
}

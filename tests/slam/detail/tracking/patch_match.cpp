// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include <orbis/core/simd/level.hpp>
#include <orbis/slam/detail/tracking/patch_match.hpp>

#include "support/catch.hpp"

using namespace orbis;
using slam::detail::line_kernel;
using slam::detail::match_patch;
using slam::detail::patch_placement;

namespace {

/// A smooth texture without repetition over some 50 pixels.
double texture(double x, double y) {
  return 128.0 + 40.0 * std::sin(0.55 * x + 0.21 * y) + 35.0 * std::sin(0.17 * x - 0.62 * y + 1.0) +
         25.0 * std::sin(0.83 * x + 0.74 * y + 2.0);
}

/// The texture, at `zoom` pixels per unit around (32, 32), blurred along `smear` (pixels).
image<std::uint8_t> picture(const vec2& smear, double zoom = 1.0) {
  image<std::uint8_t> made(64, 64);
  constexpr int steps = 101;
  for (int y = 0; y != 64; ++y)
    for (int x = 0; x != 64; ++x) {
      double sum = 0.0;
      for (int k = 0; k != steps; ++k) {
        const double t = (k + 0.5) / steps - 0.5;
        sum += texture((x - 32.0 - t * smear.x()) / zoom, (y - 32.0 - t * smear.y()) / zoom);
      }
      made(x, y) = static_cast<std::uint8_t>(sum / steps + 0.5);
    }
  return made;
}

/// The patch around the middle of `picture(smear)`.
slam::landmark_patch patch_of(const vec2& smear) {
  auto pixels = std::make_shared<slam::landmark_patch::pixel_array>();
  constexpr int size = slam::landmark_patch::size;
  const image<std::uint8_t> around = picture(smear);
  for (int y = 0, k = 0; y != size; ++y)
    for (int x = 0; x != size; ++x, ++k) {
      const double c = 32.0 - slam::landmark_patch::centre;
      (*pixels)[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(
          0.5F + slam::detail::interpolate(around, static_cast<float>(c + x), static_cast<float>(c + y)));
    }
  slam::landmark_patch patch;
  patch.pixels = std::move(pixels);
  return patch;
}

patch_placement at(double x, double y, double zoom = 1.0) { return {{x, y}, {zoom, 0.0}, {0.0, zoom}}; }

}  // namespace

TEST_CASE("A patch is found to a few hundredths of a pixel") {
  const auto patch = patch_of(zeros<vec2>());
  const auto image = picture(zeros<vec2>());
  for (const vec2& off : {vec2(0.0, 0.0), vec2(0.4, -0.7), vec2(-2.3, 1.1), vec2(1.9, 2.4)}) {
    const auto found = match_patch(patch, zeros<vec2>(), zeros<vec2>(), image, at(32.0 - off.x(), 32.0 - off.y()));
    REQUIRE(found);
    CHECK(norm(found->shift - off) < 0.03);
    CHECK(found->correlation > 0.995);
  }
  const auto larger = picture(zeros<vec2>(), 1.4);
  const auto found = match_patch(patch, zeros<vec2>(), zeros<vec2>(), larger, at(33.0, 31.5, 1.4));
  REQUIRE(found);
  CHECK(norm(found->shift - vec2(-1.0 / 1.4, 0.5 / 1.4)) < 0.05);
}

TEST_CASE("Blur in the image, in the patch, or in both does not move a patch") {
  const vec2 across(7.0, 1.0), along(-2.0, 6.0), off(0.6, -0.8);
  for (const vec2& of_patch : {zeros<vec2>(), across})
    for (const vec2& of_image : {zeros<vec2>(), across, along}) {
      const auto found =
          match_patch(patch_of(of_patch), of_patch, of_image, picture(of_image), at(32.0 - off.x(), 32.0 - off.y()));
      CAPTURE(of_patch.x(), of_image.x(), of_image.y());
      REQUIRE(found);
      CHECK(norm(found->shift - off) < 0.1);
      CHECK(found->correlation > 0.98);
    }
  // Without its motion the patch does not look like the image.
  const auto ignored =
      match_patch(patch_of(zeros<vec2>()), zeros<vec2>(), zeros<vec2>(), picture(across), at(32.0, 32.0));
  CHECK((!ignored || ignored->correlation < 0.95));
}

TEST_CASE("Blur of any length and direction stays within the memory of a patch") {
  const auto image = picture(zeros<vec2>());
  const auto patch = patch_of(zeros<vec2>());
  for (double x = -13.0; x <= 13.0; x += 1.0)
    for (double y = 0.0; y <= 13.0; y += 1.0) {
      const auto found = match_patch(patch, vec2(x, y), vec2(y, x), image, at(32.0, 32.0));
      if (found) CHECK(std::abs(found->correlation) <= 1.0 + 1e-6);
    }
  for (const double bad : {std::nan(""), 1e300 * 1e10})  // taken as no blur
    for (const vec2& line : {vec2(bad, 0.0), vec2(5.0, bad), vec2(bad, bad)})
      CHECK(match_patch(patch, line, zeros<vec2>(), image, at(32.0, 32.0)));
}

TEST_CASE("A patch without texture, outside of the image, or elsewhere is not found") {
  const auto patch = patch_of(zeros<vec2>());
  const auto image = picture(zeros<vec2>());
  const auto none = zeros<vec2>();
  CHECK_FALSE(match_patch(patch, none, none, image, at(4.0, 32.0)));
  CHECK_FALSE(match_patch(patch, none, none, image, at(32.0, 60.0)));
  CHECK_FALSE(match_patch(patch, none, none, image, at(1e9, -1e9)));
  CHECK_FALSE(match_patch(patch, none, none, image, at(std::nan(""), 32.0)));
  orbis::image<std::uint8_t> grey(64, 64);
  CHECK_FALSE(match_patch(patch, none, none, grey, at(32.0, 32.0)));
  slam::landmark_patch flat;
  flat.pixels = std::make_shared<slam::landmark_patch::pixel_array>();
  CHECK_FALSE(match_patch(flat, none, none, image, at(32.0, 32.0)));
  const auto elsewhere = match_patch(patch, none, none, image, at(20.0, 45.0));
  CHECK((!elsewhere || elsewhere->correlation < 0.9));
}

TEST_CASE("At the border, a patch is found if the image contains what the shift needs") {
  const auto patch = patch_of(zeros<vec2>());
  const auto image = picture(zeros<vec2>());
  // Searches `off` pixels beside the middle of the patch, which is `middle` pixels from the border of the image.
  const auto find = [&](int middle, double off) {
    const image_view<const std::uint8_t> cut(&image(32 - middle, 0), 32 + middle, 64, 64);
    return match_patch(patch, zeros<vec2>(), zeros<vec2>(), cut, at(middle - off, 32.0));
  };
  const auto near = find(5, -0.4);  // a small shift needs a small region
  REQUIRE(near);
  CHECK(norm(near->shift - vec2(-0.4, 0.0)) < 0.03);
  CHECK_FALSE(find(7, 2.0));  // the region for this shift is outside
  CHECK(find(9, 2.0));
}

TEST_CASE("A line kernel has the mean of its line, and its weights add up to one") {
  for (const vec2& line : {vec2(0.0, 0.0), vec2(3.0, 0.0), vec2(-5.0, 7.0), vec2(100.0, 40.0)}) {
    const line_kernel kernel(line);
    CHECK(kernel.reach_x() <= line_kernel::reach);
    CHECK(kernel.reach_y() <= line_kernel::reach);
    // A ramp keeps its values.
    constexpr int stride = 40;
    std::vector<float> ramp(stride * 30), mean(16 * 10);
    for (int y = 0; y != 30; ++y)
      for (int x = 0; x != stride; ++x)
        ramp[static_cast<std::size_t>(y * stride + x)] = static_cast<float>(2 * x + 3 * y);
    for (const int columns : {8, 10, 16}) {
      kernel.apply<simd::portable>(10, columns, &ramp[10 * stride + 10], stride, mean.data());
      for (int y = 0; y != 10; ++y)
        for (int x = 0; x != columns; ++x)
          CHECK(std::abs(mean[static_cast<std::size_t>(16 * y + x)] - static_cast<float>(2 * (x + 10) + 3 * (y + 10))) <
                0.01F);
    }
  }
}

TEST_CASE("Patches are found at the same place on every instruction set") {
  const vec2 smear(4.0, -3.0), off(1.2, 0.3);
  const auto patch = patch_of(smear);
  const auto image = picture(zeros<vec2>());
  const auto find = [&] { return match_patch(patch, smear, zeros<vec2>(), image, at(32.0 - off.x(), 32.0 - off.y())); };
  const auto best = find();
  REQUIRE(best);
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit(level);
    const auto found = find();
    REQUIRE(found);
    CHECK(found->shift == best->shift);
    CHECK(found->correlation == best->correlation);
  }
}

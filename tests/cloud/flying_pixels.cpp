// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <orbis/cloud/flying_pixels.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/synthetic.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"

using orbis::image;
using orbis::random_bits;
using orbis::camera::depth_view;
using orbis::cloud::flying_pixel_count;
using orbis::cloud::flying_pixel_options;
using orbis::cloud::remove_flying_pixels;

namespace {

constexpr int width = 150;
constexpr int height = 100;

image<float> filtered(const image<float>& depth, const flying_pixel_options& options = {}) {
  image<float> out(depth.width(), depth.height(), -1.0F);
  remove_flying_pixels(orbis::seq, depth_view{depth.view()}, out, options);
  return out;
}

/// An image of planes: `inverse(x, y)` is the inverse of depth, 1 / metre.
template <class F>
image<float> scene(F&& inverse) {
  image<float> out(width, height);
  for (int y = 0; y != height; ++y) {
    for (int x = 0; x != width; ++x) out(x, y) = static_cast<float>(1.0 / inverse(x, y));
  }
  return out;
}

/// What a camera that triangulates makes of it: noise of 1.425e-3 z^2, disparity and millimetres in steps.
image<float> measured(image<float> depth, std::uint64_t seed) {
  random_bits random{seed};
  for (float& z : depth.pixels()) {
    double w = 1.0 / static_cast<double>(z) + 1.0e-3 * random.normal();  // with the steps: 1.3e-3
    w = std::round(w / 2.85e-3) * 2.85e-3;
    z = static_cast<float>(std::round(1000 / w) / 1000);
  }
  return depth;
}

/// A square at 1 m before a wall at `wall` metres; the pixels around the square see both in random parts.
struct square_scene {
  image<float> depth;
  image<char> mixed;  ///< 1: clearly between, 2: a little
};
square_scene square(double wall, std::uint64_t seed) {
  random_bits random{seed};
  square_scene out{image<float>(width, height), image<char>(width, height, 0)};
  for (int y = 0; y != height; ++y) {
    for (int x = 0; x != width; ++x) {
      const int outside = std::max({30 - x, x - 99, 30 - y, y - 69});
      double z = outside < 0 ? 1.0 : wall;
      if (outside == 0) {
        const double share = random.uniform();
        z = 1 / (share / 1.0 + (1 - share) / wall);
        out.mixed(x, y) = std::abs(share - 0.5) < 0.4 ? 1 : 2;
      }
      out.depth(x, y) = static_cast<float>(z);
    }
  }
  return out;
}

std::size_t removed(const image<float>& before, const image<float>& after) {
  std::size_t n = 0;
  for (int y = 0; y != before.height(); ++y) {
    for (int x = 0; x != before.width(); ++x) n += before(x, y) > 0 && after(x, y) == 0 ? 1 : 0;
  }
  return n;
}

}  // namespace

TEST_CASE("planes keep their pixels, however slanted and noisy") {
  std::uint64_t seed = 0;
  for (const double across : {0.0, 0.0005, 0.003, -0.006}) {
    for (const double down : {0.0, 0.002, 0.008}) {
      const double corner = 0.2 - std::min(across, 0.0) * width;
      const auto plane = scene([&](int x, int y) { return corner + across * x + down * y; });
      INFO(across << " " << down);
      CHECK(filtered(plane) == plane);
      const auto noisy = measured(plane, ++seed);
      CHECK(removed(noisy, filtered(noisy)) <= 1);  // of 15,000
    }
  }
}

TEST_CASE("creases and steps smaller than the noise keep their pixels") {
  const auto roof = scene([](int x, int y) { return 0.3 + 0.006 * std::abs(x - 75) + 0.001 * y; });
  CHECK(filtered(roof) == roof);
  const auto noisy_roof = measured(roof, 4);
  CHECK(removed(noisy_roof, filtered(noisy_roof)) <= 3);                     // of 15,000
  const auto step = scene([](int x, int) { return x < 75 ? 0.5 : 0.505; });  // 2 cm at 2 m
  const auto noisy = measured(step, 5);
  CHECK(removed(noisy, filtered(noisy)) == 0);
}

TEST_CASE("thin rods before a wall keep their pixels, and the wall its own") {
  for (const int thickness : {1, 2, 3, 5}) {
    for (const double slope : {0.0, 0.4, 1.0}) {  // upright to diagonal
      INFO(thickness << " pixels, slope " << slope);
      const auto rods = scene([&](int x, int y) {
        const int along = x - static_cast<int>(slope * y);
        return ((along % 40) + 40) % 40 < thickness ? 1.0 : 0.4;
      });
      CHECK(removed(rods, filtered(rods)) == 0);
      const auto noisy = measured(rods, 7);
      CHECK(removed(noisy, filtered(noisy)) == 0);
    }
  }
}

TEST_CASE("a narrow thing between near and far is there if its pixels support each other") {
  const auto ledge = scene([](int x, int) { return x < 70 ? 1.0 : x < 73 ? 0.7 : 0.4; });
  CHECK(removed(ledge, filtered(ledge)) == 0);
}

TEST_CASE("pixels that see two surfaces go, and no others") {
  for (const double wall : {1.5, 2.0, 4.0}) {
    for (const bool noise : {false, true}) {
      INFO("wall at " << wall << (noise ? " noisy" : ""));
      square_scene s = square(wall, 3);
      if (noise) s.depth = measured(s.depth, 4);
      const auto after = filtered(s.depth);
      std::size_t mixed = 0;
      std::size_t found = 0;
      std::size_t wrong = 0;
      for (int y = 0; y != height; ++y) {
        for (int x = 0; x != width; ++x) {
          const bool gone = after(x, y) == 0;
          mixed += s.mixed(x, y) == 1 ? 1 : 0;
          found += s.mixed(x, y) == 1 && gone ? 1 : 0;
          wrong += s.mixed(x, y) == 0 && gone ? 1 : 0;
        }
      }
      CHECK(mixed > 150);
      CHECK(static_cast<double>(found) >= 0.93 * static_cast<double>(mixed));
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("a transition of several pixels goes as a whole within the reach") {
  const auto ramp = [](int pixels) {
    return scene([=](int x, int) {
      const double far_part = std::clamp((x - 69.0) / (pixels + 1), 0.0, 1.0);
      return 1.0 - 0.6 * far_part;
    });
  };
  for (int pixels = 1; pixels <= 4; ++pixels) {
    const auto depth = ramp(pixels);
    const auto after = filtered(depth, {.reach = std::max(2, pixels)});
    INFO(pixels);
    CHECK(removed(depth, after) == static_cast<std::size_t>(pixels) * height);
  }
}

TEST_CASE("beside a shadow without measurements, too") {
  auto depth = scene([](int x, int) { return x < 70 ? 1.0 : x == 70 ? 0.8 : 0.4; });
  for (int y = 0; y != height; ++y) {
    for (int x = 71; x != 85; ++x) depth(x, y) = 0;
  }
  const auto after = filtered(depth);
  CHECK(removed(depth, after) == height);
  for (int y = 0; y != height; ++y) CHECK(after(70, y) == 0);
}

TEST_CASE("invalid pixels stay invalid and are not counted") {
  image<float> depth(20, 10, 1.0F);
  depth(3, 3) = std::numeric_limits<float>::quiet_NaN();
  depth(4, 4) = 0;
  depth(5, 5) = -1;
  depth(6, 6) = std::numeric_limits<float>::infinity();
  image<float> out(20, 10, -1.0F);
  CHECK(remove_flying_pixels(orbis::seq, depth_view{depth.view()}, out) == flying_pixel_count{196, 0});
  for (int i = 3; i != 7; ++i) CHECK(out(i, i) == 0.0F);
  struct raw {  // a source that does not keep its word
    const image<float>* z;
    int width() const { return z->width(); }
    int height() const { return z->height(); }
    float operator()(int x, int y) const { return (*z)(x, y); }
  };
  image<float> again(20, 10, -1.0F);
  CHECK(remove_flying_pixels(orbis::seq, raw{&depth}, again) == flying_pixel_count{196, 0});
  CHECK(again == out);
}

TEST_CASE("the same for every policy, instruction set, kind of depth and in place") {
  using orbis::simd::level;
  for (const auto& [w, h] : {std::pair{width, height}, std::pair{1, 1}, std::pair{3, 40}, std::pair{40, 2},
                             std::pair{0, 0}, std::pair{17, 33}}) {
    random_bits random{static_cast<std::uint64_t>(w)};
    image<std::uint16_t> stored(w, h);
    for (auto& z : stored.pixels()) {
      z = static_cast<std::uint16_t>(random.below(10) == 0 ? 0 : 5000 * (1 + random.below(3)) + random.below(800));
    }
    const depth_view depth{stored.view(), 5000.0};
    image<float> expected(w, h);
    const auto count = remove_flying_pixels(orbis::seq, depth, expected);
    if (w == width) CHECK(count.removed > 50);
    orbis::cloud::flying_pixel_workspace workspace;
    for (const level l : {level::portable, level::avx2, level::avx512}) {
      const orbis::simd::level_limit limit{l};
      for (const unsigned threads : {1U, 2U, 5U}) {
        image<float> out(w, h, -1.0F);
        CHECK(remove_flying_pixels(orbis::par.with(threads), depth, out, {}, workspace) == count);
        CHECK(out == expected);
      }
    }
    image<float> metres(w, h);
    for (int y = 0; y != h; ++y) {
      for (int x = 0; x != w; ++x) metres(x, y) = depth(x, y);
    }
    CHECK(remove_flying_pixels(orbis::par.with(2), depth_view{metres.view()}, metres) == count);
    CHECK(metres == expected);
  }
}

TEST_CASE("shared memory is made once for images of one size") {
  orbis::cloud::flying_pixel_workspace workspace;
  const auto depth = square(2.0, 1).depth;
  image<float> out(width, height);
  remove_flying_pixels(orbis::seq, depth_view{depth.view()}, out, {}, workspace);
  const float* const made = workspace.inverse(width, height, 4).data();
  remove_flying_pixels(orbis::seq, depth_view{depth.view()}, out, {}, workspace);
  CHECK(workspace.inverse(width, height, 4).data() == made);
  // Another size or reach leaves nothing behind.
  image<float> other(60, 40);
  const image<float> plane(60, 40, 2.0F);
  remove_flying_pixels(orbis::seq, depth_view{plane.view()}, other, {.reach = 4}, workspace);
  CHECK(other == plane);
  image<float> back(width, height);
  remove_flying_pixels(orbis::seq, depth_view{depth.view()}, back, {}, workspace);
  CHECK(back == out);
}

TEST_CASE("in a furnished room seen by a noisy camera the flying pixels go and the rest stays") {
  orbis::io::synthetic_options options{.frames = 24, .seed = 11};
  options.sensor.flying_pixels = 0.4;
  const orbis::io::synthetic_recording room{options};
  std::size_t valid = 0;
  std::size_t flying = 0;
  std::size_t found = 0;
  std::size_t wrong = 0;
  for (std::size_t f = 0; f < room.size(); f += 6) {
    const auto frame = room.frame(f).value();
    const auto exact = room.exact(orbis::par, f).value();
    const depth_view depth{frame.depth.view(), frame.depth_scale};
    image<float> out(depth.width(), depth.height());
    valid += remove_flying_pixels(orbis::par, depth, out).valid;
    for (int y = 2; y < depth.height() - 2; ++y) {
      for (int x = 2; x < depth.width() - 2; ++x) {
        const float z = depth(x, y);
        if (!(z > 0)) continue;
        float nearest = 1e9F;  // of the surfaces around, in inverse depth
        for (int v = -2; v <= 2; ++v) {
          for (int u = -2; u <= 2; ++u) nearest = std::min(nearest, std::abs(1 / z - 1 / exact.depth(x + u, y + v)));
        }
        const bool flies = nearest > 0.012F;
        const bool gone = out(x, y) == 0;
        flying += flies ? 1 : 0;
        found += flies && gone ? 1 : 0;
        wrong += !flies && gone ? 1 : 0;
      }
    }
  }
  INFO(valid << " valid, " << flying << " flying, " << found << " found, " << wrong << " wrong");
  CHECK(flying > 500);
  CHECK(static_cast<double>(found) > 0.88 * static_cast<double>(flying));
  CHECK(static_cast<double>(wrong) < 0.003 * static_cast<double>(valid));
}

TEST_CASE("a sensible part of a real kitchen flies") {
  ORBIS_NEEDS_DATA("kitchen");
  auto kitchen = orbis::io::open_recording(orbis::test::data_dir() / "kitchen").value();
  std::size_t frames = 0;
  std::size_t number = 0;
  for (const auto& frame : kitchen) {
    if (number++ % 100 != 0) continue;
    const depth_view depth{frame.depth.view(), frame.depth_scale};
    image<float> out(depth.width(), depth.height());
    const auto count = remove_flying_pixels(orbis::par, depth, out);
    const double part = static_cast<double>(count.removed) / static_cast<double>(count.valid);
    INFO("frame " << number - 1 << ": " << 100 * part << " %");
    CHECK(part > 0.0001);
    CHECK(part < 0.01);
    for (int y = 0; y != depth.height(); ++y) {
      for (int x = 0; x != depth.width(); ++x) {
        if (out(x, y) != 0 && out(x, y) != depth(x, y)) FAIL("a depth was changed");
      }
    }
    ++frames;
  }
  CHECK(frames >= 5);
}

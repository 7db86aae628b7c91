// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/io/detail/synthetic/sensor.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::io::detail::synthetic;

namespace {

constexpr int width = 200, height = 100;
constexpr double focal = 525.0;

/// A view whose left part is at `z_left` and whose right part, from column `edge` on, at `z_right`.
exact_view step_view(double z_left, double z_right, int edge, float cosine = 1.0F) {
  exact_view v{image<rgb8>(width, height, {120, 130, 140}), image<float>(width, height),
               image<float>(width, height, cosine)};
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x) v.depth(x, y) = static_cast<float>(x < edge ? z_left : z_right);
  return v;
}

image<std::uint16_t> measure(const io::synthetic_sensor_options& o, const exact_view& v, double scale = 5000.0,
                             std::uint64_t key = 0) {
  image<std::uint16_t> out(width, height);
  const sensor s{o, focal, scale, 1, key};
  for (int y = 0; y != height; ++y) s.measure_depth(v, y, out.row(y));
  return out;
}

double share_of_zeros(const image<std::uint16_t>& depth) {
  double zeros = 0;
  for (const auto d : depth.pixels()) zeros += d == 0 ? 1 : 0;
  return zeros / (width * height);
}

}  // namespace

TEST_CASE("an ideal sensor stores the truth rounded to whole units") {
  for (const double z : {0.3, 1.0, 3.3333, 9.7}) {
    const auto depth = measure(io::synthetic_sensor_options::ideal(), step_view(z, z + 1.0, 80));
    for (int x = 0; x != width; ++x)
      CHECK(std::abs(depth(x, 50) / 5000.0 - (x < 80 ? z : z + 1.0)) <= 0.5 / 5000.0 + 1e-6);
  }
}

TEST_CASE("depths that do not fit into 16 bits are not measured") {
  CHECK(share_of_zeros(measure(io::synthetic_sensor_options::ideal(), step_view(20.0, 20.0, 0))) == 1.0);
}

TEST_CASE("axial noise has the published deviation and no bias") {
  auto o = io::synthetic_sensor_options::ideal();
  o.axial_noise = 1.0;
  for (const double z : {0.5, 1.0, 2.0, 3.0, 4.0}) {
    const auto depth = measure(o, step_view(z, z, 0), 10000.0);
    double sum = 0, squares = 0;
    for (const auto d : depth.pixels()) {
      sum += d / 10000.0 - z;
      squares += square(d / 10000.0 - z);
    }
    const double n = width * height, sigma = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
    CHECK(std::abs(sum / n) < 4.0 * sigma / std::sqrt(n));
    CHECK(std::sqrt(squares / n) == Approx(sigma).epsilon(0.03));
  }
}

TEST_CASE("noise differs from frame to frame") {
  auto o = io::synthetic_sensor_options::ideal();
  o.axial_noise = 1.0;
  const auto view = step_view(2.0, 2.0, 0);
  CHECK(measure(o, view, 5000.0, 1) == measure(o, view, 5000.0, 1));
  CHECK(measure(o, view, 5000.0, 1) != measure(o, view, 5000.0, 2));
}

TEST_CASE("disparity comes in whole steps that widen with the square of the depth") {
  auto o = io::synthetic_sensor_options::ideal();
  o.disparity_step = 0.125;
  exact_view v = step_view(1.0, 1.0, 0);
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x) v.depth(x, y) = 0.5F + 4.0F * static_cast<float>(y * width + x) / (width * height);
  const auto depth = measure(o, v, 10000.0);
  const double fb = 580.0 * 0.075;
  std::size_t i = 0;
  for (const auto d : depth.pixels()) {
    const double z = d / 10000.0, truth = static_cast<double>(v.depth.pixels()[i++]);
    const double steps = fb / z / 0.125;
    CHECK(std::abs(steps - std::round(steps)) < 0.51e-4 * fb / (z * z) / 0.125 + 1e-6);
    CHECK(std::abs(z - truth) < 0.6 * truth * truth * 0.125 / fb + 1e-4);
  }
}

TEST_CASE("only depths inside the range are measured") {
  auto o = io::synthetic_sensor_options::ideal();
  o.min_depth = 0.5;
  o.max_depth = 3.0;
  CHECK(share_of_zeros(measure(o, step_view(0.45, 2.0, 100))) == 0.5);
  CHECK(share_of_zeros(measure(o, step_view(1.0, 3.1, 50))) == 0.75);
}

TEST_CASE("drop-outs happen only when on and as often as asked for") {
  auto o = io::synthetic_sensor_options::ideal();
  CHECK(share_of_zeros(measure(o, step_view(1.0, 1.0, 0))) == 0.0);
  o.dropouts = 0.05;
  CHECK(share_of_zeros(measure(o, step_view(1.0, 1.0, 0))) == Approx(0.05).epsilon(0.1));
}

TEST_CASE("surfaces seen flat are lost") {
  auto o = io::synthetic_sensor_options::ideal();
  o.grazing_angle = 1.4;
  CHECK(share_of_zeros(measure(o, step_view(1.0, 1.0, 0, std::cos(1.45F)))) == 1.0);
  CHECK(share_of_zeros(measure(o, step_view(1.0, 1.0, 0, std::cos(1.20F)))) == 0.0);
  const double half = share_of_zeros(measure(o, step_view(1.0, 1.0, 0, std::cos(1.33F))));
  CHECK(half > 0.2);
  CHECK(half < 0.8);
}

TEST_CASE("the projector's shadow lies left of near things and is as wide as geometry says") {
  auto o = io::synthetic_sensor_options::ideal();
  o.shadow = true;
  const auto depth = measure(o, step_view(3.0, 1.0, 120));
  int dark = 0;
  for (int x = 0; x != width; ++x) {
    if (depth(x, 40) != 0) continue;
    ++dark;
    CHECK(x < 120);
  }
  CHECK(dark == Approx(focal * 0.075 * (1.0 / 1.0 - 1.0 / 3.0)).margin(1.0));
  CHECK(depth(119, 40) == 0);
  CHECK(share_of_zeros(measure(o, step_view(1.0, 3.0, 120))) == 0.0);  // the far side to the right is lit
}

TEST_CASE("flying pixels appear on depth edges only") {
  auto o = io::synthetic_sensor_options::ideal();
  const auto between = [](const image<std::uint16_t>& d, int x0, int x1) {
    int count = 0;
    for (int y = 0; y != height; ++y)
      for (int x = x0; x != x1; ++x) count += d(x, y) > 5100 && d(x, y) < 9900 ? 1 : 0;
    return count;
  };
  const auto view = step_view(2.0, 1.0, 100);
  CHECK(between(measure(o, view), 0, width) == 0);
  o.flying_pixels = 0.3;
  const auto depth = measure(o, view);
  CHECK(between(depth, 99, 101) > 20);
  CHECK(between(depth, 99, 101) < 100);
  CHECK(between(depth, 0, 99) + between(depth, 101, width) == 0);
}

TEST_CASE("lateral noise frays depth edges but invents no depths") {
  auto o = io::synthetic_sensor_options::ideal();
  o.lateral_noise = 0.5;
  const auto depth = measure(o, step_view(2.0, 1.0, 100));
  int frayed = 0;
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x) {
      CHECK((depth(x, y) == 5000 || depth(x, y) == 10000));
      frayed += depth(x, y) != (x < 100 ? 10000 : 5000) ? 1 : 0;
    }
  CHECK(frayed > 20);
  CHECK(frayed < 150);
}

TEST_CASE("colour noise has the deviation asked for and no bias") {
  auto o = io::synthetic_sensor_options::ideal();
  o.colour_noise = 3.0;
  exact_view v = step_view(1.0, 1.0, 0);
  const sensor s{o, focal, 5000.0, 1, 0};
  double sum = 0, squares = 0, product = 0;
  for (int y = 0; y != height; ++y) {
    s.measure_colour(v.color.row(y), y);
    for (const rgb8 c : v.color.row(y)) {
      sum += c.r - 120;
      squares += square(c.r - 120);
      product += (c.r - 120) * (c.g - 130);
    }
  }
  const double n = width * height;
  CHECK(std::abs(sum / n) < 0.1);
  CHECK(std::sqrt(squares / n) == Approx(std::sqrt(9.0 + 1.0 / 12.0)).epsilon(0.03));
  CHECK(std::abs(product / n) < 0.3);  // the channels are independent
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/optimize/self_calibration.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using camera::parameters_of;
using lens = camera::radial_tangential;

namespace {

const lens truth{camera::intrinsics{640, 480, 517, 516.5, 318.6, 255.3},
                 {.k1 = 0.1, .k2 = -0.2, .p1 = -0.002, .p2 = 0.001}};
constexpr double bf = 40.0;
constexpr std::uint32_t to_p2 = 0xff;  // fx ... p2

struct images {
  std::vector<se3> poses, true_poses;
  std::vector<vec3> points, true_points;
  std::vector<optimize::bundle_observation> observations;
};

/// A lens that takes 15 images from everywhere around, or, with `motion` 0, from one place. `fine`: factor of the pixel
/// errors of every second observation.
images take_images(std::uint64_t seed, double sigma, double motion = 1.0, double fine = 1.0) {
  random_bits random(seed);
  images all;
  for (int i = 0; i != 15; ++i) {
    const se3 T(so3::exp(motion * test::random_vector(random, 0.4)), motion * test::random_vector(random, 0.5));
    vec6 off;
    off << test::random_vector(random, 0.01), test::random_vector(random, 0.01);
    all.true_poses.push_back(T);
    all.poses.push_back(i == 0 ? T : T * se3::exp(off));
  }
  for (std::uint32_t p = 0; p != 300; ++p) {
    const vec3 at(random.uniform(-2.0, 2.0), random.uniform(-1.5, 1.5), random.uniform(1.5, 4.0));
    all.true_points.push_back(at);
    all.points.push_back(at + test::random_vector(random, 0.02));
    for (std::uint32_t c = 0; c != all.poses.size(); ++c) {
      const vec3 seen = all.true_poses[c].inverse() * at;
      const auto pixel = truth.project(seen);
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > 639 || pixel->y() > 479) continue;
      optimize::bundle_observation o{.pose = c, .point = p};
      const double share = all.observations.size() % 2 == 0 ? 1.0 : fine;
      o.pixel = *pixel + share * sigma * vec2(random.normal(), random.normal());
      o.depth_weight = share;
      if (p % 3 != 0) o.right = o.pixel.x() - bf / seen.z() + sigma * random.normal();
      if (sigma > 0.0) o.information = 1.0 / (share * share * sigma * sigma);
      all.observations.push_back(o);
    }
  }
  return all;
}

/// Without distortion, and with wrong focal lengths and principal point.
lens wrong_lens(double fx_factor, double fy_factor) {
  auto p = parameters_of<lens>::get(truth);
  p[0] *= fx_factor;
  p[1] *= fy_factor;
  p[2] += 8.0;
  p[3] -= 6.0;
  for (int i = 4; i != 8; ++i) p[i] = 0.0;
  return *parameters_of<lens>::with(truth, p);
}

auto calibrate(const lens& start, images& all, const optimize::self_calibration_options& options,
               const progress& callback = {}) {
  return optimize::self_calibrate<lens>(start, all.poses, all.points, all.observations, options, callback);
}

}  // namespace

TEST_CASE("Self-calibration finds one camera of all images exactly where nothing is noisy") {
  images all = take_images(5, 0.0);
  const auto found = calibrate(wrong_lens(1.04, 0.97), all,
                               {.bf = bf, .free = to_p2, .keeps_aspect = false, .relative_tolerance = 1e-14});
  REQUIRE(found);
  const auto p = parameters_of<lens>::get(found->camera), expected = parameters_of<lens>::get(truth);
  for (int i = 0; i != 4; ++i) CHECK(std::abs(p[i] - expected[i]) < 1e-4);
  for (int i = 4; i != 8; ++i) CHECK(std::abs(p[i] - expected[i]) < 1e-6);
  for (int i = 8; i != 12; ++i) CHECK(p[i] == expected[i]);
  CHECK(found->outliers == 0);
  CHECK(found->final_rms < 1e-4 * found->initial_rms);
  for (std::size_t c = 0; c != all.poses.size(); ++c)
    CHECK(test::distance_between(all.poses[c], all.true_poses[c]) < 1e-5);
}

TEST_CASE("The covariance of a self-calibration is that of its errors") {
  constexpr int runs = 20;
  double squared = 0.0;
  for (int run = 0; run != runs; ++run) {
    images all = take_images(100 + static_cast<std::uint64_t>(run), 0.5, 1.0, run % 2 == 0 ? 1.0 : 0.4);
    for (auto& o : all.observations) o.information *= 2.0;  // the noise is estimated: the absolute value has no effect
    for (std::size_t k = 3; k < all.observations.size(); k += 50) all.observations[k].pixel += vec2(20, -15);
    const auto found = calibrate(wrong_lens(1.02, 0.98), all, {.bf = bf, .free = to_p2, .keeps_aspect = false});
    REQUIRE(found);
    CHECK(found->outliers >= all.observations.size() / 50);
    const auto p = parameters_of<lens>::get(found->camera), expected = parameters_of<lens>::get(truth);
    for (int i = 0; i != 8; ++i) {
      const double e = p[i] - expected[i], variance = found->covariance(i, i);
      CHECK(e * e < 25.0 * variance);
      squared += e * e / variance / (8.0 * runs);
    }
    for (int i = 8; i != 12; ++i) CHECK(found->covariance.row(i).isZero());
  }
  INFO(squared);
  CHECK(squared > 0.7);
  CHECK(squared < 1.5);
}

TEST_CASE("A known ratio of the focal lengths is kept, and what is not free stays") {
  images all = take_images(6, 0.3);
  auto p = parameters_of<lens>::get(truth);
  p[0] *= 1.03;
  p[1] *= 1.03;
  const auto found =
      calibrate(*parameters_of<lens>::with(truth, p), all, {.bf = bf, .free = 0x3, .keeps_aspect = true});
  REQUIRE(found);
  const auto q = parameters_of<lens>::get(found->camera);
  CHECK(q[0] / q[1] == Approx(truth.k().fx / truth.k().fy).epsilon(1e-12));
  CHECK(std::abs(q[0] - truth.k().fx) < 1.0);
  CHECK(found->covariance(0, 1) == Approx(std::sqrt(found->covariance(0, 0) * found->covariance(1, 1))));
  for (int i = 2; i != 12; ++i) CHECK(q[i] == p[i]);
}

TEST_CASE("Self-calibration says why it cannot be, and leaves poses and points alone") {
  const images whole = take_images(7, 0.3);
  const auto why = [&](images all, const progress& callback = {}) {
    const auto before = all.points;
    const auto found = calibrate(truth, all, {.bf = bf, .free = to_p2}, callback);
    CHECK(all.points == before);
    REQUIRE_FALSE(found);
    return found.error().code;
  };
  images none = whole, lost = whole, flat = whole;
  none.observations.clear();
  CHECK(why(none) == errc::no_data);
  lost.observations[4].point = 300;
  CHECK(why(lost) == errc::invalid_argument);
  for (auto& o : flat.observations) o.right = std::nan("");
  CHECK(why(flat) == errc::degenerate);
  CHECK(why(take_images(7, 0.3), [](std::size_t, std::size_t) { return false; }) == errc::cancelled);
  images broken = whole;
  for (auto& o : broken.observations) o.pixel.x() = std::nan("");
  CHECK(why(broken) == errc::no_data);
}

TEST_CASE("Images that hardly see anything, or nothing of the others, do not keep a camera from being calibrated") {
  images all = take_images(9, 0.3);
  const auto alone = calibrate(truth, all, {.bf = bf, .free = 0xf});
  REQUIRE(alone);
  images more = take_images(9, 0.3), apart = take_images(10, 0.3);
  const auto p = static_cast<std::uint32_t>(more.points.size());
  for (int i = 0; i != 4; ++i) more.poses.push_back(more.poses[static_cast<std::size_t>(i)]);
  more.observations.push_back({.pose = 15, .point = 0, .pixel = vec2(100, 100)});
  for (std::uint32_t k = 0; k != 30; ++k)  // nothing of it is right
    more.observations.push_back(
        {.pose = 16, .point = k, .pixel = vec2(20.0 * k, 300.0 - 9.0 * k), .information = 11.0});
  for (const auto& o : apart.observations) {  // two images of another place
    if (o.pose > 1 || o.point > 40) continue;
    more.observations.push_back(o);
    more.observations.back().pose += 17;
    more.observations.back().point += p;
  }
  more.points.insert(more.points.end(), apart.points.begin(), apart.points.begin() + 41);
  const se3 before = more.poses[17];
  const auto found = calibrate(truth, more, {.bf = bf, .free = 0xf});
  REQUIRE(found);
  const auto a = parameters_of<lens>::get(alone->camera), b = parameters_of<lens>::get(found->camera);
  for (int i = 0; i != 4; ++i) {
    CHECK(std::abs(a[i] - b[i]) < std::sqrt(alone->covariance(i, i)));
    CHECK(found->covariance(i, i) < 1.5 * alone->covariance(i, i));
  }
  CHECK(test::distance_between(more.poses[17], before) == 0.0);
}

TEST_CASE("A camera that never moved is not known better afterwards") {
  images still = take_images(8, 0.3, 0.0), moved = take_images(8, 0.3);
  const auto nothing = calibrate(truth, still, {.bf = bf, .free = 0xf});
  const auto something = calibrate(truth, moved, {.bf = bf, .free = 0xf});
  REQUIRE(something);
  if (nothing) CHECK(nothing->covariance(0, 0) > 100.0 * something->covariance(0, 0));
  if (!nothing) CHECK(nothing.error().code == errc::degenerate);
}

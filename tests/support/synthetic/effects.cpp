// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <set>

#include "support/catch.hpp"
#include "support/synthetic/effects.hpp"
#include "support/synthetic/read_ahead.hpp"

using namespace orbis;
using namespace orbis;
using namespace orbis::io;
using namespace orbis::io::detail::synthetic;
using namespace orbis::test;

namespace {

/// Frames that can be told apart: grey level and depth tell the index.
struct counted_frames {
  std::size_t count = 90;

  [[nodiscard]] std::size_t size() const { return count; }
  [[nodiscard]] double timestamp(std::size_t i) const { return 50.0 + static_cast<double>(i) / 30.0; }
  [[nodiscard]] camera::camera_settings camera() const { return {.model = camera::pinhole{usual_intrinsics(8, 6)}}; }
  [[nodiscard]] se3 T_world_camera(std::size_t i) const { return {so3{}, vec3(static_cast<double>(i), 0.0, 0.0)}; }
  [[nodiscard]] result<camera::rgbd_frame> frame(std::size_t i) const {
    if (i >= count) return fail(errc::invalid_argument, "frame", "none");
    const auto grey = static_cast<std::uint8_t>(20 + i);
    return camera::rgbd_frame{.timestamp = timestamp(i),
                              .color = image<rgb8>(8, 6, {grey, grey, grey}),
                              .depth = image<std::uint16_t>(8, 6, static_cast<std::uint16_t>(1000 + i)),
                              .T_world_camera = T_world_camera(i)};
  }
};
static_assert(posed_sequence<counted_frames> && posed_sequence<selection<counted_frames>>);

std::size_t index_of(const camera::rgbd_frame& f) { return f.depth(3, 3) - 1000U; }

}  // namespace

TEST_CASE("a thinned sequence has every n-th frame, at its own time and place") {
  const auto third = every_nth(counted_frames{}, 3);
  REQUIRE(third.size() == 30);
  CHECK(third.camera().fps == Approx(10.0));
  for (std::size_t i = 0; i != third.size(); ++i) {
    const auto f = third.frame(i).value();
    CHECK(index_of(f) == 3 * i);
    CHECK(f.timestamp == counted_frames{}.timestamp(3 * i));
    CHECK(third.timestamp(i) == f.timestamp);
    CHECK(third.T_world_camera(i).translation().x() == static_cast<double>(3 * i));
  }
  CHECK(third.frame(30).error().code == errc::invalid_argument);
}

TEST_CASE("a lower frame rate is kept in the mean whether or not it divides the old one") {
  CHECK(at_rate(counted_frames{}, 15.0).size() == 45);
  CHECK(at_rate(counted_frames{}, 10.0).index(7) == 21);
  const auto uneven = at_rate(counted_frames{}, 12.0);
  CHECK(uneven.size() == 36);
  CHECK(uneven.camera().fps == 12.0);
  for (std::size_t i = 0; i != uneven.size(); ++i) {
    const double late = uneven.timestamp(i) - 50.0 - static_cast<double>(i) / 12.0;
    CHECK(late > -1e-6);
    CHECK(late < 1.0 / 30.0);
  }
  CHECK(at_rate(counted_frames{}, 60.0).size() == 90);  // there are no more
  CHECK(at_rate(counted_frames{0}, 15.0).size() == 0);
}

TEST_CASE("frames can be cut out, with or without a gap in time") {
  const auto open = without(counted_frames{}, {51.0, 52.0});
  const auto closed = without(counted_frames{}, {51.0, 52.0}, gap::closed);
  REQUIRE(open.size() == 60);
  REQUIRE(closed.size() == 60);
  for (std::size_t i = 0; i != 60; ++i) {
    const std::size_t from = i < 30 ? i : i + 30;
    CHECK(index_of(open.frame(i).value()) == from);
    CHECK(open.timestamp(i) == counted_frames{}.timestamp(from));
    const auto f = closed.frame(i).value();
    CHECK(index_of(f) == from);
    CHECK(f.timestamp == Approx(counted_frames{}.timestamp(i)));
    CHECK(closed.T_world_camera(i).translation().x() == static_cast<double>(from));
    CHECK(f.T_world_camera->translation().x() == static_cast<double>(from));
  }
  const auto middle = during(counted_frames{}, {51.0, 52.0});
  REQUIRE(middle.size() == 30);
  CHECK(index_of(middle.frame(0).value()) == 30);
  CHECK(without(counted_frames{}, {0.0, 51.0}, gap::closed).timestamp(0) == Approx(51.0));  // nothing before the cut
}

TEST_CASE("pictures and depth are black in the dark and whole around it") {
  const counted_frames bright;
  const auto dark = blacked_out(bright, {51.0, 52.0});
  const auto blind = without_depth(bright, {51.0, 52.0});
  REQUIRE(dark.size() == bright.size());
  for (std::size_t i = 0; i != dark.size(); ++i) {
    const auto f = dark.frame(i).value(), original = bright.frame(i).value(), g = blind.frame(i).value();
    const bool is_dark = i >= 30 && i < 60;
    CHECK((f.color == (is_dark ? image<rgb8>(8, 6) : original.color)));
    CHECK((f.depth == (is_dark ? image<std::uint16_t>(8, 6) : original.depth)));
    CHECK((g.color == original.color));
    CHECK((g.depth == f.depth));
    CHECK(f.timestamp == original.timestamp);
    CHECK(dark.T_world_camera(i).translation() == bright.T_world_camera(i).translation());
  }
}

TEST_CASE("exposure jumps between its bounds, holds for a while, and spares depth") {
  const exposure_options options{.lowest = 0.5, .highest = 1.8, .offset = 0.0, .hold = 0.5, .seed = 3};
  const auto jumping = with_exposure(counted_frames{}, options);
  double lowest = 9.0, highest = 0.0;
  std::set<int> levels;
  for (int k = 0; k != 400; ++k) {
    const auto curve = exposure_curve(options, 0.5 * k + 0.01), later = exposure_curve(options, 0.5 * k + 0.49);
    CHECK(curve == later);
    CHECK(std::is_sorted(curve.begin(), curve.end()));
    lowest = std::min(lowest, curve[100] / 100.0);
    highest = std::max(highest, curve[100] / 100.0);
    levels.insert(curve[100]);
  }
  CHECK(lowest == Approx(0.5).margin(0.02));
  CHECK(highest == Approx(1.8).margin(0.02));
  CHECK(levels.size() > 50);
  for (std::size_t i = 0; i != 90; ++i) {
    const auto f = jumping.frame(i).value();
    CHECK(index_of(f) == i);
    CHECK(f.color(2, 2).g == exposure_curve(options, f.timestamp - 50.0)[20 + i]);
  }
  const auto shifted = exposure_curve({.lowest = 1.0, .highest = 1.0, .offset = 20.0}, 0.0);
  CHECK(shifted[100] != 100);
  CHECK(std::abs(shifted[100] - 100) <= 20);
  CHECK(exposure_curve({.lowest = 1.8, .highest = 1.8, .offset = 0.0}, 0.0)[200] == 255);
}

TEST_CASE("effects go one on the other, and keep the truth") {
  const auto hard = with_exposure(blacked_out(at_rate(without(counted_frames{}, {51.0, 51.5}), 15.0), {52.0, 52.2}));
  CHECK(hard.camera().fps == 15.0);
  const auto truth = ground_truth_of(hard);
  REQUIRE(truth.size() == hard.size());
  int dark = 0;
  for (std::size_t i = 0; i != hard.size(); ++i) {
    const auto f = hard.frame(i).value();
    CHECK(truth[i].timestamp == f.timestamp);
    CHECK(truth[i].T_world_camera.translation() == f.T_world_camera->translation());
    dark += f.depth(0, 0) == 0 ? 1 : 0;
  }
  CHECK(dark == 3);
}

TEST_CASE("frames made ahead are the frames, all of them, in their order") {
  for (const std::size_t depth : {1U, 4U}) {
    read_ahead frames{counted_frames{7}, depth};
    for (std::size_t i = 0; i != 7; ++i) {
      const auto f = frames.next();
      REQUIRE(f);
      CHECK(index_of(f->value()) == i);
    }
    CHECK_FALSE(frames.next());
  }
  CHECK_FALSE(read_ahead{counted_frames{0}}.next());
}

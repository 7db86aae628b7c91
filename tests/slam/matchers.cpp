// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <orbis/slam/matchers.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;

/// Has the number of words of `descriptor`, and another distance.
struct first_word {
  [[nodiscard]] std::uint32_t operator()(const descriptor& a, const descriptor& b) const noexcept {
    return a.words[0] == b.words[0] ? 0 : 1;
  }
};

struct without_landmarks {
  static constexpr auto motion = slam::orb_matchers::motion;
  static constexpr auto appearance = slam::orb_matchers::appearance;
};

static_assert(slam::tracking_matchers<slam::orb_matchers, descriptor>);
static_assert(!slam::tracking_matchers<slam::distance_matchers<first_word>, descriptor>);  // a map uses Hamming's
static_assert(!slam::tracking_matchers<without_landmarks, descriptor>);
static_assert(!slam::tracking_matchers<slam::orb_matchers, int>);

/// Three keypoints in a row, 100 pixels apart, whose descriptors have nothing in common.
features::features three_keypoints() {
  features::features f;
  for (std::uint64_t i = 0; i != 3; ++i) {
    f.keypoints.push_back({.x = 100.0F * static_cast<float>(i + 1), .y = 50.0F});
    f.descriptors.emplace_back();
    f.descriptors.back().words[i] = ~std::uint64_t{0};
  }
  return f;
}

}  // namespace

TEST_CASE("The matchers of tracking search where a point is expected, and appearance searches everywhere") {
  const features::features f = three_keypoints();
  const features::keypoint_grid grid{f.keypoints};
  const std::vector<features::window> windows{{102.0F, 51.0F, 5.0F}, {100.0F, 50.0F, 5.0F}, {298.0F, 50.0F, 5.0F}};
  const auto landmarks = slam::orb_matchers::landmarks(f.descriptors, f, windows, grid);
  REQUIRE(landmarks.size() == 2);  // the second one is expected where only another point is
  CHECK((landmarks[0].query == 0 && landmarks[0].train == 0 && landmarks[0].distance == 0));
  CHECK((landmarks[1].query == 2 && landmarks[1].train == 2));
  const features::feature_view<descriptor> seen{f.keypoints, f.descriptors};
  CHECK(slam::orb_matchers::motion(seen, f, windows, grid).size() == 2);
  CHECK(slam::orb_matchers::appearance(f, f).size() == 3);
}

TEST_CASE("Matches whose descriptors differ in too many bits are left out") {
  const features::features f = three_keypoints();
  features::features other = f;
  other.descriptors[0].words[3] = 0xffff;                                          // 16 bits
  other.descriptors[1].words[3] = 0xffffffffffff;                                  // 48 bits
  other.descriptors[2].words[3] = other.descriptors[2].words[0] = 0x1fffffffffff;  // 90 bits
  CHECK(slam::orb_matchers::appearance(f, other).size() == 2);
  using strict = slam::distance_matchers<features::hamming, 20, 20, 20>;
  CHECK(strict::appearance(f, other).size() == 1);
}

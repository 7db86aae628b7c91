// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>

#include "features/sources.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

orbis::features::features random_features(std::size_t count, std::uint64_t seed) {
  random_bits random{seed};
  orbis::features::features f;
  for (std::size_t i = 0; i != count; ++i) {
    keypoint k;
    k.x = static_cast<float>(random.uniform(-10.0, 650.0));
    k.y = static_cast<float>(random.uniform(0.0, 480.0));
    k.octave = static_cast<int>(random.below(8));
    f.keypoints.push_back(k);
    binary_descriptor<256> d;
    d.words[1] = random() & 0xff;  // few bits: many ties
    f.descriptors.push_back(d);
  }
  return f;
}

bool inside(const window& w, const keypoint& k) {
  const float dx = k.x - w.x;
  const float dy = k.y - w.y;
  return w.radius >= 0.0F && dx * dx + dy * dy <= w.radius * w.radius && k.octave >= w.min_octave &&
         k.octave <= w.max_octave;
}

}  // namespace

TEST_CASE("windowed matching equals a search through all trains with the windows tested") {
  const orbis::features::features q = random_features(200, 1);
  const orbis::features::features t = random_features(400, 2);
  random_bits random{5};
  std::vector<window> windows(q.size());
  for (window& w : windows)
    w = {static_cast<float>(random.uniform(0.0, 640.0)), static_cast<float>(random.uniform(0.0, 480.0)),
         static_cast<float>(random.uniform(-5.0, 90.0)), static_cast<int>(random.below(5)), 6};

  const auto source = windowed(hamming{});
  const auto found = test::candidates_of(source, as_view(q), as_view(t), {.reverse = true}, windows);

  std::vector<candidate> expected;
  for (std::uint32_t i = 0; i != q.size(); ++i) {
    candidate c{i, none, none, none, none};
    for (std::uint32_t j = 0; j != t.size(); ++j) {
      if (!inside(windows[i], t.keypoints[j])) continue;
      const auto d = hamming{}(q.descriptors[i], t.descriptors[j]);
      if (d < c.distance) {
        c.second_distance = c.distance;
        c.distance = d;
        c.train = j;
      } else {
        c.second_distance = std::min(c.second_distance, d);
      }
    }
    if (c.train != none) expected.push_back(c);
  }
  for (candidate& c : expected) {
    std::uint32_t nearest = none;
    for (std::uint32_t i = 0; i != q.size(); ++i) {
      const auto d = hamming{}(q.descriptors[i], t.descriptors[c.train]);
      if (inside(windows[i], t.keypoints[c.train]) && d < nearest) {
        nearest = d;
        c.reverse_query = i;
      }
    }
  }
  REQUIRE(expected.size() > 100);
  CHECK(found == expected);
}

TEST_CASE("a windowed chain takes windows and optionally a grid") {
  const orbis::features::features f = random_features(100, 1);
  std::vector<window> windows;
  for (const keypoint& k : f.keypoints) windows.push_back({k.x, k.y, 0.5F});
  windows[3] = {};
  constexpr auto matcher = windowed(hamming{}) | ratio_test{0.8f} | max_distance{100} | unique{};
  const auto matches = matcher(f.descriptors, f, windows);
  CHECK(matches.size() == 99);
  CHECK(matcher(f.descriptors, f, windows, keypoint_grid{f.keypoints}) == matches);
}

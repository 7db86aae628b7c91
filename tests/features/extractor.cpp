// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/brute_force-inl.hpp>
#include <orbis/features/extractor.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/orb-inl.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed-inl.hpp>

#include "features/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

/// Sixteen means of brightness around a pixel: no string of bits.
struct brightness_grid {
  std::array<float, 16> means{};
};
struct mean_difference {
  std::uint32_t operator()(const brightness_grid& a, const brightness_grid& b) const {
    float sum = 0.0F;
    for (std::size_t i = 0; i != a.means.size(); ++i) sum += std::abs(a.means[i] - b.means[i]);
    return static_cast<std::uint32_t>(sum);
  }
};
/// No direction, for cameras that do not roll.
struct upright {
  static constexpr int radius = 0;
  orientation operator()(image_view<const std::uint8_t>, int, int) const { return {}; }
};
struct grid_describer {
  using descriptor = brightness_grid;
  static constexpr int reach = 8, diameter = 16;
  struct workspace {
    image_view<const std::uint8_t> image;
  };
  static void prepare(image_view<const std::uint8_t> image, int, int, workspace& memory) { memory.image = image; }
  brightness_grid operator()(const workspace& memory, int x, int y, const orientation&) const {
    brightness_grid d;
    for (int v = -8; v != 8; ++v)
      for (int u = -8; u != 8; ++u)
        d.means[static_cast<std::size_t>((v + 8) / 4 * 4 + (u + 8) / 4)] +=
            static_cast<float>(memory.image(x + u, y + v)) / 16.0F;
    return d;
  }
};

struct no_extractor {
  int operator()(image_view<const rgb8>) const { return 0; }
};

}  // namespace

using grid_extractor = basic_orb_extractor<fast9, cover_first, upright, grid_describer>;
static_assert(feature_extractor<orb_extractor> && feature_extractor<grid_extractor> &&
              !feature_extractor<no_extractor>);
static_assert(std::same_as<extracted_descriptor<grid_extractor>, brightness_grid>);
static_assert(patch_descriptor<grid_describer> && !patch_descriptor<upright>);
static_assert(descriptor_distance<mean_difference, brightness_grid> && !descriptor_distance<hamming, brightness_grid>);

TEST_CASE("an extractor of one's own parts gives features that any matcher takes") {
  const auto im = test::moved(test::blocks(320, 240, 1), 0.2, 0, 0), shifted = test::moved(im, 0.0, 6, 3);
  const grid_extractor extract{{.max_features = 300}, {}, {.share = 0.0}};
  const auto f = extract(im), g = extract(shifted);
  REQUIRE((f.size() > 200 && g.size() > 200));
  const auto matches = (brute_force(mean_difference{}) | ratio_test{0.8F} | cross_check{})(f, g);
  REQUIRE(matches.size() > 60);
  std::size_t right = 0;
  for (const match& m : matches)
    right += std::abs(g.keypoints[m.train].x - f.keypoints[m.query].x - 6.0F) < 2.0F &&
             std::abs(g.keypoints[m.train].y - f.keypoints[m.query].y - 3.0F) < 2.0F;
  CHECK(right * 10 > matches.size() * 9);
}

TEST_CASE("corners are ordered by place, and by strength with ties by place") {
  const corner a{1, 1, 5.0F}, b{2, 1, 9.0F}, c{0, 2, 5.0F};
  CHECK((before_in_image(a, b) && before_in_image(b, c) && !before_in_image(c, a)));
  CHECK((stronger(b, a) && stronger(a, c) && !stronger(c, a) && !stronger(a, a)));
}

TEST_CASE("a region without pixels is empty") {
  CHECK((region{}.empty() && region{0, 0, -1, 5}.empty() && !region{-2, 3, 4, 2}.empty()));
}

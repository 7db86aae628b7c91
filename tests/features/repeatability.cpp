// SPDX-License-Identifier: BSD-3-Clause
#include "features/repeatability.hpp"

#include <cstdint>
#include <filesystem>
#include <vector>

#include <orbis/features/grey.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/io/image.hpp>

#include "features/images.hpp"
#include "features/opencv_orb.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

/// As many features as OpenCV's ORB finds in the image.
orbis::features::features ours(const image<std::uint8_t>& im, std::size_t count) {
  return orb_extractor{{.max_features = static_cast<int>(count)}}(im);
}

struct result {
  double coverage = 0.0;
  test::found_again again{};
};

/// Means over images and changes: ours, OpenCV's.
std::pair<result, result> means(const std::vector<image<std::uint8_t>>& images) {
  std::pair<result, result> mean;
  for (const auto& im : images) {
    const auto changes = test::changes_of(im);
    const auto theirs = test::found_by_opencv(im), own = ours(im, theirs.size());
    const auto add = [&](result& to, const auto& f, const auto& g, const test::changed_image& c) {
      const auto n = static_cast<double>(images.size() * changes.size());
      const test::found_again again = test::compared(f, g, c.map, im.width(), im.height());
      to.again.repeatability += again.repeatability / n;
      to.again.matching_score += again.matching_score / n;
      to.coverage += test::coverage(f, im.width(), im.height()) / n;
    };
    for (const auto& c : changes) {
      const auto theirs_there = test::found_by_opencv(c.pixels);
      add(mean.first, own, ours(c.pixels, theirs_there.size()), c);
      add(mean.second, theirs, theirs_there, c);
    }
  }
  return mean;
}

void check_better(const std::vector<image<std::uint8_t>>& images) {
  const auto [own, theirs] = means(images);
  INFO("coverage " << own.coverage << " against " << theirs.coverage << ", repeatability " << own.again.repeatability
                   << " against " << theirs.again.repeatability << ", matching score " << own.again.matching_score
                   << " against " << theirs.again.matching_score);
  CHECK(own.coverage > 1.3 * theirs.coverage);
  CHECK(own.again.repeatability >= theirs.again.repeatability);
  CHECK(own.again.matching_score >= theirs.again.matching_score);
}

}  // namespace

TEST_CASE("homographies are undone by their inverses") {
  const test::homography map{{1.05, 0.1, -30, -0.05, 1.1, 10, 1.5e-4, 2e-4, 1}};
  const auto p = map(100, 200), q = map.inverse()(p[0], p[1]);
  CHECK((q[0] == Approx(100) && q[1] == Approx(200)));
  CHECK(test::homography::similarity(0.7, 1.3, 5, 6).scale_at(50, 70) == Approx(1.3));
}

TEST_CASE("identical images have all of their features found again") {
  const auto im = test::moved(test::blocks(320, 240, 1), 0.3, 0, 0);
  const auto f = ours(im, 300);
  const auto again = test::compared(f, f, {}, 320, 240);
  CHECK(again.repeatability == 1.0);
  CHECK(again.matching_score > 0.95);
}

TEST_CASE("ORB features of the kitchen spread further than OpenCV's and are found again as often") {
  ORBIS_NEEDS_DATA("kitchen");
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(test::data_dir() / "kitchen" / "rgb"))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<image<std::uint8_t>> images;
  for (std::size_t i = 40; i < files.size(); i += 115) {
    const auto color = io::read_color(files[i]).value();
    images.emplace_back(color.width(), color.height());
    luma(color, images.back());
  }
  REQUIRE(images.size() >= 4);
  check_better(images);
}

TEST_CASE("ORB features of synthetic pictures spread further than OpenCV's and are found again as often") {
  // Rich parts beside poor ones, some noise: OpenCV's features gather in the rich ones.
  std::vector<image<std::uint8_t>> images;
  for (std::uint64_t seed = 1; seed != 4; ++seed) {
    auto im = test::moved(test::blocks(640, 480, seed), 0.2, 0, 0);
    random_bits random{seed};
    for (int y = 0; y != im.height(); ++y)
      for (int x = 0; x != im.width(); ++x) {
        const bool rich = mix64(seed + static_cast<std::uint64_t>((y / 96) * 100 + x / 96)) % 3 == 0;
        const int contrast = rich ? 100 : 35;
        im(x, y) =
            static_cast<std::uint8_t>(110 + (im(x, y) - 110) * contrast / 100 + static_cast<int>(random.below(5)));
      }
    images.push_back(std::move(im));
  }
  check_better(images);
}

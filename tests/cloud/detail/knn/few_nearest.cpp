// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/cloud/detail/knn/few_nearest.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/core/random.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using namespace orbis::cloud::detail;
using orbis::simd::level;

namespace {

/// The squared distances of the other points, with their indices, in order.
std::vector<std::pair<float, std::uint32_t>> others_of(const orbis::test::points& cloud, std::uint32_t self) {
  std::vector<std::pair<float, std::uint32_t>> out;
  for (std::uint32_t j = 0; j != cloud.size(); ++j)
    if (j != self && orbis::test::finite(cloud[j])) out.emplace_back(orbis::test::squared(cloud[self], cloud[j]), j);
  std::sort(out.begin(), out.end());
  return out;
}

struct tally {
  int right = 0;   ///< rows that had to be right
  int beyond = 0;  ///< rows whose last is beyond the bound
  int none = 0;    ///< rows that were not found
};

/// Compares the rows of some points of each leaf with brute force.
template <std::size_t Width>
tally compare(const orbis::test::points& cloud, std::uint64_t seed) {
  constexpr float most = std::numeric_limits<float>::max();
  // As `all_knn` does, of identical points no more than there is use for.
  leaf_hierarchy tree = make_leaves(orbis::seq, cloud, Width + 1);
  // Indices as of a cloud of up to 2^32 points, in the same order.
  const auto spread = (few_rows<Width>::none - 1) / static_cast<std::uint32_t>(std::max<std::size_t>(cloud.size(), 1));
  for (std::uint32_t& index : tree.members) index *= spread;
  const knn_kernels kernels;
  orbis::random_bits random{seed};
  tally seen;
  nearby_leaves near{std::max<std::size_t>(tree.leaves.size(), 1) + 2 * leaf_width};
  for (std::size_t l = 0; l < tree.leaves.size(); ++l) {
    const std::size_t size = tree.size_of(l);
    const std::size_t first = random.below(static_cast<std::uint32_t>(size));
    const std::size_t last = first + 1 + random.below(static_cast<std::uint32_t>(size - first));
    const auto nearest = others_of(cloud, tree.members[l * leaf_width + first] / spread);
    float bound = most;
    if (random.below(4) != 0 && !nearest.empty())
      bound = nearest[random.below(static_cast<std::uint32_t>(std::min<std::size_t>(nearest.size(), 12)))].first;
    near.count = 0;
    for (std::size_t row = 0; row != tree.levels[0].size(); ++row) {
      const box_row& boxes = tree.levels[0][row];
      std::uint32_t mask = 0;
      for (std::size_t i = 0; i != leaf_width && row * leaf_width + i < tree.leaves.size(); ++i) mask |= 1U << i;
      kernels.gather(boxes, mask, static_cast<std::uint32_t>(row * leaf_width), near);
    }
    near.finish();
    few_rows<Width> rows;
    few_nearest_kernel<Width>()(tree, near, l, first, last, bound, rows);
    for (std::size_t i = first; i != last; ++i) {
      const std::uint32_t self = tree.members[l * leaf_width + i] / spread;
      const auto expected = others_of(cloud, self);
      const float furthest = rows.squared[Width - 1][i];
      if (rows.index[Width - 1][i] == few_rows<Width>::none) {
        ++seen.none;
      } else if (furthest <= bound) {
        ++seen.right;
        for (std::size_t n = 0; n != Width; ++n) {
          CHECK(rows.squared[n][i] == expected[n].first);
          CHECK(rows.index[n][i] == expected[n].second * spread);
        }
      } else {
        ++seen.beyond;
        for (std::size_t n = 0; n != Width; ++n) {
          const std::uint32_t other = rows.index[n][i] / spread;
          REQUIRE(other < cloud.size());
          CHECK(rows.squared[n][i] == orbis::test::squared(cloud[self], cloud[other]));
          CHECK(rows.squared[n][i] >= expected[n].first);
        }
      }
    }
  }
  return seen;
}

}  // namespace

TEST_CASE("the very nearest points are those of brute force, equal ones by index, with every instruction set") {
  auto clouds = orbis::test::all_clouds();
  for (auto& hard : orbis::test::hard_clouds()) clouds.push_back(std::move(hard));
  for (const level l : {level::portable, level::avx2, level::avx512}) {
    const orbis::simd::level_limit limit{l};
    tally all;
    for (const auto& [name, cloud] : clouds) {
      INFO(name << " level " << static_cast<int>(l));
      for (const tally& one :
           {compare<1>(cloud, 1), compare<2>(cloud, 2), compare<3>(cloud, 3), compare<4>(cloud, 4)}) {
        all.right += one.right;
        all.beyond += one.beyond;
        all.none += one.none;
        if (name == "uniform" || name == "room") CHECK(one.none == 0);
      }
    }
    CHECK(all.right > 10'000);
    CHECK(all.beyond > 1'000);
    CHECK(all.none > 10);
  }
}

TEST_CASE("a leaf that is too small for the rows, and more points that are as near than there is room for, are told") {
  orbis::test::points ring;  // most of it is as near to the middle as what shares a leaf with that
  for (int i = 0; i != 600; ++i)
    ring.emplace_back(std::cos(0.1F * static_cast<float>(i)), std::sin(0.1F * static_cast<float>(i)), 0.0F);
  ring.emplace_back(0.0F, 0.0F, 0.0F);
  for (const level l : {level::portable, level::avx2, level::avx512}) {
    const orbis::simd::level_limit limit{l};
    CHECK(compare<1>({ring.end() - 1, ring.end()}, 5).none == 1);
    CHECK(compare<2>({ring.begin(), ring.begin() + 2}, 5).right == 0);
    tally all;
    for (std::uint64_t seed = 0; seed != 8; ++seed) {
      const tally one = compare<1>(ring, seed);
      all.right += one.right;
      all.none += one.none;
    }
    CHECK(all.right > 500);
    CHECK(all.none > 0);
    CHECK(all.none <= 8);  // the middle alone
  }
}

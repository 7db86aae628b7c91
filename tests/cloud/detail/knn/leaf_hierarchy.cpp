// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/simd.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::detail::leaf_hierarchy;
using orbis::cloud::detail::leaf_width;
using orbis::cloud::detail::make_leaves;

TEST_CASE("every finite point is in one leaf, within the boxes above it, or is a copy too many") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    for (const std::size_t copies : {1U, 9U, 51U}) {
      INFO(name << " copies " << copies);
      const leaf_hierarchy tree = make_leaves(orbis::par.with(2), orbis::cloud::detail::viewed_points{cloud}, copies);
      std::vector<int> seen(cloud.size(), 0);
      bool in_place = true;
      bool in_boxes = true;
      for (std::size_t l = 0; l != tree.leaves.size(); ++l) {
        for (std::size_t i = 0; i != tree.leaf_size(l); ++i) {
          const std::uint32_t member = tree.members[l * leaf_width + i];
          ++seen[member];
          std::size_t child = l;
          for (std::size_t a = 0; a != 3; ++a) {
            in_place = in_place && tree.leaves[l].axis[a][i] == cloud[member][static_cast<Eigen::Index>(a)];
          }
          for (const auto& level : tree.levels) {
            const auto& boxes = level[child / leaf_width];
            for (std::size_t a = 0; a != 3; ++a) {
              const float x = tree.leaves[l].axis[a][i];
              in_boxes = in_boxes && boxes.low[a][child % leaf_width] <= x && x <= boxes.high[a][child % leaf_width];
            }
            child /= leaf_width;
          }
        }
      }
      CHECK(in_place);
      CHECK(in_boxes);
      if (!tree.leaves.empty()) CHECK(tree.levels.back().size() == 1);
      for (const auto& [i, kept] : tree.left_out) {
        ++seen[i];
        std::size_t same = 0;
        while (same != copies && cloud[tree.members[kept + same]] == cloud[i]) ++same;
        CHECK(same == copies);
      }
      std::size_t finite = 0;
      for (std::size_t i = 0; i != cloud.size(); ++i) {
        CHECK(seen[i] == (orbis::test::finite(cloud[i]) ? 1 : 0));
        finite += orbis::test::finite(cloud[i]) ? 1 : 0;
      }
      CHECK(tree.finite == finite);
    }
  }
}

TEST_CASE("leaves follow the density wherever it is") {
  // Ten thousand points in a millimetre, and one a thousand kilometres away: one cell of any grid.
  auto cloud = orbis::test::uniform_cloud(10'000, 1, 1e-3);
  cloud.emplace_back(1e6F, 0.0F, 0.0F);
  const leaf_hierarchy tree = make_leaves(orbis::seq, orbis::cloud::detail::viewed_points{cloud}, 51);
  double volume = 0;
  for (std::size_t l = 0; l != tree.leaves.size(); ++l) {
    const auto& boxes = tree.levels[0][l / leaf_width];
    std::array<double, 3> side{};
    for (std::size_t a = 0; a != 3; ++a) {
      side[a] = double{boxes.high[a][l % leaf_width]} - double{boxes.low[a][l % leaf_width]};
    }
    if (side[0] < 1) volume += side[0] * side[1] * side[2];
  }
  CHECK(volume < 2e-9);  // the cube's is 1e-9
}

TEST_CASE("copies too many are those that share a cell") {
  std::vector<orbis::vec3f> cloud(1000, orbis::vec3f{1.0F, 2.0F, 3.0F});
  const auto others = orbis::test::uniform_cloud(300, 2);
  cloud.insert(cloud.end(), others.begin(), others.end());
  const leaf_hierarchy tree = make_leaves(orbis::seq, orbis::cloud::detail::viewed_points{cloud}, 51);
  CHECK(tree.left_out.size() == 949);
  CHECK(tree.in_leaves == 351);
  CHECK(tree.finite == 1300);
}

TEST_CASE("keys of many cells are those of a curve that goes from each cell to a neighbour") {
  using orbis::cloud::detail::curve_block;
  std::vector<std::array<std::uint32_t, 4>> cells;  // key, cell
  const auto block = std::make_unique<curve_block>();
  for (std::uint32_t first = 0; first != 4096; first += curve_block::size) {
    for (std::uint32_t i = 0; i != curve_block::size; ++i) {
      const std::uint32_t n = first + i;
      block->axis[0][i] = n & 15U;
      block->axis[1][i] = n >> 4U & 15U;
      block->axis[2][i] = n >> 8U;
    }
    const auto cube = *block;
    const auto fill_keys = [](curve_block& b) {
      orbis::simd::kernel<orbis::cloud::detail::fill_curve_keys, void(curve_block&)>()(b);
    };
    fill_keys(*block);
    for (const orbis::simd::level level : orbis::simd::available_levels()) {
      const orbis::simd::level_limit limit{level};
      auto again = cube;
      fill_keys(again);
      CHECK(again.key == block->key);
    }
    for (std::size_t i = 0; i != curve_block::size; ++i) {
      cells.push_back({block->key[i], cube.axis[0][i], cube.axis[1][i], cube.axis[2][i]});
    }
  }
  std::sort(cells.begin(), cells.end());
  std::size_t jumps = 0;
  for (std::size_t i = 1; i != cells.size(); ++i) {
    std::uint32_t steps = 0;
    for (std::size_t a = 1; a != 4; ++a) {
      steps += std::max(cells[i][a], cells[i - 1][a]) - std::min(cells[i][a], cells[i - 1][a]);
    }
    if (steps != 1) ++jumps;
  }
  CHECK(cells.back()[0] == 4095);
  CHECK(jumps == 0);
}

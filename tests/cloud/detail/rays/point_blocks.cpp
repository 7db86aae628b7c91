// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/ray_evidence_counter-inl.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

using orbis::cloud::detail::make_point_blocks;
using orbis::cloud::detail::point_blocks;

TEST_CASE("blocks hold every finite point once, within their boxes") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    INFO(name);
    const point_blocks blocks = make_point_blocks(orbis::par.with(3), orbis::cloud::detail::viewed_points{cloud});
    std::vector<std::uint32_t> finite;
    for (std::uint32_t i = 0; i != cloud.size(); ++i) {
      if (cloud[i].allFinite()) finite.push_back(i);
    }
    auto index = blocks.index;
    std::sort(index.begin(), index.end());
    CHECK(index == finite);
    const std::size_t count = (finite.size() + point_blocks::block_size - 1) / point_blocks::block_size;
    REQUIRE(blocks.blocks.size() == count);
    REQUIRE(blocks.groups.size() == (count + point_blocks::group_size - 1) / point_blocks::group_size);
    REQUIRE(blocks.axis[0].size() == count * point_blocks::block_size);
    std::size_t wrong = 0;
    for (std::size_t a = 0; a != 3; ++a) {
      for (std::size_t i = 0; i != blocks.axis[a].size(); ++i) {
        const float x = blocks.axis[a][i];
        if (i >= blocks.index.size()) {
          wrong += std::isnan(x) ? 0 : 1;
          continue;
        }
        wrong += x == cloud[blocks.index[i]][static_cast<Eigen::Index>(a)] ? 0 : 1;
        const std::size_t block = i / point_blocks::block_size;
        for (const auto& box : {blocks.blocks[block], blocks.groups[block / point_blocks::group_size]})
          wrong += box.low[a] <= x && x <= box.high[a] ? 0 : 1;
      }
    }
    CHECK(wrong == 0);
    const point_blocks alone = make_point_blocks(orbis::seq, orbis::cloud::detail::viewed_points{cloud});
    CHECK(alone.index == blocks.index);
  }
}

TEST_CASE("blocks of a shuffled cloud are small, one wild point or not") {
  auto cloud = orbis::test::uniform_cloud(100'000, 3);
  const auto mean_volume = [](const point_blocks& blocks) {
    double sum = 0;
    for (const auto& box : blocks.blocks)
      sum += static_cast<double>(box.high[0] - box.low[0]) * (box.high[1] - box.low[1]) * (box.high[2] - box.low[2]);
    return sum / static_cast<double>(blocks.blocks.size());
  };
  // A cube with 128 of the 100,000 points has 1/781 of the volume.
  CHECK(mean_volume(make_point_blocks(orbis::seq, orbis::cloud::detail::viewed_points{cloud})) < 5.0 / 781);
  cloud.emplace_back(1e6F, -1e6F, 2e5F);
  auto blocks = make_point_blocks(orbis::seq, orbis::cloud::detail::viewed_points{cloud});
  std::erase_if(blocks.blocks, [](const auto& box) { return box.high[0] > 1e5F; });
  CHECK(blocks.blocks.size() > 700);
  CHECK(mean_volume(blocks) < 0.2);
}

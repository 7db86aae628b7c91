// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/cloud/detail/rays/depth_rows.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>

#include "support/catch.hpp"

using namespace orbis::cloud::detail;

TEST_CASE("rows of depths are what the depth image says, on every instruction set") {
  orbis::random_bits random{3};
  orbis::image<std::uint16_t> stored(75, 2);
  for (int y = 0; y != 2; ++y)
    for (std::uint16_t& d : stored.row(y))
      d = static_cast<std::uint16_t>(random.below(6) == 0 ? 0 : random.below(65536));
  stored(3, 1) = 65535;
  const orbis::camera::depth_view depth{stored.view(), 5000.0};
  for (const auto level : orbis::simd::available_levels()) {
    const orbis::simd::level_limit limit{level};
    const depth_row_kernels kernels;
    std::vector<float> row(75, -1.0F);
    read_depth_row(kernels, depth, 1, row.data());
    for (int x = 0; x != 75; ++x) CHECK(row[static_cast<std::size_t>(x)] == (depth(x, 1) > 0.0F ? depth(x, 1) : 0.0F));

    std::vector<float> low = row, high = row;
    kernels.widen_range(low.data(), high.data(), row.data() + 1, row.data() + 1, 74);
    kernels.replace_zeros(row.data(), 9.0F, row.size());
    for (std::size_t x = 0; x != 74; ++x) {
      CHECK(low[x] <= high[x]);
      CHECK(row[x] > 0.0F);
    }
  }
}

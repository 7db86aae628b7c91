// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <orbis/features/detail/extract/binomial.hpp>

#include "features/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features::detail;

TEST_CASE("the binomial mean of three rows is that of each pixel, at every level and for any length") {
  const auto im = test::noise(200, 3, 1);
  for (const auto level : simd::available_levels()) {
    const simd::level_limit limit{level};
    for (const int count : {0, 1, 15, 16, 17, 33, 63, 64, 65, 129, 200}) {
      std::vector<std::uint8_t> to(static_cast<std::size_t>(count) + 1, 99), expected;
      simd::kernel<binomial_kernel, binomial_kernel::signature>()(&im(0, 0), &im(0, 1), &im(0, 2), count, to.data());
      for (int x = 0; x != count; ++x)
        expected.push_back(static_cast<std::uint8_t>((im(x, 0) + 2 * im(x, 1) + im(x, 2) + 2) / 4));
      expected.push_back(99);
      CHECK(to == expected);
    }
  }
}

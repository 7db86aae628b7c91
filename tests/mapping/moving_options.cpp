// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/mapping/moving_options.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("the difference of equal depths grows with the square of the depth") {
  const mapping::moving_filter_options options{.margin = 0.25F, .margin_growth = 0.5F};
  CHECK(mapping::detail::depth_margin(options, 0.0F) == 0.25F);
  CHECK(mapping::detail::depth_margin(options, 2.0F) == 2.25F);
  const mapping::moving_filter_options usual;
  CHECK(mapping::detail::depth_margin(usual, 4.0F) < 0.2F);  // 4 m away, a person is thicker
}

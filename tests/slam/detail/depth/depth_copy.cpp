// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <utility>

#include <orbis/slam/detail/depth/depth_copy.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// Checks that a copy gives the depths of a source.
template <class Depth>
void check_copy(const slam::detail::depth_copy& copy, const Depth& depth) {
  copy.visit([&](const auto& kept) {
    REQUIRE(kept.width() == depth.width());
    REQUIRE(kept.height() == depth.height());
    for (int y = 0; y != depth.height(); ++y)
      for (int x = 0; x != depth.width(); ++x) CHECK(kept(x, y) == depth(x, y));
  });
}

}  // namespace

TEST_CASE("A copy of a depth image has its depths, whatever it held before") {
  image<std::uint16_t> stored(4, 3);
  for (int y = 0; y != 3; ++y)
    for (int x = 0; x != 4; ++x) stored(x, y) = static_cast<std::uint16_t>(700 * (4 * y + x));
  const camera::depth_view<std::uint16_t> near{std::as_const(stored).view(), 1000.0, 1.0F, 5.0F};
  image<float> metres(5, 2, 1.5F);
  metres(2, 1) = 0.0F;
  const camera::depth_view<float> other{std::as_const(metres).view()};
  slam::detail::depth_copy copy;
  copy.assign(near);
  check_copy(copy, near);
  copy.assign(other);
  check_copy(copy, other);
  copy.assign(near);
  check_copy(copy, near);
}

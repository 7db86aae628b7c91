// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <type_traits>

#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>
#include <orbis/mapping/masked_depth.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// Depth that is computed, not stored.
struct plane {
  [[nodiscard]] static int width() { return 4; }
  [[nodiscard]] static int height() { return 3; }
  [[nodiscard]] float operator()(int x, int y) const { return 1.0F + static_cast<float>(x + 4 * y); }
};

}  // namespace

static_assert(std::is_same_v<camera::depth_pixel<camera::depth_view<std::uint16_t>>, std::uint16_t>);
static_assert(std::is_same_v<camera::depth_pixel<camera::depth_view<float>>, float>);
static_assert(camera::depth_source<plane> && std::is_same_v<camera::depth_pixel<plane>, float>);

TEST_CASE("a masked image has the stored values of its original, with the same meaning") {
  image<std::uint16_t> stored(4, 3, 2500);
  stored(3, 2) = 9000;
  const auto depth = camera::depth_view<std::uint16_t>{stored.view(), 5000.0}.within(0.1F, 1.0F);
  image<std::uint16_t> masked(4, 3, 0);
  masked(1, 1) = mapping::stored_depth(depth, 1, 1);
  masked(3, 2) = mapping::stored_depth(depth, 3, 2);
  CHECK(masked(1, 1) == 2500);
  CHECK(masked(3, 2) == 9000);  // out of range, but stored
  const auto view = mapping::view_like(depth, image_view<const std::uint16_t>(masked));
  CHECK(view(1, 1) == 0.5F);
  CHECK(view(0, 0) == 0.0F);
  CHECK(view(3, 2) == 0.0F);
}

TEST_CASE("depth that is computed is stored in metres") {
  CHECK(mapping::stored_depth(plane{}, 2, 1) == 7.0F);
  image<float> masked(4, 3, 0.0F);
  masked(2, 1) = mapping::stored_depth(plane{}, 2, 1);
  const auto view = mapping::view_like(plane{}, image_view<const float>(masked));
  CHECK(view(2, 1) == 7.0F);
  CHECK(view(0, 0) == 0.0F);
}

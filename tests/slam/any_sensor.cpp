// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include <orbis/camera/pinhole.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/any_sensor.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;
static_assert(slam::sensor<slam::any_sensor, descriptor>);
template <class... Images>
inline constexpr bool takes = slam::measures<slam::any_sensor, camera::pinhole, features::orb_extractor, Images...>;
static_assert(takes<image_view<const rgb8>, image_view<const rgb8>>);
static_assert(takes<image_view<const std::uint8_t>, image_view<const std::uint8_t>>);
static_assert(takes<image_view<const rgb8>, camera::depth_view<float>>);
static_assert(takes<image_view<const rgb8>>);
static_assert(takes<image_view<const std::uint8_t>>);
static_assert(!takes<camera::depth_view<float>>);

}  // namespace

TEST_CASE("Whether depth is needed to begin a map depends on the images that a system is given") {
  slam::frame f;
  f.features.keypoints.resize(150);
  f.features.descriptors.resize(150);
  f.depth.assign(150, 0.0F);
  CHECK(slam::measures_scale<slam::any_sensor>(slam::options{}));
  CHECK_FALSE(slam::measures_scale<slam::any_sensor>(slam::monocular_options()));
  CHECK(slam::measures_scale<slam::rgbd>(slam::monocular_options()));
  CHECK(slam::measures_scale<slam::stereo>(slam::options{}));
  CHECK_FALSE(slam::measures_scale<slam::monocular>(slam::options{}));
  CHECK(slam::any_sensor::begins_map(f, slam::monocular_options()) == 150);
  CHECK(slam::any_sensor::begins_map(f, slam::options{}) == 0);
  f.depth.assign(150, 1.0F);
  CHECK(slam::any_sensor::begins_map(f, slam::options{}) == 150);
}

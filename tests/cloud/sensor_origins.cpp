// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <orbis/cloud/sensor_origins.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

namespace {

/// A cloud that knows where it was seen from.
struct scan : std::vector<orbis::vec3f> {
  using std::vector<orbis::vec3f>::vector;
  std::optional<orbis::vec3> from;
};

}  // namespace

template <>
struct orbis::cloud::cloud_traits<scan> {
  static std::optional<vec3> sensor_origin(const scan& s) { return s.from; }
};

static_assert(orbis::cloud::cloud_with_sensor_origin<scan>);
static_assert(!orbis::cloud::cloud_with_sensor_origin<std::vector<orbis::vec3f>>);

using orbis::cloud::sensor_ranges;

TEST_CASE("the most specific origin counts") {
  scan cloud{{3, 4, 0}, {0, 0, 2}, {1, 1, 1}};
  for (const float range : sensor_ranges(orbis::seq, cloud)) CHECK(std::isnan(range));
  cloud.from = orbis::vec3{0, 0, 1};
  CHECK(sensor_ranges(orbis::seq, cloud)[1] == 1.0F);
  const orbis::vec3 common{0, 0, 0};
  CHECK(sensor_ranges(orbis::seq, cloud, {.common = common})[0] == 5.0F);
  const std::vector<float> given{7, 8, 9};
  CHECK(sensor_ranges(orbis::seq, cloud, {.common = common, .ranges = given}) == given);
}

TEST_CASE("a range that cannot be known is no number") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float inf = std::numeric_limits<float>::infinity();
  const std::vector<orbis::vec3f> cloud{{0, 0, 0}, {nan, 0, 0}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, inf, 0}};
  const std::vector<float> given{0, 1, nan, inf, -1, 1};
  const auto ranges = sensor_ranges(orbis::seq, cloud, {.ranges = given});
  CHECK(ranges[0] == 0.0F);
  for (std::size_t i = 1; i != 6; ++i) CHECK(std::isnan(ranges[i]));
  CHECK(sensor_ranges(orbis::par, std::vector<orbis::vec3f>{}, {.common = orbis::vec3{0, 0, 0}}).empty());
}

TEST_CASE("ranges are the same under every policy") {
  const auto cloud = orbis::test::uniform_cloud(20'000, 3);
  const orbis::vec3 origin{0.5, -1.0, 0.25};
  const auto alone = sensor_ranges(orbis::seq, cloud, {.common = origin});
  CHECK(sensor_ranges(orbis::par.with(3), cloud, {.common = origin}) == alone);
  for (std::size_t i = 0; i < cloud.size(); i += 999) {
    CHECK(alone[i] == Approx((cloud[i].cast<double>() - origin).norm()));
  }
}

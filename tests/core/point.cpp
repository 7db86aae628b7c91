// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <deque>
#include <limits>
#include <list>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>

#include "support/catch.hpp"

namespace {

struct xyz {
  float x, y, z;
};
struct xyz_padded {  // as PCL lays it out
  double x, y, z, padding;
};
struct integers {
  int x, y, z;
};
struct geographic {
  float easting, northing, height;
};
struct flat {
  float x, y;
};
class hidden {
  [[maybe_unused]] float x = 0;
  [[maybe_unused]] float y = 0;
  [[maybe_unused]] float z = 0;
};

}  // namespace

template <>
struct orbis::point_traits<geographic> {
  using scalar = float;
  static float x(const geographic& p) { return p.easting; }
  static float y(const geographic& p) { return p.northing; }
  static float z(const geographic& p) { return p.height; }
};

using namespace orbis;

TEST_CASE("coordinates are read from structs and arrays and Eigen vectors and a specialised trait") {
  const std::array<double, 3> expected{1.0, 2.0, 3.0};
  CHECK(coordinates<double>(xyz{1, 2, 3}) == expected);
  CHECK(coordinates<double>(xyz_padded{1, 2, 3, 9}) == expected);
  CHECK(coordinates<double>(Eigen::Vector3f{1, 2, 3}) == expected);
  CHECK(coordinates<double>(Eigen::Vector3d{1, 2, 3}) == expected);
  CHECK(coordinates<double>(Eigen::Vector4f{1, 2, 3, 9}) == expected);
  CHECK(coordinates<double>(std::array<float, 3>{1, 2, 3}) == expected);
  CHECK(coordinates<double>(geographic{1, 2, 3}) == expected);
  const float raw[3] = {1, 2, 3};
  CHECK(coordinates<double>(raw) == expected);
  const Eigen::Matrix3f columns = Eigen::Vector3f{1, 2, 3}.asDiagonal();
  CHECK(coordinates<double>(columns.col(1).eval()) == std::array<double, 3>{0, 2, 0});
  static_assert(std::is_same_v<point_scalar_t<xyz>, float>);
  static_assert(std::is_same_v<point_scalar_t<const Eigen::Vector3d&>, double>);
}

TEST_CASE("what has no three floating coordinates is not a point") {
  static_assert(point_like<xyz> && point_like<const geographic&>);
  static_assert(!point_like<flat> && !point_like<integers> && !point_like<hidden>);
  static_assert(!point_like<Eigen::Vector2f> && !point_like<std::array<double, 2>> && !point_like<float[2]>);
  static_assert(point_like<Eigen::VectorXf> && point_like<std::array<double, 3>> && point_like<float[3]>);
  static_assert(!point_like<int> && !point_like<std::string> && !point_like<std::vector<std::string>>);
}

TEST_CASE("clouds are sized random-access ranges of points") {
  static_assert(point_range<std::vector<xyz>> && point_range<const std::vector<Eigen::Vector3f>&>);
  static_assert(point_range<std::span<const geographic>> && point_range<std::deque<xyz>>);
  static_assert(point_range<decltype(point_cloud::points)>);
  static_assert(!point_range<std::list<xyz>> && !point_range<std::vector<int>> && !point_range<xyz>);
}

TEST_CASE("one coordinate that is not finite makes the point so") {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  CHECK(is_finite(xyz{1, 2, 3}));
  CHECK(!is_finite(xyz{nan, 2, 3}));
  CHECK(!is_finite(Eigen::Vector3f{1, inf, 3}));
  CHECK(!is_finite(geographic{1, 2, -inf}));
}

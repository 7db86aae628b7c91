// SPDX-License-Identifier: BSD-3-Clause
//
// The filters run on other people's containers as they are: the same result as on ours, and no copy.
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/interop/strided_points.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

using kept = std::vector<std::vector<std::uint32_t>>;

template <class Points>
[[nodiscard]] kept kept_of(const Points& points) {
  return {cloud::statistical_inliers(par, points, {.neighbors = 12}),
          cloud::radius_inliers(par, points, {.radius = 0.1, .min_neighbors = 8}),
          cloud::filter_automatically(par, points).inliers};
}

}  // namespace

TEST_CASE("columns and rows of Eigen's matrices are points in place") {
  const auto ours = test::uniform_cloud(2000, 61);
  const kept expected = kept_of(ours);
  CHECK(expected[0].size() < ours.size());
  CHECK(expected[1].size() < ours.size());

  const Eigen::Map<const Eigen::Matrix3Xf> map{ours.data()->data(), 3, 2000};
  CHECK(kept_of(map.colwise()) == expected);
  const Eigen::Matrix3Xf columns = map;
  CHECK(kept_of(columns.colwise()) == expected);
  const Eigen::MatrixX3f rows = map.transpose();
  CHECK(kept_of(rows.rowwise()) == expected);
  const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> doubles = rows.cast<double>();
  CHECK(kept_of(doubles.rowwise()) == expected);
  Eigen::MatrixXf homogeneous = Eigen::MatrixXf::Ones(4, 2000);
  homogeneous.topRows(3) = map;
  CHECK(kept_of(homogeneous.topRows<3>().colwise()) == expected);
  CHECK(kept_of(homogeneous.colwise()) == expected);  // the first three of four
}

TEST_CASE("points in records, planes and other containers are filtered in place") {
  const auto ours = test::uniform_cloud(2000, 62);
  const kept expected = kept_of(ours);
  std::vector<float> message(2000 * 8), planes(3 * 2000);  // as PointCloud2 has them; as a table has them
  for (std::size_t i = 0; i != 2000; ++i)
    for (std::size_t a = 0; a != 3; ++a)
      message[8 * i + a] = planes[2000 * a + i] = ours[i][static_cast<Eigen::Index>(a)];
  CHECK(kept_of(interop::strided_points{message.data(), 2000, {.point_stride = 8}}) == expected);
  CHECK(kept_of(interop::strided_points{planes.data(), 2000, {.point_stride = 1, .coordinate_stride = 2000}}) ==
        expected);
  CHECK(kept_of(std::span{ours}) == expected);
  CHECK(kept_of(std::deque<vec3f>{ours.begin(), ours.end()}) == expected);
  const auto packed = reinterpret_cast<const std::array<float, 3>*>(ours.data());
  CHECK(kept_of(std::span{packed, 2000}) == expected);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <limits>
#include <vector>

#include <Eigen/LU>
#include <Eigen/SVD>

#include <orbis/optimize/detail/minimal/horn.hpp>

#include "optimize/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::detail::find_best_rotation;

TEST_CASE("The best rotation is that of the singular value decomposition") {
  random_bits random(17);
  for (int trial = 0; trial != 500; ++trial) {
    mat3 products;
    for (int i = 0; i != 9; ++i) products(i / 3, i % 3) = random.normal();
    const auto found = find_best_rotation(products, 1e-10);
    REQUIRE(found);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(products.transpose(), Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    if (svd.singularValues()[1] + sign * svd.singularValues()[2] < 1e-3) continue;  // nearly ambiguous
    const mat3 expected = svd.matrixU() * vec3(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
    const mat3 rotation = so3(found->quaternion).rotation_matrix();
    CHECK((rotation - expected).norm() < 1e-8);
    CHECK(found->trace == Approx((rotation * products).trace()).margin(1e-10));
  }
}

TEST_CASE("There is no best rotation of points on a line, in one place, or nowhere") {
  const vec3 a(1, 2, 3), b(-2, 1, 0);
  CHECK_FALSE(find_best_rotation(mat3(a * b.transpose()), 1e-10));
  CHECK_FALSE(find_best_rotation(mat3::Zero(), 1e-10));
  CHECK_FALSE(find_best_rotation(mat3::Constant(std::numeric_limits<double>::quiet_NaN()), 1e-10));
}

TEST_CASE("Moments of weighted pairs are those of repeated pairs") {
  random_bits random(18);
  std::vector<vec3> from, to;
  for (int i = 0; i != 7; ++i) {
    from.push_back(test::random_vector(random, 3.0));
    to.push_back(test::random_vector(random, 3.0));
  }
  const auto read = [&](std::size_t i, double* a, double* b) {
    for (int k = 0; k != 3; ++k) a[k] = from[i][k], b[k] = to[i][k];
  };
  const auto weighted = optimize::detail::compute_moments(7, [&](std::size_t i, double* a, double* b) {
    read(i, a, b);
    return i == 2 ? 3.0 : 1.0;
  });
  const auto repeated = optimize::detail::compute_moments(9, [&](std::size_t i, double* a, double* b) {
    read(i < 7 ? i : 2, a, b);
    return 1.0;
  });
  CHECK((weighted.from_mean - repeated.from_mean).norm() < 1e-13);
  CHECK((weighted.to_mean - repeated.to_mean).norm() < 1e-13);
  CHECK((weighted.products - repeated.products).norm() < 1e-11);
  CHECK(weighted.from_spread == Approx(repeated.from_spread));
  CHECK(weighted.to_spread == Approx(repeated.to_spread));
}

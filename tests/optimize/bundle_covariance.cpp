// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include <orbis/camera/pinhole.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/bundle_covariance.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

#include "bundle_instances.hpp"
#include "support.hpp"
#include "support/catch.hpp"
#include "support/synthetic/bundle.hpp"

using namespace orbis;
using optimize::bundle_gauge;
using optimize::bundle_observation;
using optimize::covariance_options;
using optimize::covariance_status;

namespace {

template <class R>
struct problem {
  R residual;
  std::vector<typename R::camera_state> cameras;
  std::vector<vec3> points;
  std::vector<bundle_observation> observations;
  std::vector<std::uint8_t> fixed_poses, fixed_points;
};
using pinhole_residual = optimize::reprojection<camera::pinhole>;

/// Keyframes and points where they truly are; observations, with noise, of which so many have depth.
problem<pinhole_residual> local_map(double depth_share, int fixed, double outliers = 0.0) {
  const auto made = test::make_local_map({.free_keyframes = 7 - fixed,
                                        .fixed_keyframes = fixed,
                                        .points = 60,
                                        .views_per_point = 4.0,
                                        .depth_share = depth_share,
                                        .outlier_share = outliers,
                                        .seed = 5});
  problem<pinhole_residual> p{{made.camera, made.bf}, made.true_poses, made.true_points, {}, made.fixed, {}};
  p.fixed_points.assign(p.points.size(), 0);
  for (const auto& o : made.observations)
    p.observations.push_back({o.keyframe, o.point, o.pixel, o.right, o.information});
  return p;
}
problem<optimize::bal_reprojection> photographs() {
  const auto made = test::make_bal_problem({.cameras = 9, .points = 150, .views_per_point = 4.0, .seed = 2});
  problem<optimize::bal_reprojection> p;
  for (const auto& c : made.truth.cameras) p.cameras.push_back(optimize::bal_camera::from_parameters(c));
  p.points = made.truth.points;
  for (const auto& o : made.measured.observations) p.observations.push_back({o.camera, o.point, o.pixel});
  p.fixed_poses.assign(p.cameras.size(), 0);
  p.fixed_points.assign(p.points.size(), 0);
  return p;
}

/// The whole normal matrix, row by row and observation by observation; cameras first.
template <class R, class Loss>
Eigen::MatrixXd normal_matrix(const problem<R>& p, const Loss& loss) {
  constexpr int c = R::camera_manifold::dimension;
  const auto at_point = [&](std::size_t j) { return static_cast<Eigen::Index>(c * p.cameras.size() + 3 * j); };
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(at_point(p.points.size()), at_point(p.points.size()));
  for (const auto& o : p.observations) {
    matrix<R::dimension, c> by_camera;
    matrix<R::dimension, 3> by_point;
    const auto r =
        p.residual.linearize(p.residual.prepare(p.cameras[o.pose]), p.points[o.point], o, by_camera, by_point);
    REQUIRE(r.has_value());
    const double w = o.information * loss.weight(o.information * r->squaredNorm());
    const Eigen::Index i = c * static_cast<Eigen::Index>(o.pose), j = at_point(o.point);
    h.block<c, c>(i, i) += w * by_camera.transpose() * by_camera;
    h.block<c, 3>(i, j) += w * by_camera.transpose() * by_point;
    h.block<3, 3>(j, j) += w * by_point.transpose() * by_point;
  }
  return h.selfadjointView<Eigen::Upper>();
}

/// Without the rows and columns of what is fixed, and back, with zeros there.
template <class R>
std::vector<Eigen::Index> moving_rows(const problem<R>& p) {
  constexpr int c = R::camera_manifold::dimension;
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i != p.cameras.size(); ++i)
    for (int k = 0; k != c; ++k)
      if (p.fixed_poses[i] == 0) rows.push_back(static_cast<Eigen::Index>(c * i) + k);
  for (std::size_t j = 0; j != p.points.size(); ++j)
    for (int k = 0; k != 3; ++k)
      if (p.fixed_points[j] == 0) rows.push_back(static_cast<Eigen::Index>(c * p.cameras.size() + 3 * j) + k);
  return rows;
}
Eigen::MatrixXd with_zeros(const Eigen::MatrixXd& m, const std::vector<Eigen::Index>& rows, Eigen::Index size) {
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(size, size);
  whole(rows, rows) = m;
  return whole;
}

/// Largest difference of two blocks, in standard deviations of `whole`.
template <class Block>
double difference(const Block& block, const Eigen::MatrixXd& whole, Eigen::Index row, Eigen::Index column) {
  double worst = 0.0;
  for (Eigen::Index i = 0; i != block.rows(); ++i)
    for (Eigen::Index j = 0; j != block.cols(); ++j) {
      const double scale = std::max(1e-9, std::sqrt(whole(row + i, row + i) * whole(column + j, column + j)));
      const double off = std::abs(block(i, j) - whole(row + i, column + j));
      worst = std::max(worst, off / scale);
    }
  return worst;
}

/// All blocks of cameras and points are those of `expected`.
template <class R, class Loss = optimize::trivial>
void compare(const problem<R>& p, const Eigen::MatrixXd& expected, const Loss& loss = {},
             bundle_gauge hold = bundle_gauge::damped) {
  constexpr int c = R::camera_manifold::dimension;
  constexpr double tolerance = 1e-8;
  const covariance_options options{.fixed_poses = p.fixed_poses, .fixed_points = p.fixed_points, .hold = hold};
  const auto got = optimize::covariance_of(seq, p.residual, std::span{p.cameras}, std::span{p.points},
                                           std::span{p.observations}, options, loss);
  REQUIRE(got.status == covariance_status::done);
  REQUIRE(got.cameras.size() == p.cameras.size());
  REQUIRE(got.points.size() == p.points.size());
  const auto at_camera = [](std::size_t i) { return static_cast<Eigen::Index>(c * i); };
  for (std::size_t i = 0; i != p.cameras.size(); ++i)
    CHECK(difference(got.cameras[i], expected, at_camera(i), at_camera(i)) < tolerance);
  for (std::size_t j = 0; j != p.points.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(c * p.cameras.size() + 3 * j);
    CHECK(difference(got.points[j], expected, at, at) < tolerance);
  }
}

template <class R, class Loss = optimize::trivial>
Eigen::MatrixXd inverse_of(const problem<R>& p, const Loss& loss = {}) {
  const Eigen::MatrixXd h = normal_matrix(p, loss);
  const auto rows = moving_rows(p);
  return with_zeros(h(rows, rows).inverse(), rows, h.rows());
}

template <class R>
auto covariance(const problem<R>& p, covariance_options options) {
  options.fixed_poses = p.fixed_poses;
  options.fixed_points = p.fixed_points;
  return optimize::covariance_of(seq, p.residual, std::span{p.cameras}, std::span{p.points}, std::span{p.observations},
                                 options);
}

}  // namespace

TEST_CASE("Covariances are the blocks of the dense inverse") {
  const auto with_depth = local_map(0.6, 2);
  compare(with_depth, inverse_of(with_depth));
  const auto without = local_map(0.0, 2);
  compare(without, inverse_of(without));

  auto robust = local_map(0.6, 2, 0.1);
  compare(robust, inverse_of(robust, optimize::huber{2.0}), optimize::huber{2.0});

  // Known points hold the whole as well, and a camera may see a point twice.
  auto known = local_map(0.5, 0);
  for (std::size_t j = 0; j < known.points.size(); j += 3) known.fixed_points[j] = 1;
  known.observations.push_back(known.observations.front());
  known.observations.back().pixel.x() += 0.3;
  compare(known, inverse_of(known));

  auto nine = photographs();
  nine.fixed_poses[0] = nine.fixed_poses[4] = 1;
  compare(nine, inverse_of(nine));
}

TEST_CASE("Where nothing holds the whole there are no covariances, unless the first camera does") {
  auto p = local_map(1.0, 0);
  const auto free = covariance(p, {});
  CHECK(free.status == covariance_status::undetermined_camera);
  CHECK(free.cameras.empty());
  auto held = p;
  held.fixed_poses[0] = 1;
  compare(p, inverse_of(held), optimize::trivial{}, bundle_gauge::first_camera);
  CHECK(covariance(p, {.hold = bundle_gauge::first_camera}).cameras[0].isZero(0.0));

  // Without depth one camera leaves the scale free.
  p = local_map(0.0, 0);
  CHECK(covariance(p, {}).status == covariance_status::undetermined_camera);
  CHECK(covariance(p, {.hold = bundle_gauge::first_camera}).status == covariance_status::undetermined_camera);
  CHECK(covariance(photographs(), {}).status == covariance_status::undetermined_camera);
}

TEST_CASE("What observations do not determine has no covariance, or is named") {
  auto p = local_map(0.0, 2);
  const auto count_of = [&](std::uint32_t point) {
    return std::count_if(p.observations.begin(), p.observations.end(), [&](const auto& o) { return o.point == point; });
  };
  REQUIRE(count_of(3) > 1);
  std::erase_if(p.observations, [](const auto& o) { return o.point == 7; });  // seen by nobody
  bool first = true;
  std::erase_if(p.observations, [&](const auto& o) { return o.point == 3 && !std::exchange(first, false); });
  auto got = covariance(p, {});
  REQUIRE(got.status == covariance_status::done);
  CHECK(std::isnan(got.points[7](0, 0)));
  CHECK(std::isnan(got.points[3](0, 0)));  // once, without depth
  CHECK(got.points[4].allFinite());
  CHECK(got.cameras[0].isZero(0.0));  // known
  CHECK(got.cameras[4].allFinite());

  // The rest is as if these points were not there.
  auto rest = p;
  std::erase_if(rest.observations, [](const auto& o) { return o.point == 3; });
  rest.fixed_points[3] = rest.fixed_points[7] = 1;
  const Eigen::MatrixXd expected = inverse_of(rest);
  CHECK(difference(got.cameras[4], expected, 24, 24) < 1e-8);

  auto unseen = p;
  std::erase_if(unseen.observations, [](const auto& o) { return o.pose == 5; });
  got = covariance(unseen, {});
  REQUIRE(got.status == covariance_status::done);
  CHECK(std::isnan(got.cameras[5](0, 0)));

  // Two points do not say where a camera is.
  auto weak = p;
  int kept = 0;
  std::erase_if(weak.observations, [&](const auto& o) { return o.pose == 3 && ++kept > 2; });
  got = covariance(weak, {});
  CHECK(got.status == covariance_status::undetermined_camera);
  CHECK(got.where == 3);
  CHECK(optimize::describe(got.status, got.where).find("camera 3") != std::string::npos);

  auto missing = p;
  missing.observations[9].point = 1000;
  got = covariance(missing, {});
  CHECK(got.status == covariance_status::missing_point);
  CHECK(got.where == 9);
  missing.observations.clear();
  CHECK(covariance(missing, {}).status == covariance_status::nothing_to_do);
  auto nan = p;
  nan.points[11].x() = std::numeric_limits<double>::quiet_NaN();
  got = covariance(nan, {});
  REQUIRE(got.status == covariance_status::done);
  CHECK(std::isnan(got.points[11](0, 0)));
  CHECK(got.cameras[4].allFinite());
  auto lost = p;
  lost.cameras[5] = se3(so3(), vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0));
  auto blind = p;
  std::erase_if(blind.observations, [](const auto& o) { return o.pose == 5; });
  got = covariance(lost, {});
  const auto expected_of_rest = covariance(blind, {});
  REQUIRE(got.status == covariance_status::done);
  CHECK(std::isnan(got.cameras[5](0, 0)));
  CHECK((got.cameras[4] - expected_of_rest.cameras[4]).norm() <= 1e-6 * expected_of_rest.cameras[4].norm());
}

TEST_CASE("Covariances have the same bits with any number of threads") {
  const auto p = local_map(0.4, 0);
  const covariance_options options{.hold = bundle_gauge::first_camera};
  const auto one = optimize::covariance_of(seq, p.residual, std::span{p.cameras}, std::span{p.points},
                                           std::span{p.observations}, options);
  const auto three = optimize::covariance_of(par.with(3), p.residual, std::span{p.cameras}, std::span{p.points},
                                             std::span{p.observations}, options);
  for (std::size_t i = 0; i != p.cameras.size(); ++i) CHECK(one.cameras[i] == three.cameras[i]);
  for (std::size_t j = 0; j != p.points.size(); ++j) CHECK(one.points[j] == three.points[j]);
}

TEST_CASE("Estimates scatter as their covariances say") {
  auto p = local_map(1.0, 2);
  const auto truth = p;
  optimize::bundle_adjuster ba{p.residual, optimize::trivial{}};
  random_bits random{11};
  std::vector<mat6> spread(p.cameras.size(), mat6::Zero());
  const int runs = 200;
  for (int run = 0; run != runs; ++run) {
    p.cameras = truth.cameras;
    p.points = truth.points;
    for (auto& o : p.observations) {
      const vec3 q = truth.cameras[o.pose].inverse() * truth.points[o.point];
      const double sigma = 1.0 / std::sqrt(o.information), u = random.normal(), v = random.normal();
      o.pixel = p.residual.camera.project(q).value();
      o.right = p.residual.right(o.pixel.x(), q.z()) + sigma * random.normal();
      o.pixel += sigma * vec2(u, v);
    }
    const auto summary = ba.solve(seq, std::span{p.cameras}, std::span{p.points},
                                  std::span<const bundle_observation>{p.observations}, {.fixed_poses = p.fixed_poses});
    REQUIRE_FALSE(is_failure(summary.status));
    for (std::size_t i = 1; i + 1 != p.cameras.size(); ++i) {
      const vec6 off = (truth.cameras[i].inverse() * p.cameras[i]).log();
      spread[i] += off * off.transpose() / runs;
    }
  }
  const auto predicted = covariance(truth, {});
  REQUIRE(predicted.status == covariance_status::done);
  for (std::size_t i = 1; i + 1 != p.cameras.size(); ++i) {
    const double ratio = (spread[i] * predicted.cameras[i].inverse()).trace() / 6.0;
    CHECK(ratio == Approx(1.0).margin(0.2));
  }
}

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
#include <orbis/io/synthetic/bundle.hpp>
#include <orbis/optimize/bal_reprojection.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/bundle_covariance.hpp>

#include "bundle_instances.hpp"
#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::bundle_observation;
using optimize::covariance_gauge;
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
  const auto made = io::make_local_map({.free_keyframes = 7 - fixed,
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
  const auto made = io::make_bal_problem({.cameras = 9, .points = 150, .views_per_point = 4.0, .seed = 2});
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

/// All blocks of cameras and points, and some pairs, are those of `expected`.
template <class R, class Loss = optimize::trivial>
void compare(const problem<R>& p, covariance_gauge gauge, const Eigen::MatrixXd& expected, int free_directions,
             double tolerance = 1e-8, const Loss& loss = {}) {
  constexpr int c = R::camera_manifold::dimension;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t i = 0; i != p.cameras.size(); ++i) pairs.emplace_back(i, (3 * i + 1) % p.cameras.size());
  covariance_options options{
      .gauge = gauge, .fixed_poses = p.fixed_poses, .fixed_points = p.fixed_points, .pairs = pairs};
  const auto got = optimize::covariance_of(seq, p.residual, std::span{p.cameras}, std::span{p.points},
                                           std::span{p.observations}, options, loss);
  REQUIRE(got.status == covariance_status::done);
  CHECK(got.free_directions == free_directions);
  REQUIRE(got.cameras.size() == p.cameras.size());
  REQUIRE(got.points.size() == p.points.size());
  const auto at_camera = [](std::size_t i) { return static_cast<Eigen::Index>(c * i); };
  for (std::size_t i = 0; i != p.cameras.size(); ++i)
    CHECK(difference(got.cameras[i], expected, at_camera(i), at_camera(i)) < tolerance);
  for (std::size_t k = 0; k != pairs.size(); ++k)
    CHECK(difference(got.pairs[k], expected, at_camera(pairs[k].first), at_camera(pairs[k].second)) < tolerance);
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

se3 moved(const se3& T_world_camera, const se3& by, double scale) {
  return by * se3{T_world_camera.rotation(), scale * T_world_camera.translation()};
}
optimize::bal_camera moved(const optimize::bal_camera& c, const se3& by, double scale) {
  optimize::bal_camera to = c;
  to.T_camera_world = moved(c.T_camera_world.inverse(), by, scale).inverse();
  return to;
}

/// How everything changes when the whole is shifted, turned and scaled, by differences.
template <class R>
Eigen::MatrixXd directions_of_the_whole(const problem<R>& p) {
  constexpr int c = R::camera_manifold::dimension;
  const typename R::camera_manifold manifold{};
  Eigen::MatrixXd g(static_cast<Eigen::Index>(c * p.cameras.size() + 3 * p.points.size()), 7);
  const double h = 1e-4;
  for (int k = 0; k != 7; ++k)
    for (const double sign : {-1.0, 1.0}) {
      const se3 by = k == 6 ? se3{} : se3::exp(vec6(sign * h * vec6::Unit(k)));
      const double scale = k == 6 ? 1.0 + sign * h : 1.0;
      Eigen::VectorXd change(g.rows());
      for (std::size_t i = 0; i != p.cameras.size(); ++i)
        change.segment<c>(static_cast<Eigen::Index>(c * i)) =
            manifold.local(p.cameras[i], moved(p.cameras[i], by, scale));
      for (std::size_t j = 0; j != p.points.size(); ++j)
        change.segment<3>(static_cast<Eigen::Index>(c * p.cameras.size() + 3 * j)) =
            by * vec3(scale * p.points[j]) - p.points[j];
      if (sign < 0.0)
        g.col(k) = -change / (2.0 * h);
      else
        g.col(k) += change / (2.0 * h);
    }
  return g;
}

/// The inverse where the free directions, columns of `g`, are held: the block of the inverse of the
/// bordered matrix.
Eigen::MatrixXd bordered_inverse(const Eigen::MatrixXd& h, const Eigen::MatrixXd& g) {
  const Eigen::VectorXd scale = h.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd constraints = scale.asDiagonal() * g;
  for (Eigen::Index k = 0; k != constraints.cols(); ++k) constraints.col(k).normalize();
  const auto n = h.rows(), free = g.cols();
  Eigen::MatrixXd bordered = Eigen::MatrixXd::Zero(n + free, n + free);
  bordered.topLeftCorner(n, n) = scale.asDiagonal() * h * scale.asDiagonal();
  bordered.topRightCorner(n, free) = constraints;
  bordered.bottomLeftCorner(free, n) = constraints.transpose();
  return scale.asDiagonal() * Eigen::MatrixXd(bordered.inverse()).topLeftCorner(n, n) * scale.asDiagonal();
}
template <class R>
Eigen::MatrixXd pseudo_inverse_of(const problem<R>& p, int free) {
  return bordered_inverse(normal_matrix(p, optimize::trivial{}), directions_of_the_whole(p).leftCols(free));
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
  compare(with_depth, covariance_gauge::as_given, inverse_of(with_depth), 0);
  const auto without = local_map(0.0, 2);
  compare(without, covariance_gauge::as_given, inverse_of(without), 0);
  // Where nothing is free, the gauge makes no difference.
  compare(with_depth, covariance_gauge::inner, inverse_of(with_depth), 0);

  auto robust = local_map(0.6, 2, 0.1);
  compare(robust, covariance_gauge::as_given, inverse_of(robust, optimize::huber{2.0}), 0, 1e-8, optimize::huber{2.0});

  // Known points hold the whole as well, and a camera may see a point twice.
  auto known = local_map(0.5, 0);
  for (std::size_t j = 0; j < known.points.size(); j += 3) known.fixed_points[j] = 1;
  known.observations.push_back(known.observations.front());
  known.observations.back().pixel.x() += 0.3;
  compare(known, covariance_gauge::as_given, inverse_of(known), 0);

  auto nine = photographs();
  nine.fixed_poses[0] = nine.fixed_poses[4] = 1;
  compare(nine, covariance_gauge::as_given, inverse_of(nine), 0);
}

TEST_CASE("What is free of the whole is counted, and settled by the gauge asked for") {
  // With depth: six directions.
  auto p = local_map(1.0, 0);
  auto free = covariance(p, {});
  CHECK(free.status == covariance_status::gauge_free);
  CHECK(free.free_directions == 6);
  CHECK(free.cameras.empty());
  compare(p, covariance_gauge::inner, pseudo_inverse_of(p, 6), 6);
  // The first camera holds them: as if it were known.
  auto held = p;
  held.fixed_poses[0] = 1;
  compare(p, covariance_gauge::first_camera, inverse_of(held), 6);

  // Without: the scale too.
  p = local_map(0.0, 0);
  CHECK(covariance(p, {}).free_directions == 7);
  compare(p, covariance_gauge::inner, pseudo_inverse_of(p, 7), 7);
  const auto scaled = covariance(p, {.gauge = covariance_gauge::first_camera});
  REQUIRE(scaled.status == covariance_status::done);
  CHECK(scaled.cameras[0].norm() < 1e-12);
  const vec3 away = (p.cameras.back().translation() - p.cameras[0].translation()).normalized();
  const vec3 seen = p.cameras.back().rotation().inverse() * away;
  const mat3 last = scaled.cameras.back().topLeftCorner<3, 3>();
  CHECK(seen.dot(last * seen) < 1e-9 * last.trace());  // its distance is the unit
  CHECK(last.trace() > 0.0);

  // One known camera leaves the scale alone.
  p.fixed_poses[0] = 1;
  CHECK(covariance(p, {}).status == covariance_status::gauge_free);
  CHECK(covariance(p, {}).free_directions == 1);
  {
    // It scales about that camera: the direction among the seven that leaves it where it is.
    const Eigen::MatrixXd all = directions_of_the_whole(p);
    matrix<7> about = matrix<7>::Unit(6);
    about.head<3>() = -p.cameras[0].translation();
    const auto rows = moving_rows(p);
    const Eigen::MatrixXd direction = all * about, h = normal_matrix(p, optimize::trivial{});
    CHECK(direction.topRows(6).norm() < 1e-7);
    compare(p, covariance_gauge::inner, with_zeros(bordered_inverse(h(rows, rows), direction(rows, 0)), rows, h.rows()),
            1);
  }
  CHECK(covariance(p, {.gauge = covariance_gauge::first_camera}).status == covariance_status::done);

  // Cameras with intrinsics of their own.
  const auto nine = photographs();
  CHECK(covariance(nine, {}).free_directions == 7);
  compare(nine, covariance_gauge::inner, pseudo_inverse_of(nine, 7), 7);
  // No gauge has a smaller trace.
  const auto inner = covariance(p, {.gauge = covariance_gauge::inner});
  const auto first = covariance(p, {.gauge = covariance_gauge::first_camera});
  double inner_trace = 0.0, first_trace = 0.0;
  for (std::size_t i = 0; i != p.cameras.size(); ++i) {
    inner_trace += inner.cameras[i].trace();
    first_trace += first.cameras[i].trace();
  }
  for (std::size_t j = 0; j != p.points.size(); ++j) {
    inner_trace += inner.points[j].trace();
    first_trace += first.points[j].trace();
  }
  CHECK(inner_trace < first_trace);
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
  for (const auto gauge : {covariance_gauge::inner, covariance_gauge::first_camera}) {
    auto lost = p;
    std::fill(lost.fixed_poses.begin(), lost.fixed_poses.end(), std::uint8_t{0});
    auto without = lost;
    std::erase_if(without.observations, [](const auto& o) { return o.pose == 5; });
    lost.cameras[5] = se3(so3(), vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0));
    got = covariance(lost, {.gauge = gauge});
    const auto expected_of_rest = covariance(without, {.gauge = gauge});
    REQUIRE(got.status == covariance_status::done);
    CHECK(got.free_directions == 7);
    CHECK(std::isnan(got.cameras[5](0, 0)));
    CHECK((got.cameras[4] - expected_of_rest.cameras[4]).norm() <= 1e-6 * expected_of_rest.cameras[4].norm());
  }
}

TEST_CASE("Covariances have the same bits with any number of threads") {
  const auto p = local_map(0.4, 0);
  const covariance_options options{.gauge = covariance_gauge::inner};
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

// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/optimize/detail/bundle/bundle_equations.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

#include "optimize/bundle_instances.hpp"
#include "optimize/bundles.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::bundle_observation;

namespace {

/// A residual that says nothing of the camera frame: the general path.
struct plain_reprojection {
  using camera_state = se3;
  using camera_manifold = optimize::lie_group<se3>;
  using observation = bundle_observation;
  using view = optimize::camera_view;
  static constexpr int dimension = 3;
  optimize::reprojection<camera::pinhole> base = test::bundle_model;

  view prepare(const se3& pose) const { return base.prepare(pose); }
  bool is_usable(const observation& o) const { return base.is_usable(o); }
  std::optional<vec3> residual(const view& v, const vec3& x, const observation& o) const {
    return base.residual(v, x, o);
  }
  std::optional<vec3> linearize(const view& v, const vec3& x, const observation& o, matrix<3, 6>& by_camera,
                                mat3& by_point) const {
    return base.linearize(v, x, o, by_camera, by_point);
  }
};
/// One that acts through the camera frame, but knows no lanes.
struct slow_reprojection : plain_reprojection {
  static constexpr int intrinsic_dimension = 0;
  std::optional<vec3> residual_in_camera(const view& v, const vec3& q, const observation& o) const {
    return base.residual_in_camera(v, q, o);
  }
  std::optional<vec3> linearize_in_camera(const view& v, const vec3& q, const observation& o, mat3& by_q,
                                          matrix<3, 0>& none) const {
    return base.linearize_in_camera(v, q, o, by_q, none);
  }
};
static_assert(!optimize::camera_frame_residual<plain_reprojection>);
static_assert(optimize::camera_frame_residual<slow_reprojection>);
static_assert(!optimize::detail::lane_residual<slow_reprojection>);

template <class R>
using equations_of = optimize::detail::bundle_equations<R, optimize::huber>;

template <class R, class Camera>
Eigen::VectorXd step_of(equations_of<R>& equations, const std::vector<Camera>& cameras, const std::vector<vec3>& points,
                        const std::vector<bundle_observation>& observations, const std::vector<std::uint8_t>& fixed,
                        Eigen::VectorXd& damping) {
  optimize::bundle_summary summary;
  equations.set_structure(cameras.size(), points.size(), std::span<const bundle_observation>(observations), fixed);
  equations.begin(seq, std::span<const Camera>(cameras), std::span<const vec3>(points), {}, summary);
  equations.linearize(seq);
  damping = 1e-3 * equations.diagonal();
  REQUIRE(equations.eliminate(seq, damping));
  REQUIRE(equations.factor());
  Eigen::VectorXd step;
  equations.solve_cameras(step);
  equations.solve_points(seq, step);
  return step;
}

template <class R>
void check_step(const R& residual, const test::bundle& p) {
  equations_of<R> equations{residual, optimize::huber{2.45}, {}};
  Eigen::VectorXd damping;
  const Eigen::VectorXd step = step_of(equations, p.poses, p.points, p.observations, p.fixed, damping);
  const Eigen::VectorXd expected = test::dense_step(equations, p.poses, p.points, p.observations, damping);
  CHECK((step - expected).norm() <= 1e-9 * expected.norm());
  CHECK(equations.curvature(step) + step.dot(damping.cwiseProduct(step)) ==
        Approx(-equations.gradient().dot(step)).epsilon(1e-9));
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    equations_of<R> other{residual, optimize::huber{2.45}, {}};
    const Eigen::VectorXd same = step_of(other, p.poses, p.points, p.observations, p.fixed, damping);
    CHECK(same == step);
    CHECK(other.cost() == equations.cost());
    CHECK(other.try_step(seq, same) == equations.try_step(seq, step));
  }
}

}  // namespace

TEST_CASE("The step by the Schur complement is that of the dense normal equations, on every path") {
  test::bundle p = test::make_bundle({.points = 61, .sigma = 1.0}, 21);
  p.observations[7].pixel += vec2(60, -40);  // beyond the loss's width
  for (std::size_t k = 0; k < p.observations.size(); k += 3) p.observations[k].smear = vec2(3.0, -1.0);
  check_step(test::bundle_model, p);
  check_step(plain_reprojection{}, p);
  check_step(slow_reprojection{}, p);
  check_step(
      optimize::reprojection{camera::radial_tangential{test::bundle_camera.k(), {.k1 = 0.05, .p1 = 0.001}}, 40.0}, p);
}

TEST_CASE("A camera that sees a point twice counts twice") {
  test::bundle p = test::make_bundle({.poses = 5, .points = 23, .sigma = 0.5}, 22);
  for (const std::size_t k : {3UL, 30UL, 31UL, 60UL}) {
    p.observations.push_back(p.observations[k]);
    p.observations.back().pixel.x() += 0.5;
    p.observations.push_back(p.observations.back());
  }
  check_step(test::bundle_model, p);
}

TEST_CASE("The Schur step for cameras with nine unknowns is that of the dense normal equations") {
  random_bits random(23);
  std::vector<optimize::bal_camera> cameras;
  std::vector<vec3> points;
  std::vector<bundle_observation> observations;
  for (int i = 0; i != 6; ++i)
    cameras.push_back({se3{so3::exp(test::random_vector(random, 0.2)), vec3(0.3 * i, 0, -4)}, 500.0 + i, 0.01, -0.002});
  for (std::uint32_t j = 0; j != 47; ++j) {
    points.push_back(test::random_vector(random, 1.0));
    for (std::uint32_t i = 0; i != 6; ++i) {
      if (random.uniform() < 0.3) continue;
      bundle_observation o{.pose = i, .point = j};
      o.pixel = *optimize::bal_reprojection::residual(optimize::bal_reprojection::prepare(cameras[i]), points[j], o) +
                3.0 * vec2(random.normal(), random.normal());
      observations.push_back(o);
    }
  }
  equations_of<optimize::bal_reprojection> equations{{}, optimize::huber{2.45}, {}};
  Eigen::VectorXd damping;
  const Eigen::VectorXd step = step_of(equations, cameras, points, observations, {}, damping);
  const Eigen::VectorXd expected = test::dense_step(equations, cameras, points, observations, damping);
  CHECK((step - expected).norm() <= 1e-9 * expected.norm());
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    equations_of<optimize::bal_reprojection> other{{}, optimize::huber{2.45}, {}};
    CHECK(step_of(other, cameras, points, observations, {}, damping) == step);
    CHECK(other.cost() == equations.cost());
  }
}

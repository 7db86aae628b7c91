// SPDX-License-Identifier: BSD-3-Clause
#include <numbers>

#include <orbis/optimize/manifold.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize;

namespace {

template <int N>
matrix<N> random_step(random_bits& random, double bound) {
  matrix<N> d;
  for (int i = 0; i != N; ++i) d[i] = random.uniform(-bound, bound);
  return d;
}

/// What retract and local promise, at steps of all sizes.
template <class M, class MakePoint>
void check_inverse(const M& m, MakePoint&& make_point, double far) {
  random_bits random{301};
  for (int trial = 0; trial != 200; ++trial) {
    const typename M::point p = make_point(random), q = make_point(random);
    CHECK(m.local(p, m.retract(p, M::tangent::Zero())).norm() < 1e-14);
    const typename M::point back = m.retract(p, m.local(p, q));
    CHECK(m.local(q, back).norm() < 1e-9);
    for (const double size : {1e-12, 1e-6, 1e-3, 0.1, far}) {
      const typename M::tangent d = random_step<M::dimension>(random, size);
      CHECK((m.local(p, m.retract(p, d)) - d).norm() < 1e-14 + 1e-8 * d.norm());
    }
  }
}

so3 random_rotation(random_bits& random) { return test::random_pose(random).rotation(); }

}  // namespace

TEST_CASE("A step along a manifold is found again between its ends") {
  check_inverse(lie_group<so3>{}, random_rotation, 1.0);
  check_inverse(
      lie_group<se3>{}, [](random_bits& r) { return test::random_pose(r); }, 1.0);
  check_inverse(
      lie_group<sim3>{},
      [](random_bits& r) {
        const se3 pose = test::random_pose(r);
        return sim3{pose.rotation(), pose.translation(), std::exp(r.uniform(-1.0, 1.0))};
      },
      0.8);
  check_inverse(
      euclidean<4>{}, [](random_bits& r) { return vec4(random_step<4>(r, 10.0)); }, 5.0);
  check_inverse(
      unit_sphere{}, [](random_bits& r) { return vec3(test::random_vector(r, 1.0).normalized()); }, 2.0);
}

TEST_CASE("Steps on the sphere keep to it, and the basis is their derivative") {
  random_bits random{302};
  const unit_sphere m;
  std::vector<vec3> points{vec3(0, 0, 1), vec3(0, 0, -1), vec3(1, 0, 0), vec3(0, -1, 0)};
  for (int i = 0; i != 50; ++i) points.push_back(test::random_vector(random, 1.0).normalized());
  for (const vec3& p : points) {
    const matrix<3, 2> b = m.basis(p);
    CHECK((b.transpose() * b - mat2::Identity()).norm() < 1e-12);
    CHECK((b.transpose() * p).norm() < 1e-12);
    const vec2 d = random_step<2>(random, 3.0);
    CHECK(m.retract(p, d).norm() == Approx(1.0).epsilon(1e-12));
    for (int i = 0; i != 2; ++i) {
      const vec2 h = 1e-6 * vec2::Unit(i);
      const vec3 slope = (m.retract(p, h) - m.retract(p, -h)) / 2e-6;
      CHECK((slope - b.col(i)).norm() < 1e-8);
    }
    CHECK(m.local(p, -p).norm() == Approx(std::numbers::pi));
  }
}

TEST_CASE("A subset moves along the named coordinates alone") {
  random_bits random{303};
  const subset<lie_group<se3>, 0, 1, 5> planar;
  for (int trial = 0; trial != 50; ++trial) {
    const se3 start{so3::exp(vec3(0, 0, random.uniform(-3.0, 3.0))), vec3(random.normal(), random.normal(), 0.7)};
    const vec3 d = random_step<3>(random, 1.0);
    const se3 end = planar.retract(start, d);
    CHECK(end.translation().z() == Approx(0.7));
    CHECK(std::abs((end.rotation() * vec3::UnitZ()).z() - 1.0) < 1e-14);
    CHECK((planar.local(start, end) - d).norm() < 1e-12);
    vec6 whole;
    whole << d[0], d[1], 0, 0, 0, d[2];
    CHECK((lie_group<se3>::local(start, end) - whole).norm() < 1e-12);
  }
  mat6 columns;
  for (int i = 0; i != 6; ++i) columns.col(i).setConstant(i);
  CHECK(planar.reduce(columns).row(2) == vec3(0, 1, 5).transpose());
  // The order is the one that is given.
  const subset<euclidean<3>, 2, 0> swapped;
  CHECK(swapped.retract(vec3(1, 2, 3), vec2(10, 20)) == vec3(21, 2, 13));
}

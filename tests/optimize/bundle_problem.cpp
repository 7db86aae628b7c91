// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <string>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/optimize/bundle_problem.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize;

static_assert(camera_manifold<lie_group<se3>> && camera_manifold<lie_group<sim3>>);

namespace {

/// A step away and back, and what lies between, which `local(p, q)` tells.
template <class M, class Point, class Local>
void check_steps(const M& m, const Point& p, const Local& local) {
  random_bits random{301};
  CHECK(local(p, m.retract(p, M::tangent::Zero())).norm() < 1e-14);
  for (const double size : {1e-12, 1e-6, 1e-3, 0.1, 0.8}) {
    typename M::tangent d;
    for (int i = 0; i != M::dimension; ++i) d[i] = random.uniform(-size, size);
    CHECK((local(p, m.retract(p, d)) - d).norm() < 1e-14 + 1e-8 * d.norm());
  }
}

}  // namespace

TEST_CASE("A step on a camera manifold is found again between its ends") {
  random_bits random{302};
  const auto between = [](const auto& p, const auto& q) { return (p.inverse() * q).log(); };
  for (int trial = 0; trial != 100; ++trial) {
    const se3 pose = test::random_pose(random);
    check_steps(lie_group<se3>{}, pose, between);
    check_steps(lie_group<so3>{}, pose.rotation(), between);
    check_steps(lie_group<sim3>{}, sim3{pose.rotation(), pose.translation(), std::exp(random.uniform(-1.0, 1.0))},
                between);
  }
}

TEST_CASE("A summary of bundle adjustment says what was wrong and where") {
  const auto text = [](bundle_status status, std::size_t where) {
    bundle_summary s;
    s.status = status;
    s.where = where;
    return to_string(s);
  };
  CHECK(text(bundle_status::converged, 0) == "converged");
  CHECK(text(bundle_status::missing_point, 7).find("observation 7") != std::string::npos);
  CHECK(text(bundle_status::bad_pose, 3).find("pose 3") != std::string::npos);
  CHECK(is_failure(bundle_status::undetermined_pose));
  CHECK_FALSE(is_failure(bundle_status::nothing_to_do));
}

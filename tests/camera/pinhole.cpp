// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/camera/pinhole.hpp>

#include "camera/model_checks.hpp"

using namespace orbis;
using camera::pinhole;

static_assert(camera::camera_model<pinhole>);

namespace {
const pinhole kinect{640, 480, 525.0, 520.0, 319.5, 239.5};
}

TEST_CASE("a pinhole projects by similar triangles") {
  CHECK((*kinect.project({0, 0, 3}) - vec2{319.5, 239.5}).norm() == 0.0);
  CHECK((*kinect.project({1, -2, 4}) - vec2{319.5 + 525.0 / 4, 239.5 - 520.0 / 2}).norm() < 1e-12);
  CHECK((*kinect.unproject({319.5 + 525.0, 239.5}) - vec3{1, 0, 1}).norm() < 1e-12);
}

TEST_CASE("every pixel of a pinhole is that of its ray") {
  CHECK(test::round_trip_error(kinect) < 1e-10);
  test::check_points_lie_on_their_rays(kinect);
}

TEST_CASE("the Jacobian of a pinhole agrees with central differences") { test::check_jacobian(kinect); }

TEST_CASE("a pinhole sees nothing behind itself and nothing that is not a number") { test::check_bad_input(kinect); }

TEST_CASE("a pinhole is built by names or by position") {
  CHECK(pinhole{{.width = 640, .height = 480, .fx = 525.0, .fy = 520.0, .cx = 319.5, .cy = 239.5}} == kinect);
  CHECK(pinhole{camera::intrinsics{640, 480, 525.0, 520.0, 319.5, 239.5}} == kinect);
  CHECK(!(pinhole{640, 480, 525.0, 520.0, 319.5, 239.0} == kinect));
  CHECK(kinect.width() == 640);
  CHECK(kinect.height() == 480);
  CHECK(kinect.k().fy == 520.0);
  CHECK(*pinhole{}.project({1, 2, 4}) == vec2{0.25, 0.5});
}

// SPDX-License-Identifier: BSD-3-Clause
#include <string_view>

#include <orbis/camera/any.hpp>

#include "camera/model_checks.hpp"

using namespace orbis;
using namespace orbis::camera;

static_assert(camera_model<any_camera>);

namespace {

const intrinsics k{320, 240, 260.0, 261.0, 160.0, 119.0};
const pinhole ideal{k};
const radial_tangential lens{k, {.k1 = 0.1, .k2 = -0.2, .p1 = 0.001}};
const kannala_brandt fisheye{k, {.k1 = 0.01}};

template <class Model>
void check_is_the_same(const any_camera& any, const Model& model, std::string_view name) {
  CHECK(any.model_name() == name);
  CHECK((any.width() == 320 && any.height() == 240 && any.k() == k));
  REQUIRE(any.get_if<Model>() != nullptr);
  CHECK(*any.get_if<Model>() == model);
  for (const vec3& p : test::points_in_view(model, 50)) {
    matrix<2, 3> ours, theirs;
    CHECK(any.project(p) == model.project(p));
    CHECK(any.project(p, ours) == model.project(p, theirs));
    CHECK(ours == theirs);
    CHECK(any.unproject(*any.project(p)) == model.unproject(*model.project(p)));
  }
  CHECK(any.visit([](const auto& m) { return m.width(); }) == 320);
}

}  // namespace

TEST_CASE("any camera behaves as the model it holds") {
  check_is_the_same(ideal, ideal, "pinhole");
  check_is_the_same(lens, lens, "radtan");
  check_is_the_same(fisheye, fisheye, "kannala_brandt");
  test::check_bad_input(any_camera{lens});
}

TEST_CASE("any camera is a value") {
  any_camera a = ideal;
  const any_camera b = lens;
  CHECK(!(a == b));
  a = b;
  CHECK(a == b);
  CHECK(a.get_if<pinhole>() == nullptr);
  a = fisheye;
  CHECK(a.model_name() == "kannala_brandt");
  CHECK(any_camera{}.model_name() == "pinhole");
}

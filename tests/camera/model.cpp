// SPDX-License-Identifier: BSD-3-Clause
#include <concepts>
#include <optional>
#include <type_traits>

#include <orbis/camera/any.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/types.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// Every ray is parallel to the axis: 100 pixels per metre.
struct orthographic {
  [[nodiscard]] static int width() { return 640; }
  [[nodiscard]] static int height() { return 480; }
  [[nodiscard]] static std::optional<vec2> project(const vec3& p) { return vec2{100.0 * p.x(), 100.0 * p.y()}; }
  [[nodiscard]] static std::optional<vec2> project(const vec3& p, matrix<2, 3>& jacobian) {
    jacobian << 100.0, 0.0, 0.0, 0.0, 100.0, 0.0;
    return project(p);
  }
  [[nodiscard]] static std::optional<vec3> unproject(const vec2& pixel) {
    return vec3{pixel.x() / 100.0, pixel.y() / 100.0, 1.0};
  }
};
struct without_jacobian {
  [[nodiscard]] static int width() { return 640; }
  [[nodiscard]] static int height() { return 480; }
  [[nodiscard]] static std::optional<vec2> project(const vec3& p) { return orthographic::project(p); }
  [[nodiscard]] static std::optional<vec3> unproject(const vec2& pixel) { return orthographic::unproject(pixel); }
};
struct without_size : orthographic {
  void width() const {}
};
struct always_projects : orthographic {
  [[nodiscard]] static vec2 project(const vec3& p) { return {p.x(), p.y()}; }
};

template <camera::camera_model Camera>
double there_and_back(const Camera& camera, const vec3& point) {
  return (camera.unproject(camera.project(point).value()).value() - point).norm();
}

}  // namespace

static_assert(camera::camera_model<camera::pinhole> && camera::camera_model<camera::radial_tangential> &&
              camera::camera_model<camera::kannala_brandt> && camera::camera_model<camera::any_camera>);
static_assert(camera::camera_model<orthographic>);
static_assert(!camera::camera_model<without_jacobian> && !camera::camera_model<without_size> &&
              !camera::camera_model<always_projects> && !camera::camera_model<int>);
static_assert(std::same_as<camera::checked_camera<orthographic>::type, orthographic>);

TEST_CASE("any type with the members of a camera model is one") {
  CHECK(there_and_back(orthographic{}, {0.3, -0.2, 1.0}) < 1e-12);
  CHECK(there_and_back(camera::pinhole{640, 480, 500.0, 500.0, 320.0, 240.0}, {0.3, -0.2, 1.0}) < 1e-12);
}

TEST_CASE("A function gets the model of a camera that is known only at run time") {
  const camera::intrinsics k{640, 480, 525.0, 525.0, 319.5, 239.5};
  const auto is_fisheye = [](const auto& model) {
    return std::same_as<std::remove_cvref_t<decltype(model)>, camera::kannala_brandt>;
  };
  CHECK(camera::with_model(camera::any_camera{camera::kannala_brandt{k, {}}}, is_fisheye));
  CHECK(camera::with_model(camera::kannala_brandt{k, {}}, is_fisheye));
  CHECK_FALSE(camera::with_model(camera::any_camera{camera::pinhole{k}}, is_fisheye));
  CHECK(camera::with_model(orthographic{}, [](const orthographic& own) { return own.width(); }) == 640);
}

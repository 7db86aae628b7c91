// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A camera whose model is only known at run time.
#pragma once

#include <concepts>
#include <iterator>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// Holds one of the library's camera models as a value; every call dispatches on the model. In hot loops, dispatch
/// once: `camera.visit([&](const auto& model) { ... })`. Satisfies `camera_model`.
class any_camera {
 public:
  any_camera() = default;
  any_camera(const pinhole& c) : model_{c} {}            // NOLINT(google-explicit-constructor)
  any_camera(const radial_tangential& c) : model_{c} {}  // NOLINT(google-explicit-constructor)
  any_camera(const kannala_brandt& c) : model_{c} {}     // NOLINT(google-explicit-constructor)

  /// Returns `f(model)` for the held model.
  template <class F>
  decltype(auto) visit(F&& f) const {
    return std::visit(std::forward<F>(f), model_);
  }
  /// The model, or null if it is not an `M`.
  template <class M>
  [[nodiscard]] const M* get_if() const noexcept {
    return std::get_if<M>(&model_);
  }
  /// Name of the model in camera files: "pinhole", "radtan" or "kannala_brandt".
  [[nodiscard]] std::string_view model_name() const noexcept {
    constexpr std::string_view names[] = {"pinhole", "radtan", "kannala_brandt"};
    static_assert(std::size(names) == std::variant_size_v<decltype(model_)>, "a name for each model");
    return names[model_.index()];
  }

  [[nodiscard]] int width() const noexcept { return k().width; }
  [[nodiscard]] int height() const noexcept { return k().height; }
  /// Image size and camera matrix.
  [[nodiscard]] const intrinsics& k() const noexcept {
    return visit([](const auto& c) -> const intrinsics& { return c.k(); });
  }
  [[nodiscard]] std::optional<vec2> project(const vec3& p) const {
    return visit([&](const auto& c) { return c.project(p); });
  }
  [[nodiscard]] std::optional<vec2> project(const vec3& p, matrix<2, 3>& jacobian) const {
    return visit([&](const auto& c) { return c.project(p, jacobian); });
  }
  [[nodiscard]] std::optional<vec3> unproject(const vec2& pixel) const {
    return visit([&](const auto& c) { return c.unproject(pixel); });
  }

  friend bool operator==(const any_camera&, const any_camera&) = default;

 private:
  std::variant<pinhole, radial_tangential, kannala_brandt> model_;
};

}  // namespace orbis::camera

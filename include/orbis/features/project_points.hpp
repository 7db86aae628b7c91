// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Predicted projections of known points into a camera image, for the source `projected`.
#pragma once

#include <concepts>
#include <optional>
#include <type_traits>
#include <utility>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/projected.hpp>

namespace orbis::features {

/// A world point (metres): a `vec3`, or a type with a `vec3` member `position`.
template <class P>
concept world_point = std::convertible_to<const P&, const vec3&> || requires(const P& p) {
  { p.position } -> std::convertible_to<const vec3&>;
};

/// Projects world points into the image of a camera at a given pose. The result is empty if the point is behind the
/// camera or outside the image. Optional members of a point in addition to `position`:
/// - `normal`: the unit vector from the point towards its earlier viewpoints, for gating the viewing angle;
/// - `min_distance`, `max_distance`: the range of distances at which the point is detectable, for predicting the level.
template <camera::camera_model Camera>
class camera_projection {
 public:
  camera_projection(Camera camera, const se3& T_world_camera)
      : camera_{std::move(camera)}, origin_{T_world_camera.translation()}, T_camera_world_{T_world_camera.inverse()} {}

  template <world_point P>
  [[nodiscard]] std::optional<projection> operator()(const P& point) const {
    const vec3& position = position_of(point);
    const auto pixel = camera_.project(T_camera_world_ * position);
    if (!pixel || !(pixel->x() > -0.5 && pixel->y() > -0.5 && pixel->x() < camera_.width() - 0.5 &&
                    pixel->y() < camera_.height() - 0.5))
      return std::nullopt;
    const vec3 towards = origin_ - position;
    const double distance = norm(towards);
    projection p;
    p.x = static_cast<float>(pixel->x());
    p.y = static_cast<float>(pixel->y());
    p.distance = static_cast<float>(distance);
    if constexpr (requires { point.normal; }) p.cosine = static_cast<float>(dot(towards, point.normal) / distance);
    if constexpr (requires { point.min_distance; }) p.min_distance = static_cast<float>(point.min_distance);
    if constexpr (requires { point.max_distance; }) p.max_distance = static_cast<float>(point.max_distance);
    return p;
  }

 private:
  template <class P>
  [[nodiscard]] static const vec3& position_of(const P& point) noexcept {
    if constexpr (requires { point.position; }) {
      return point.position;
    } else {
      return point;
    }
  }

  Camera camera_;
  vec3 origin_;
  se3 T_camera_world_;
};

}  // namespace orbis::features

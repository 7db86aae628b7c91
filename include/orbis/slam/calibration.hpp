// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Calibration of the camera by a map that was made with it: the intrinsic parameters that agree best with all
/// keyframes, as far as the motion of the camera determines them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/parameters.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/self_calibration.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/mapping/map_bundle.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam {

/// A camera that can be calibrated: `any_camera`, and the models it can hold.
template <class C>
concept calibrated_camera = std::same_as<C, camera::any_camera> || std::same_as<C, camera::pinhole> ||
    std::same_as<C, camera::radial_tangential> || std::same_as<C, camera::kannala_brandt>;

struct calibration_options {
  /// A group of parameters (focal lengths; principal point and tangential distortion; radial distortion) is held where
  /// its standard deviation moves a pixel anywhere in the image by more than this, pixels.
  double max_effect = 2.0;
  /// The weight of a depth relative to tracking. Its errors are alike from image to image (depth that is not where its
  /// colour is, a depth camera's own distortion) and would be taken for the lens's; a small weight does to fix the size
  /// of the world.
  double depth_weight = 0.0025;
  bool keeps_aspect = true;  ///< the ratio of the focal lengths is known: pixels are square, or as they are given
  /// Made one after the other, where most was seen; the work grows with the third power of their number.
  std::size_t max_keyframes = 300;
};

/// What the map tells of a parameter.
struct calibrated_parameter {
  std::string_view name;  ///< as camera files and OpenCV call it
  double before = 0.0;
  double after = 0.0;
  double deviation = 0.0;  ///< one standard deviation; 0 where the parameter was held
  bool is_held = false;    ///< the motion does not tell; `after` is `before`
};

/// What is known of a calibration, whatever the model of its camera.
struct calibration_summary {
  std::vector<calibrated_parameter>
      parameters;  ///< those that the model has; of `radial_tangential` k3 if it is not 0, k4 to k6 never
  std::size_t keyframes = 0, landmarks = 0;  ///< that took part
  std::size_t observations = 0, outliers = 0;
  double initial_rms = 0.0;  ///< of the observations that are no outliers, in standard deviations
  double final_rms = 0.0;    ///< for the camera that was found
  [[nodiscard]] bool is_complete() const {
    return std::none_of(parameters.begin(), parameters.end(), [](const auto& p) { return p.is_held; });
  }
};

template <calibrated_camera Camera>
struct calibration : calibration_summary {
  Camera camera;
};

namespace detail {

/// Where the stretch of `count` keyframes begins that observes most landmarks. O(keypoints).
template <feature_descriptor D>
[[nodiscard]] std::size_t first_to_take(const basic_map<D>& m, std::size_t count) {
  std::vector<std::size_t> up_to{0};  // so many observations by the keyframes before
  for (const auto& k : m.keyframes())
    up_to.push_back(up_to.back() +
                    static_cast<std::size_t>(k.landmarks.size() - static_cast<std::size_t>(std::count(
                                                                      k.landmarks.begin(), k.landmarks.end(), no_id))));
  std::size_t first = 0;
  for (std::size_t i = 0; i + count < up_to.size(); ++i)
    if (up_to[i + count] - up_to[i] > up_to[first + count] - up_to[first]) first = i;
  return first;
}

/// The keyframes that take part, and the landmarks that two of them observe.
template <feature_descriptor D, class Camera>
[[nodiscard]] bundle_snapshot calibration_problem_of(const basic_map<D>& m, const camera_rig<Camera>& rig,
                                                     std::size_t max_keyframes) {
  bundle_snapshot s;
  std::vector<std::uint32_t> index(m.keyframe_end().value(), no_id);
  const std::size_t first = first_to_take(m, max_keyframes);
  std::size_t number = 0;
  for (const auto& k : m.keyframes()) {
    const std::size_t i = number++;
    if (i < first || i - first >= max_keyframes) continue;
    index[k.id.value()] = static_cast<std::uint32_t>(s.keyframes.size());
    s.add_keyframe(k.id, k.T_world_camera, false);
  }
  for (const auto& l : m.landmarks()) s.add_shared_landmark(m, l, rig, [&](keyframe_id k) { return index[k.value()]; });
  return s;
}

/// Which of the parameters belong together, in the order in which they are given up.
template <camera::parametric_camera Camera>
[[nodiscard]] constexpr std::array<std::uint32_t, 3> parameter_groups() {
  constexpr std::uint32_t focal_lengths = 0x3, principal_point = 0xc;
  constexpr std::uint32_t tangential = std::same_as<Camera, camera::radial_tangential> ? 0xc0 : 0;
  constexpr std::uint32_t all = (1U << camera::parameters_of<Camera>::count) - 1U,
                          central = principal_point | tangential;
  return {all & ~(focal_lengths | central), central, focal_lengths};
}

/// The parameters that are estimated if all are determined. Of a lens whose distortion is a fraction, numerator and
/// denominator are determined only together, and so are, nearly, more than two powers of the radius.
template <camera::parametric_camera Camera>
[[nodiscard]] std::uint32_t usual_parameters(const Camera&) {
  return (1U << camera::parameters_of<Camera>::count) - 1U;
}
[[nodiscard]] inline std::uint32_t usual_parameters(const camera::radial_tangential& c) {
  return c.distortion().k3 != 0.0 ? 0x1ffU : 0xffU;
}

/// How far one standard deviation of the parameters named moves a pixel, at most, pixels.
template <camera::parametric_camera Camera, class Covariance>
[[nodiscard]] double effect_of(const Camera& camera, const Covariance& covariance, std::uint32_t parameters) {
  constexpr int count = camera::parameters_of<Camera>::count, steps = 8;
  double largest = 0.0;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= steps; ++j) {
      const auto ray = camera.unproject({(camera.width() - 1.0) * i / steps, (camera.height() - 1.0) * j / steps});
      matrix<2, 3> by_point;
      matrix<2, count> by_parameters;
      if (!ray || !camera::parameters_of<Camera>::project(camera, *ray, by_point, by_parameters)) continue;
      for (int k = 0; k != count; ++k)
        if ((parameters >> k & 1U) == 0) by_parameters.col(k).setZero();
      const mat2 moved = by_parameters * covariance * by_parameters.transpose();
      largest = std::max(largest, std::sqrt(std::max(0.0, moved.trace())));
    }
  return largest;
}

template <camera::parametric_camera Camera>
[[nodiscard]] result<calibration<Camera>> calibrate_model(const Camera& before, const bundle_snapshot& problem,
                                                          double bf, const calibration_options& options,
                                                          const progress& callback) {
  using parameters = camera::parameters_of<Camera>;
  const std::uint32_t usual = usual_parameters(before);
  constexpr auto groups = parameter_groups<Camera>();
  std::uint32_t free = usual;
  std::optional<optimize::self_calibrated<Camera>> found;
  while (!found) {
    auto poses = problem.poses;
    auto points = problem.points;
    auto tried =
        optimize::self_calibrate<Camera>(before, poses, points, problem.observations,
                                         {.bf = bf, .free = free, .keeps_aspect = options.keeps_aspect}, callback);
    if (!tried && tried.error().code != errc::degenerate) return fail(tried.error());
    const auto is_vague = [&](std::uint32_t group) {
      return (free & group) != 0 &&
             (!tried || effect_of(tried->camera, tried->covariance, free & group) > options.max_effect);
    };
    if (std::none_of(groups.begin(), groups.end(), is_vague)) {
      found = *std::move(tried);
      break;
    }
    // Distortion must not make up for a focal length that is held: the groups are given up in their order.
    free &= ~*std::find_if(groups.begin(), groups.end(), [&](std::uint32_t group) { return (free & group) != 0; });
    if (free == 0)
      return fail(errc::degenerate, "calibration",
                  tried ? "the motion of the camera does not determine its parameters" : tried.error().message);
  }
  calibration<Camera> out{{{},
                           problem.poses.size(),
                           problem.points.size(),
                           found->observations,
                           found->outliers,
                           found->initial_rms,
                           found->final_rms},
                          found->camera};
  const auto from = parameters::get(before), to = parameters::get(found->camera);
  for (int i = 0; i != parameters::count; ++i)
    if ((usual >> i & 1U) != 0)
      out.parameters.push_back({parameters::names[static_cast<std::size_t>(i)], from[i], to[i],
                                std::sqrt(std::max(0.0, found->covariance(i, i))), (free >> i & 1U) == 0});
  return out;
}

}  // namespace detail

/// Refines the camera of a map by its keyframes and landmarks, whose poses and positions are refined with it but not
/// changed in the map. The map should be made again with the camera that was found, and that be refined in turn, until
/// nothing changes: what did not fit the first camera had been left out of the map.
///
/// `rig`: as the map was made with (`make_rig`). @pre options.depth_weight > 0. Errors: `no_data` for a map without
/// landmarks that two keyframes observe; `degenerate` if its motion determines no parameter, or nothing has depth;
/// `cancelled` by `callback`. Complexity: see `optimize::self_calibrate`, which is called up to four times.
template <feature_descriptor D, calibrated_camera Camera>
[[nodiscard]] result<calibration<Camera>> calibrate(const basic_map<D>& m, const camera_rig<Camera>& rig,
                                                    const calibration_options& options = {},
                                                    const progress& callback = {}) {
  camera_rig<Camera> loose = rig;  // a depth error counts as many pixels as bf says
  loose.model.bf *= std::sqrt(options.depth_weight);
  const detail::bundle_snapshot problem = detail::calibration_problem_of(m, loose, options.max_keyframes);
  if constexpr (std::same_as<Camera, camera::any_camera>) {
    return rig.camera().visit([&](const auto& model) -> result<calibration<Camera>> {
      auto found = detail::calibrate_model(model, problem, loose.model.bf, options, callback);
      if (!found) return fail(found.error());
      return calibration<Camera>{std::move(*found), found->camera};
    });
  } else {
    return detail::calibrate_model(rig.camera(), problem, loose.model.bf, options, callback);
  }
}

}  // namespace orbis::slam

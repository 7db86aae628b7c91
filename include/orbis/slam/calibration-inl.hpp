// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of calibration.hpp.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include <orbis/camera/parameters.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/self_calibration.hpp>
#include <orbis/slam/calibration.hpp>
#include <orbis/slam/detail/mapping/map_bundle.hpp>

namespace orbis::slam {

namespace detail {

/// Returns the index of the first of the `count` consecutive keyframes with the most observations. O(keypoints).
template <feature_descriptor D>
[[nodiscard]] std::size_t first_to_take(const basic_map<D>& m, std::size_t count) {
  std::vector<std::size_t> up_to{0};  // cumulative number of observations before each keyframe
  for (const auto& k : m.keyframes())
    up_to.push_back(up_to.back() +
                    static_cast<std::size_t>(k.landmarks.size() - static_cast<std::size_t>(std::count(
                                                                      k.landmarks.begin(), k.landmarks.end(), no_id))));
  std::size_t first = 0;
  for (std::size_t i = 0; i + count < up_to.size(); ++i)
    if (up_to[i + count] - up_to[i] > up_to[first + count] - up_to[first]) first = i;
  return first;
}

/// Returns the selected keyframes, and the landmarks that at least two of them observe.
template <feature_descriptor D, class Camera>
[[nodiscard]] bundle_snapshot make_calibration_problem(const basic_map<D>& m, const camera_rig<Camera>& rig,
                                                       const calibration_options& options) {
  bundle_snapshot s;
  std::unordered_map<std::uint32_t, std::uint32_t> index;  // from keyframe id to index
  const std::size_t first = first_to_take(m, options.max_keyframes);
  std::size_t number = 0;
  for (const auto& k : m.keyframes()) {
    const std::size_t i = number++;
    if (i < first || i - first >= options.max_keyframes) continue;
    index.emplace(k.id.value(), static_cast<std::uint32_t>(s.keyframes.size()));
    s.add_keyframe(k.id, k.T_world_camera, false);
  }
  const auto index_of = [&](keyframe_id k) {
    const auto i = index.find(k.value());
    return i != index.end() ? i->second : no_id;
  };
  std::vector<landmark_id> shared;
  for (const auto& l : m.landmarks())
    if (is_shared(l, index_of)) shared.push_back(l.id);
  const std::size_t count = std::min(shared.size(), options.max_landmarks);
  for (std::size_t i = 0; i != count; ++i)
    s.add_landmark(m, m.landmark_at(shared[i * shared.size() / count]), rig, index_of);
  return s;
}

/// Groups of parameters that are estimated or fixed together, in the order in which they are fixed.
template <camera::parametric_camera Camera>
[[nodiscard]] constexpr std::array<std::uint32_t, 3> parameter_groups() {
  constexpr std::uint32_t focal_lengths = 0x3, principal_point = 0xc;
  constexpr std::uint32_t tangential = std::same_as<Camera, camera::radial_tangential> ? 0xc0 : 0;
  constexpr std::uint32_t all = (1U << camera::parameters_of<Camera>::count) - 1U,
                          central = principal_point | tangential;
  return {all & ~(focal_lengths | central), central, focal_lengths};
}

/// The parameters that are estimated if the motion determines all of them. If the distortion is a rational function,
/// only its numerator and denominator together are determined, not each separately; the same is nearly true of
/// coefficients for more than two powers of the radius.
template <camera::parametric_camera Camera>
[[nodiscard]] std::uint32_t usual_parameters(const Camera&) {
  return (1U << camera::parameters_of<Camera>::count) - 1U;
}
[[nodiscard]] inline std::uint32_t usual_parameters(const camera::radial_tangential& c) {
  return c.distortion().k3 != 0.0 ? 0x1ffU : 0xffU;
}

/// Returns the largest displacement of an image point, in pixels, when the given parameters change by one standard
/// deviation.
template <camera::parametric_camera Camera, class Covariance>
[[nodiscard]] double max_pixel_deviation(const Camera& camera, const Covariance& covariance, std::uint32_t parameters) {
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
      const mat2 moved = by_parameters * covariance * transposed(by_parameters);
      largest = std::max(largest, std::sqrt(std::max(0.0, trace(moved))));
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
  // The errors of patches in one image have common causes, such as an error in the camera motion, so that they average
  // out less than those of corners.
  constexpr double patch_correlation = 2.5;
  const bool by_patches = std::any_of(problem.observations.begin(), problem.observations.end(),
                                      [](const auto& o) { return o.depth_weight < 1.0; });
  auto observations = problem.observations;
  for (optimize::bundle_observation& o : observations) o = optimize::without_smear(o);
  std::optional<optimize::self_calibrated<Camera>> found;
  while (!found) {
    auto poses = problem.poses;
    auto points = problem.points;
    auto tried = optimize::self_calibrate<Camera>(before, poses, points, observations,
                                                  {.bf = bf,
                                                   .free = free,
                                                   .keeps_aspect = options.keeps_aspect,
                                                   .relative_tolerance = options.relative_tolerance},
                                                  callback);
    if (!tried && tried.error().code != errc::degenerate) return fail(tried.error());
    if (tried && by_patches) tried->covariance *= patch_correlation * patch_correlation;
    const auto is_vague = [&](std::uint32_t group) {
      return (free & group) != 0 &&
             (!tried || max_pixel_deviation(tried->camera, tried->covariance, free & group) > options.max_effect);
    };
    if (std::none_of(groups.begin(), groups.end(), is_vague)) {
      found = *std::move(tried);
      break;
    }
    // Distortion must not compensate for a fixed focal length: the groups are fixed in order.
    free &= ~*std::find_if(groups.begin(), groups.end(), [&](std::uint32_t group) { return (free & group) != 0; });
    if (free == 0 || options.needs_all)
      return fail(errc::degenerate, "calibration",
                  !tried      ? tried.error().message
                  : free != 0 ? "the motion of the camera does not determine all of its parameters"
                              : "the motion of the camera does not determine its parameters");
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

template <feature_descriptor D, calibrated_camera Camera>
result<calibration<Camera>> calibrate(const basic_map<D>& m, const camera_rig<Camera>& rig,
                                      const calibration_options& options, const progress& callback) {
  camera_rig<Camera> loose = rig;  // bf converts a depth error to pixels
  loose.model.bf *= std::sqrt(options.depth_weight);
  const detail::bundle_snapshot problem = detail::make_calibration_problem(m, loose, options);
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

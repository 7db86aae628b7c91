// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of pnp.hpp.
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <string>
#include <utility>

#include <orbis/camera/pinhole.hpp>
#include <orbis/optimize/detail/minimal/pnp_estimator.hpp>
#include <orbis/optimize/pnp.hpp>

namespace orbis::optimize {

template <camera::camera_model Camera>
result<pose_estimate> estimate_pose(std::span<const vec3> points_world, std::span<const vec2> pixels,
                                    const Camera& camera, const pnp_options& options, pnp_workspace& workspace) {
  constexpr const char* where = "pnp";
  const std::size_t n = points_world.size();
  if (n != pixels.size()) return fail(errc::invalid_argument, where, "the lists of points and pixels differ in length");
  ransac_options asked = detail::ransac_part(options);
  if (const char* const fault = detail::find_fault(asked)) return fail(errc::invalid_argument, where, fault);
  asked.min_inliers = 0;  // inliers are counted at the end, with the exact camera model
  if (n < 3) return fail(errc::no_data, where, "fewer than three matches");

  detail::pnp_matches& matches = workspace.matches;
  matches.assign(points_world, pixels, camera, options.seed);
  if (matches.size() < 3)
    return fail(errc::degenerate, where,
                "only " + std::to_string(matches.size()) + " of " + std::to_string(n) +
                    " matches are finite and in the camera's view; three are needed");
  using estimator_type = detail::pnp_estimator<detail::pnp_matches>;
  const estimator_type estimator(matches);
  const result<ransac_estimate<estimator_type::model>> found = ransac(estimator, asked, workspace.ransac);
  if (!found) {
    if (found.error().code != errc::degenerate) return fail(found.error());
    const std::string why = detail::pnp_degeneracy(matches);
    return fail(errc::degenerate, where, why.empty() ? found.error().message : why);
  }

  // From here on, the exact camera model is used: find the pose with the smallest truncated squared error, and its
  // inliers.
  const double squared_threshold = options.threshold * options.threshold;
  const auto error_at = [&](const se3& T_camera_world, std::size_t i) {
    const auto pixel = camera.project(T_camera_world * points_world[i]);
    return pixel ? squared_norm(*pixel - pixels[i]) : std::numeric_limits<double>::infinity();
  };
  std::vector<std::uint32_t> inliers;
  inliers.reserve(n);
  double sum = 0.0;
  const auto judge = [&](const se3& T_world_camera) {  // computes the score, the inliers and their sum of squares
    const se3 T_camera_world = T_world_camera.inverse();
    inliers.clear();
    sum = 0.0;
    for (std::size_t i = 0; i != n; ++i) {
      const double e = error_at(T_camera_world, i);
      if (!(e < squared_threshold)) continue;
      inliers.push_back(static_cast<std::uint32_t>(i));
      sum += e;
    }
    return sum + squared_threshold * static_cast<double>(n - inliers.size());
  };
  const auto in_world = [&](const detail::centred_pose& p) {
    const so3 rotation(p.rotation);
    return se3(rotation, p.translation - rotation * matches.centre).inverse();
  };
  estimator_type::model model = found->model;
  if (const auto polished = estimator.refine(model, found->inliers, 10)) model = *polished;
  se3 pose = in_world(model.pose);
  double score = judge(pose);
  if constexpr (!std::same_as<Camera, camera::pinhole>) {  // for a pinhole camera, the loops above are already exact
    for (int k = 0; k != 3 && inliers.size() >= 3; ++k) {
      workspace.part.assign(inliers.begin(), inliers.end());
      const auto sum_up = [&](const detail::centred_pose& at, detail::pose_equations& e) {
        e = {zeros<mat6>(), zeros<vec6>(), 0.0};
        for (const std::uint32_t i : workspace.part) {
          const vec3 p = at.rotation * (points_world[i] - matches.centre) + at.translation;
          matrix<2, 3> j;
          const auto pixel = camera.project(p, j);
          if (!pixel) {
            e.cost = std::numeric_limits<double>::infinity();
            return;
          }
          const matrix<2, 6> by_motion = side_by_side(j, -(j * hat<double>(p)));
          const vec2 r = *pixel - pixels[i];
          e.h += transposed(by_motion) * by_motion;
          e.g += transposed(by_motion) * r;
          e.cost += squared_norm(r);
        }
      };
      const auto refined = detail::descend_pose(model.pose, 10, sum_up);
      if (!refined) break;
      const double next = judge(in_world(*refined));
      if (!(next < score)) break;
      score = next;
      model.pose = *refined;
      pose = in_world(model.pose);
    }
  }
  judge(pose);  // again: the last evaluated pose may not be the best one
  if (auto enough = detail::enough_inliers(where, inliers.size(), n, options.min_inliers, 3); !enough)
    return fail(std::move(enough.error()));
  const double rmse = std::sqrt(sum / static_cast<double>(inliers.size()));
  return pose_estimate{pose, std::move(inliers), rmse, found->iterations};
}

}  // namespace orbis::optimize

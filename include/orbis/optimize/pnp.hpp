// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Perspective-n-point: the camera pose from known points and their pixels, many of which may be wrongly matched.
///
/// Sources: M. Fischler, R. Bolles, CACM 24 (1981) for P3P in RANSAC; `ransac_policies.hpp` names those of the parts.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/p3p_equations.hpp>
#include <orbis/optimize/detail/minimal/pnp_estimator.hpp>
#include <orbis/optimize/detail/minimal/pnp_matches.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize {

/// Up to four poses `T_world_camera`, a range.
class p3p_solutions {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] const se3& operator[](std::size_t i) const noexcept { return poses_[i]; }
  [[nodiscard]] const se3* begin() const noexcept { return poses_.data(); }
  [[nodiscard]] const se3* end() const noexcept { return poses_.data() + size_; }
  void push_back(const se3& pose) noexcept {
    if (size_ < poses_.size()) poses_[size_++] = pose;
  }

 private:
  std::array<se3, 4> poses_;
  std::size_t size_ = 0;
};

/// Perspective three-point: all poses `T_world_camera` from which `points_world[i]` (metres) lies on the ray `rays[i]`
/// (camera frame, of any positive length), in front of the camera. Empty if the points are collinear or anything is not
/// finite. Constant time, no allocation. Source: see `detail/minimal/p3p_equations.hpp`.
[[nodiscard]] inline p3p_solutions p3p(const std::array<vec3, 3>& points_world, const std::array<vec3, 3>& rays) {
  p3p_solutions solutions;
  detail::for_each_p3p(points_world,
                       {normalized(vec3(rays[0])), normalized(vec3(rays[1])), normalized(vec3(rays[2]))},
                       [&](const mat3& rotation, const vec3& translation) {
                         const se3 pose = se3(so3(rotation), translation).inverse();
                         if (all_finite(pose.translation())) solutions.push_back(pose);
                       });
  return solutions;
}

struct pnp_options {
  double threshold = 3.0;  ///< largest reprojection error of an inlier, pixels
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 6;  ///< fewer than this is a failure
  std::uint64_t seed = 1;
};

struct pose_estimate {
  se3 T_world_camera;
  std::vector<std::uint32_t> inliers;  ///< exactly the matches within the threshold at the pose, ascending
  double rmse = 0.0;                   ///< of the inliers' reprojection errors, pixels
  std::size_t iterations = 0;
};

/// Memory that calls may share one after the other: once it is large enough, an estimate allocates only its inliers.
struct pnp_workspace {
  detail::pnp_matches matches;
  ransac_workspace ransac;
  std::vector<std::uint32_t> part;
};

/// The pose from which most of `points_world[i]` (metres) project to `pixels[i]`: P3P in RANSAC with a sequential test
/// of the models; each new best pose is refined on its inliers. Matches that are not finite are outliers, as are pixels
/// that the camera cannot unproject. Deterministic by `options.seed`. O(matches) for each sample that is scored to the
/// end. Errors: `invalid_argument` for spans of different length or options out of range; `no_data` below three
/// matches; `degenerate` if fewer than three can be used, all points lie on a line or in one place, or no pose has
/// `min_inliers` inliers. The message says which.
template <camera::camera_model Camera>
[[nodiscard]] result<pose_estimate> estimate_pose(std::span<const vec3> points_world, std::span<const vec2> pixels,
                                                  const Camera& camera, const pnp_options& options,
                                                  pnp_workspace& workspace) {
  constexpr const char* where = "pnp";
  const std::size_t n = points_world.size();
  if (n != pixels.size()) return fail(errc::invalid_argument, where, "the lists of points and pixels differ in length");
  ransac_options asked = detail::ransac_part(options);
  if (const char* const fault = detail::fault_of(asked)) return fail(errc::invalid_argument, where, fault);
  asked.min_inliers = 0;  // inliers are counted at the end, with the camera itself
  if (n < 3) return fail(errc::no_data, where, "fewer than three matches");

  detail::pnp_matches& matches = workspace.matches;
  matches.assign(points_world, pixels, camera, options.seed);
  if (matches.size() < 3)
    return fail(errc::degenerate, where,
                "of " + std::to_string(n) + " matches " + std::to_string(matches.size()) +
                    " are finite and in the camera's view, three are needed");
  using estimator_type = detail::pnp_estimator;
  const estimator_type estimator(matches);
  const result<ransac_estimate<estimator_type::model>> found = ransac(
      estimator, asked, ransac_policies{msac{}, uniform_sampling{}, sprt{}, iterated_refinement{}}, workspace.ransac);
  if (!found) {
    if (found.error().code != errc::degenerate) return fail(found.error());
    const std::string why = detail::pnp_degeneracy(matches);
    return fail(errc::degenerate, where, why.empty() ? found.error().message : why);
  }

  // From here on with the camera itself: the pose with the least truncated squared error, and its inliers.
  const double squared_threshold = options.threshold * options.threshold;
  const auto error_at = [&](const se3& T_camera_world, std::size_t i) {
    const auto pixel = camera.project(T_camera_world * points_world[i]);
    return pixel ? squared_norm(*pixel - pixels[i]) : std::numeric_limits<double>::infinity();
  };
  std::vector<std::uint32_t> inliers;
  inliers.reserve(n);
  double sum = 0.0;
  const auto judge = [&](const se3& T_world_camera) {  // the score; the inliers and their sum of squares
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
  if constexpr (!std::same_as<Camera, camera::pinhole>) {  // for which the loops above are exact
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
          matrix<2, 6> by_motion;
          by_motion << j, -(j * hat<double>(p));
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
  judge(pose);  // again: the last pose judged may not be the one that was kept
  if (auto enough = detail::enough_inliers(where, inliers.size(), n, options.min_inliers, 3); !enough)
    return fail(std::move(enough.error()));
  const double rmse = std::sqrt(sum / static_cast<double>(inliers.size()));
  return pose_estimate{pose, std::move(inliers), rmse, found->iterations};
}

/// As above, with memory of its own.
template <camera::camera_model Camera>
[[nodiscard]] result<pose_estimate> estimate_pose(std::span<const vec3> points_world, std::span<const vec2> pixels,
                                                  const Camera& camera, const pnp_options& options = {}) {
  pnp_workspace workspace;
  return estimate_pose(points_world, pixels, camera, options, workspace);
}

}  // namespace orbis::optimize

#ifdef ORBIS_COMPILED
#include <orbis/optimize/detail/compiled/pnp.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The RANSAC estimator of homographies between the rays of two cameras of any model, with errors in pixels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/LU>

#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/descent.hpp>
#include <orbis/optimize/detail/minimal/homography_estimator.hpp>
#include <orbis/optimize/detail/minimal/image_matches.hpp>

namespace orbis::optimize::detail {

/// Returns the squared distance, in the unit of `metric_ray`, of a transferred ray from the observed one; infinite if
/// the transferred ray points behind the camera.
[[nodiscard]] inline double squared_transfer(const vec3& p, const metric_ray& seen) {
  if (!(p.z() > 0.0)) return std::numeric_limits<double>::infinity();
  const double dx = p.x() / p.z() - seen.x, dy = p.y() / p.z() - seen.y;
  const double u = seen.xx * dx + seen.xy * dy, v = seen.yy * dy;
  return u * u + v * v;
}

class ray_homography_estimator {
 public:
  struct model {
    mat3 forward, backward;  ///< both matrices give positive z for rays that are transferred to the front of the camera
  };
  static constexpr std::size_t sample_size = 4;

  explicit ray_homography_estimator(const std::vector<image_match>& matches) : matches_{matches} {}

  [[nodiscard]] std::size_t size() const noexcept { return matches_.size(); }

  [[nodiscard]] one_or_none<model> fit(const std::array<std::uint32_t, 4>& s) const {
    std::array<vec2, 4> first, second;
    for (std::size_t i = 0; i != 4; ++i) {
      const image_match& m = matches_[s[i]];
      first[i] = {m.first.x, m.first.y};
      second[i] = {m.second.x, m.second.y};
    }
    const auto h = homography_of_four(first, second);
    if (!h) return {};
    return {make_model(*h, matches_[s[0]].first.direction())};
  }

  /// Returns the mean of the squared errors of both transfers.
  [[nodiscard]] double squared_error(const model& m, std::size_t i) const {
    const image_match& x = matches_[i];
    return 0.5 * (squared_transfer(m.forward * x.first.direction(), x.second) +
                  squared_transfer(m.backward * x.second.direction(), x.first));
  }

  /// Refines a homography by Gauss-Newton on the transfer errors in both images.
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers) const {
    return refine(start, inliers, 4);
  }
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers,
                                            int steps) const {
    if (inliers.empty()) return std::nullopt;
    const vec3 in_front = matches_[inliers.front()].first.direction();
    const auto step = [&](const model& m, const homography_equations& e) -> std::optional<model> {
      const auto d = e.step();
      if (!d) return std::nullopt;
      return make_model(*d * m.forward, in_front);
    };
    return descend(
        start, steps, [&](const model& m) { return sum_up(m, inliers); }, step);
  }

 private:
  /// Creates a model from a homography; empty if the homography is singular.
  [[nodiscard]] static std::optional<model> make_model(const mat3& h, const vec3& in_front) {
    model m{h / norm(h), inverse(h)};
    if ((m.forward * in_front).z() < 0.0) m.forward = -m.forward;
    m.backward /= norm(m.backward);
    if ((m.backward * (m.forward * in_front)).z() < 0.0) m.backward = -m.backward;
    if (!all_finite(m.forward) || !all_finite(m.backward)) return std::nullopt;
    return m;
  }

  [[nodiscard]] homography_equations sum_up(const model& m, std::span<const std::uint32_t> inliers) const {
    homography_equations e;
    for (const std::uint32_t i : inliers) {
      const image_match& x = matches_[i];
      const auto add = [&](const vec3& p, const metric_ray& seen, const mat3& by_d, const vec3& moved) {
        const double inverse = 1.0 / p.z();
        const vec2 xy = head<2>(p) * inverse;
        mat2 metric;
        metric << seen.xx, seen.xy, 0.0, seen.yy;
        const vec2 r = metric * vec2(xy.x() - seen.x, xy.y() - seen.y);
        e.add(r, metric * derivative_of_projection(xy, inverse), by_d, moved);
      };
      const vec3 p = m.forward * x.first.direction();
      add(p, x.second, identity<mat3>(), p);
      add(m.backward * x.second.direction(), x.first, -m.backward, x.second.direction());
    }
    return e;
  }

  const std::vector<image_match>& matches_;
};

}  // namespace orbis::optimize::detail

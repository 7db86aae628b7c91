// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Separates the motion of the camera from that of an object moving in front of it.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/pnp.hpp>
#include <orbis/optimize/pose_refinement.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// The result for a frame whose matches do not all agree with a single pose.
struct motion_split {
  se3 T_world_camera;                  ///< pose from static matches
  std::size_t inliers = 0;             ///< number of matches that agree with the pose
  std::vector<std::uint8_t> outliers;  ///< 1 for each match that disagrees with the pose
  std::vector<std::uint8_t> moving;    ///< 1 for each match on a moving object; these are also outliers
  bool by_trust = false;               ///< true if the pose is from the trusted matches only
};

/// Minimum trust for a match to count as static.
inline constexpr double enough_trust = 0.7;
/// Minimum weight of a match, however low its trust.
inline constexpr double least_trust = 0.02;

/// Returns true if the number of outliers justifies a search for a second motion.
[[nodiscard]] inline bool may_hold_two_motions(std::size_t matches, std::size_t inliers,
                                               const moving_options& o) noexcept {
  const std::size_t outliers = matches - std::min(inliers, matches);
  return outliers >= o.min_features && static_cast<double>(outliers) > o.share * static_cast<double>(matches);
}

/// Searches for a second rigid motion when many matches disagree with a single pose, and decides which of the two
/// motions is that of the camera: the one with the greater sum of trust times spread. Matches with old landmarks are
/// trusted: an object that biases the pose is assumed to have appeared recently, or to be small compared with the
/// background. The candidate poses include the one estimated only from the trusted matches, starting from the
/// prediction. The second motion is found by RANSAC among the outliers of the first, as in P. H. S. Torr, "Geometric
/// motion segmentation and model selection", Phil. Trans. R. Soc. A 356 (1998).
template <camera::camera_model Camera>
class motion_splitter {
 public:
  /// `trust`: trust in each match, from 0 to 1. `predicted`: the expected pose of the camera; `fitted`: the pose from
  /// all matches, with which the `outliers` disagree. Empty if there is neither a second motion nor a better pose.
  /// O(matches); takes a few tenths of a millisecond. @pre one entry of `trust` and `outliers` for each observation
  [[nodiscard]] static std::optional<motion_split> split(std::span<const optimize::pose_observation> observations,
                                                         std::span<const double> trust,
                                                         const optimize::reprojection<Camera>& model,
                                                         const se3& predicted, const se3& fitted,
                                                         std::span<const std::uint8_t> outliers,
                                                         const moving_options& options, std::uint64_t seed) {
    assert(trust.size() == observations.size() && outliers.size() == observations.size());
    motion_splitter s{observations, trust, model, options, seed};
    se3 pose = fitted;
    double score = s.score(pose);
    bool changed = false, by_trust = false;
    const auto compete = [&](const std::optional<se3>& other, bool trusted) {
      constexpr double clearly = 1.02;
      const double value = other ? s.score(*other) : 0.0;
      if (!(value > (changed ? 1.0 : clearly) * score)) return;
      if (trusted && !s.outliers_form_body(*other)) return;
      score = value, pose = *other, changed = true, by_trust = trusted;
    };
    const std::vector<std::uint8_t> trusted = s.trusted();
    compete(s.refine_some(trusted, fitted), true);
    compete(s.refine_some(trusted, predicted), true);
    if (const std::optional<se3> second = s.second_motion(outliers)) compete(s.refine_on_agreeing(*second), false);
    motion_split out{pose, 0, {}, std::vector<std::uint8_t>(observations.size()), by_trust};
    if (changed) {
      out.outliers.resize(observations.size());
      s.judge(pose, out.outliers);
    } else {
      out.outliers.assign(outliers.begin(), outliers.end());
    }
    out.inliers = static_cast<std::size_t>(std::count(out.outliers.begin(), out.outliers.end(), std::uint8_t{0}));
    const bool moves = s.mark_moving(out);
    if (!changed && !moves) return std::nullopt;
    return out;
  }

  /// Returns true if the untrusted matches agree with the pose from all matches but not with the pose from the trusted
  /// ones: a slowly moving object biases the pose. O(matches); takes about ten microseconds.
  [[nodiscard]] static bool is_biased_by_motion(std::span<const optimize::pose_observation> observations,
                                                std::span<const double> trust,
                                                const optimize::reprojection<Camera>& model, const se3& fitted,
                                                const moving_options& options) {
    motion_splitter s{observations, trust, model, options, 0};
    const std::vector<std::uint8_t> trusted = s.trusted();
    const auto count = static_cast<std::size_t>(std::count(trusted.begin(), trusted.end(), std::uint8_t{1}));
    if (count < 2 * options.min_features || count + options.min_features > trusted.size()) return false;
    const std::optional<se3> by_trusted = s.refine_some(trusted, fitted);
    if (!by_trusted) return false;
    const se3 before = fitted.inverse(), after = by_trusted->inverse();
    std::size_t lost = 0;
    for (std::size_t i = 0; i != trusted.size(); ++i) {
      const double limit = error_limit(observations[i].has_depth());
      lost += trusted[i] == 0 && s.error(before, i) <= limit && s.error(after, i) > limit;
    }
    return lost >= options.min_features;
  }

 private:
  motion_splitter(std::span<const optimize::pose_observation> observations, std::span<const double> trust,
                  const optimize::reprojection<Camera>& model, const moving_options& options, std::uint64_t seed)
      : observations_{observations}, trust_{trust}, model_{model}, options_{options}, seed_{seed} {}

  /// Returns the sum of trust, weighted by agreement, times the spread of the agreeing matches.
  [[nodiscard]] double score(const se3& T_world_camera) const {
    const se3 T_camera_world = T_world_camera.inverse();
    double support = 0.0, weight = 0.0;
    vec3 mean = zeros<vec3>(), squares = zeros<vec3>();
    for (std::size_t i = 0; i != observations_.size(); ++i) {
      const double left = 1.0 - error(T_camera_world, i) / error_limit(observations_[i].has_depth());
      if (!(left > 0.0)) continue;
      const double w = std::max(trust_[i], least_trust);
      const vec3& p = observations_[i].point;
      support += left * w;
      weight += w;
      mean += w * p;
      squares += w * entrywise_product(p, p);
    }
    if (!(weight > 0.0)) return 0.0;
    const double variance = sum_entries(squares / weight - entrywise_product(mean / weight, mean / weight));
    return support * std::sqrt(std::max(variance, 0.0));
  }

  /// Returns a vector with 1 for each trusted match, otherwise 0.
  [[nodiscard]] std::vector<std::uint8_t> trusted() const {
    std::vector<std::uint8_t> all(observations_.size());
    for (std::size_t i = 0; i != all.size(); ++i) all[i] = trust_[i] >= enough_trust ? 1 : 0;
    return all;
  }

  /// Estimates the pose from the `chosen` matches, starting from `start`.
  [[nodiscard]] std::optional<se3> refine_some(std::span<const std::uint8_t> chosen, const se3& start) {
    part_.clear();
    for (std::size_t i = 0; i != chosen.size(); ++i)
      if (chosen[i] != 0) part_.push_back(observations_[i]);
    if (part_.size() < options_.min_features) return std::nullopt;
    part_outliers_.assign(part_.size(), 0);
    const auto refined = optimize::refine_pose(std::span<const optimize::pose_observation>(part_), model_, start,
                                               std::span<std::uint8_t>(part_outliers_));
    if (!refined.ok() || refined.inliers < options_.min_features) return std::nullopt;
    return refined.T_world_camera;
  }

  /// Refines a pose on all matches that agree with it.
  [[nodiscard]] std::optional<se3> refine_on_agreeing(se3 pose) {
    std::vector<std::uint8_t> agree(observations_.size());
    for (int round = 0; round != 2; ++round) {
      judge(pose, agree);
      for (std::uint8_t& a : agree) a = a == 0 ? 1 : 0;
      const std::optional<se3> refined = refine_some(agree, pose);
      if (!refined) return std::nullopt;
      pose = *refined;
    }
    return pose;
  }

  /// Marks the matches that disagree with a pose.
  void judge(const se3& T_world_camera, std::span<std::uint8_t> outliers) const {
    const se3 T_camera_world = T_world_camera.inverse();
    for (std::size_t i = 0; i != observations_.size(); ++i)
      outliers[i] = error(T_camera_world, i) <= error_limit(observations_[i].has_depth()) ? 0 : 1;
  }
  /// Returns the chi-squared error of a match.
  [[nodiscard]] double error(const se3& T_camera_world, std::size_t i) const {
    const optimize::pose_observation& o = observations_[i];
    const auto r = model_.residual(T_camera_world * o.point, o);
    return r ? squared_norm(*r) * o.information : std::numeric_limits<double>::infinity();
  }

  /// Finds a rigid motion among the outliers by RANSAC.
  [[nodiscard]] std::optional<se3> second_motion(std::span<const std::uint8_t> outliers) {
    points_.clear();
    pixels_.clear();
    for (std::size_t i = 0; i != outliers.size(); ++i) {
      if (outliers[i] == 0) continue;
      points_.push_back(observations_[i].point);
      pixels_.push_back(observations_[i].pixel);
    }
    const std::size_t enough =
        std::max(options_.min_features, static_cast<std::size_t>(0.4 * static_cast<double>(points_.size())));
    if (points_.size() < enough) return std::nullopt;
    const auto found =
        optimize::estimate_pose(std::span<const vec3>(points_), std::span<const vec2>(pixels_), model_.camera,
                                {.threshold = 4.0, .max_iterations = 200, .min_inliers = enough, .seed = seed_});
    if (!found) return std::nullopt;
    return found->T_world_camera;
  }

  /// Marks the outliers that agree with a second motion, clearly disagree with that of the camera, and are surrounded
  /// by outliers: a moving object is one rigid body, whereas the outliers in a blurred image are scattered everywhere.
  [[nodiscard]] bool mark_moving(motion_split& s) {
    const std::optional<se3> other = second_motion(s.outliers);
    if (!other) return false;
    const se3 T_camera_other = other->inverse(), T_camera_world = s.T_world_camera.inverse();
    std::size_t count = 0;
    for (std::size_t i = 0; i != observations_.size(); ++i) {
      const double limit = error_limit(observations_[i].has_depth());
      const bool moves = s.outliers[i] != 0 && error(T_camera_other, i) <= 2.0 * limit &&
                         error(T_camera_world, i) > 2.0 * limit && is_among_outliers(s.outliers, i);
      s.moving[i] = moves ? 1 : 0;
      count += s.moving[i];
    }
    if (count >= options_.min_features) return true;
    std::fill(s.moving.begin(), s.moving.end(), std::uint8_t{0});
    return false;
  }

  /// Returns true if enough of the untrusted matches that disagree with a pose are surrounded by outliers.
  [[nodiscard]] bool outliers_form_body(const se3& T_world_camera) const {
    std::vector<std::uint8_t> out(observations_.size());
    judge(T_world_camera, out);
    std::size_t count = 0;
    for (std::size_t i = 0; i != out.size(); ++i)
      count += out[i] != 0 && trust_[i] < enough_trust && is_among_outliers(out, i);
    return count >= options_.min_features;
  }

  /// Returns true if most of the points nearest to that of a match are outliers. O(matches).
  [[nodiscard]] bool is_among_outliers(std::span<const std::uint8_t> outliers, std::size_t which) const {
    struct neighbour {
      double distance = std::numeric_limits<double>::infinity();
      bool out = false;
    };
    std::array<neighbour, 6> nearest;
    for (std::size_t i = 0; i != observations_.size(); ++i) {
      neighbour n{squared_norm(observations_[i].point - observations_[which].point), outliers[i] != 0};
      if (i == which || !(n.distance < nearest.back().distance)) continue;
      nearest.back() = n;
      for (std::size_t k = nearest.size() - 1; k != 0 && nearest[k].distance < nearest[k - 1].distance; --k)
        std::swap(nearest[k], nearest[k - 1]);
    }
    return std::count_if(nearest.begin(), nearest.end(), [](const neighbour& n) { return n.out; }) >= 4;
  }

  std::span<const optimize::pose_observation> observations_;
  std::span<const double> trust_;
  const optimize::reprojection<Camera>& model_;
  const moving_options& options_;
  std::uint64_t seed_;
  std::vector<optimize::pose_observation> part_;
  std::vector<std::uint8_t> part_outliers_;
  std::vector<vec3> points_;
  std::vector<vec2> pixels_;
};

}  // namespace orbis::slam::detail

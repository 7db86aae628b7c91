// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment of a whole map.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/progress.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/motion_propagation.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// What adjusting a map came to.
struct global_adjustment_report {
  std::size_t keyframes = 0;     ///< that were adjusted
  std::size_t landmarks = 0;     ///< likewise
  std::size_t observations = 0;  ///< that took part
  std::size_t forgotten = 0;     ///< of these, those that disagreed
  int iterations = 0;
  double initial_cost = 0.0;  ///< half the robust sum of squared errors
  double final_cost = 0.0;    ///< the same of those that agree
};

/// Moves all keyframes and landmarks to where the observations agree best, in three parts: `gather` and `apply` touch
/// the map, `solve` works on what was copied out of it. The root of the map stays where it is. Observations that
/// disagree are forgotten.
///
/// Between `gather` and `apply` keyframes, landmarks and observations may have been added: keyframes follow their
/// parent in the tree, landmarks the keyframe that made them. A landmark that one keyframe alone sees takes no part and
/// follows likewise.
/// Source: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), section III.E.
template <camera::camera_model Camera>
class global_adjustment {
 public:
  /// False if there is nothing to adjust. O(observations).
  bool gather(const map& m, const optimize::reprojection<Camera>& model, const pyramid_scales& scales,
              const global_adjustment_options& o = {}) {
    for (bool more = gather_keyframes(m, model, scales, o); more;) more = gather_landmarks(m, m.landmark_end());
    return has_gathered();
  }
  /// The same part by part, for whoever shares the map: first the keyframes, then so many landmarks at a time. False if
  /// nothing follows; then `has_gathered` is what `gather` would say. Keyframes, landmarks and observations may be
  /// added in between, and take no part.
  bool gather_keyframes(const map& m, const optimize::reprojection<Camera>& model, const pyramid_scales& scales,
                        const global_adjustment_options& o = {}) {
    options_ = o;
    adjuster_.emplace(model, optimize::huber{2.447});
    keyframes_.clear();
    poses_.clear();
    fixed_.clear();
    landmarks_.clear();
    points_.clear();
    observations_.clear();
    sources_.clear();
    if (m.keyframes().size() < 2) return false;

    model_.emplace(model);
    scales_ = scales;
    index_.assign(m.keyframe_end(), no_id);
    next_landmark_ = 0;
    end_landmark_ = m.landmark_end();
    for (const keyframe& k : m.keyframes()) {
      std::size_t shared = 0;
      for (auto l = k.landmarks.begin(); l != k.landmarks.end() && shared < o.min_observations; ++l)
        shared += *l != no_id && m.landmark_at(*l).observations.size() > 1;
      if (shared < o.min_observations && k.id != m.tree().root()) continue;
      index_[k.id] = static_cast<std::uint32_t>(keyframes_.size());
      keyframes_.push_back(k.id);
      poses_.push_back(k.T_world_camera);
      fixed_.push_back(k.id == m.tree().root() ? 1 : 0);
    }
    return next_landmark_ != end_landmark_;
  }
  bool gather_landmarks(const map& m, landmark_id count) {
    const landmark_id stop = next_landmark_ + std::min(count, end_landmark_ - next_landmark_);
    for (; next_landmark_ != stop; ++next_landmark_) {
      if (!m.has_landmark(next_landmark_)) continue;
      const landmark& l = m.landmark_at(next_landmark_);
      std::size_t seen = 0;
      for (const observation& by : l.observations) seen += takes_part(by.keyframe);
      if (seen < 2) continue;
      const auto point = static_cast<std::uint32_t>(points_.size());
      landmarks_.push_back(l.id);
      points_.push_back(l.position);
      for (const observation& by : l.observations) {
        if (!takes_part(by.keyframe)) continue;
        const auto at = observation_of(*model_, scales_, m.at(by.keyframe), by.feature, l.position);
        observations_.push_back({index_[by.keyframe], point, at.pixel, at.right, at.information});
        sources_.push_back(by);
      }
    }
    return next_landmark_ != end_landmark_;
  }
  [[nodiscard]] bool has_gathered() const noexcept { return !observations_.empty(); }

  /// False if it was stopped (`callback(iteration, iterations)` returned false), or the problem cannot be solved: there
  /// is nothing to apply then. The result is the same for every policy. @pre `gather` was true
  template <execution_policy Policy = sequential_policy>
  [[nodiscard]] bool solve(progress callback = {}, const Policy& policy = seq) {
    report_ = {};
    outliers_.assign(observations_.size(), 0);
    const auto total =
        static_cast<std::size_t>(std::max(0, options_.robust_iterations) + std::max(0, options_.iterations));
    std::size_t before = 0;
    const auto go_on = [&](std::size_t done, std::size_t) { return callback(before + done, total); };
    const auto robust = adjuster_->solve(policy, std::span<se3>(poses_), std::span<vec3>(points_),
                                         std::span<const optimize::bundle_observation>(observations_),
                                         {.max_iterations = options_.robust_iterations,
                                          .relative_tolerance = options_.relative_tolerance,
                                          .fixed_poses = fixed_},
                                         go_on);
    if (!is_usable(robust)) return false;
    find_outliers();
    before = static_cast<std::size_t>(std::max(0, options_.robust_iterations));
    const auto last = adjuster_->solve_again(policy, std::span<se3>(poses_), std::span<vec3>(points_),
                                             {.max_iterations = options_.iterations,
                                              .relative_tolerance = options_.relative_tolerance,
                                              .fixed_poses = fixed_,
                                              .ignored = outliers_},
                                             go_on);
    if (!is_usable(last)) return false;
    find_outliers();
    report_.observations = observations_.size();
    report_.iterations = robust.iterations + last.iterations;
    report_.initial_cost = robust.initial_cost;
    report_.final_cost = last.final_cost;
    return true;
  }

  /// @pre `solve` was true, and the map is that of `gather`, with what was added since
  global_adjustment_report apply(map& m) {
    const global_adjustment_report report = move(m);
    update_landmarks(m, 0, m.landmark_end());
    return report;
  }
  /// The same, but for `update_landmarks`, which is left to the caller.
  global_adjustment_report move(map& m) {
    const std::vector<se3> motion = carried_motion(m, keyframes_, poses_);
    // Whatever takes no part goes with a keyframe, and only then do the others go where they should.
    std::size_t next = 0;
    for (landmark_id l = 0; l != m.landmark_end(); ++l) {
      while (next != landmarks_.size() && landmarks_[next] < l) ++next;
      if (!m.has_landmark(l)) continue;
      const bool adjusted = next != landmarks_.size() && landmarks_[next] == l;
      const landmark& seen = m.landmark_at(l);
      const keyframe_id by = m.has_keyframe(seen.created) ? seen.created : seen.observations.front().keyframe;
      m.move_landmark(l, motion[by]);
      if (adjusted) m.set_position(l, points_[next]);
    }
    for (keyframe_id k = 0; k != m.keyframe_end(); ++k)
      if (m.has_keyframe(k)) m.set_pose(k, motion[k] * m.at(k).T_world_camera);
    global_adjustment_report report = report_;
    report.keyframes = keyframes_.size();
    report.landmarks = landmarks_.size();
    for (std::size_t i = 0; i != observations_.size(); ++i)
      if (outliers_[i] != 0 && m.forget(landmarks_[observations_[i].point], sources_[i])) ++report.forgotten;
    return report;
  }

 private:
  [[nodiscard]] bool takes_part(keyframe_id k) const { return k < index_.size() && index_[k] != no_id; }
  [[nodiscard]] static bool is_usable(const optimize::bundle_summary& s) {
    return !optimize::is_failure(s.status) && s.status != optimize::bundle_status::cancelled;
  }
  void find_outliers() { detail::find_outliers(*adjuster_, poses_, points_, observations_, squared_, outliers_); }

  global_adjustment_options options_;
  std::optional<optimize::reprojection<Camera>> model_;
  pyramid_scales scales_;
  std::vector<std::uint32_t> index_;  // by keyframe, among those that take part
  landmark_id next_landmark_ = 0, end_landmark_ = 0;
  std::optional<optimize::bundle_adjuster<optimize::reprojection<Camera>>> adjuster_;
  std::vector<keyframe_id> keyframes_;
  std::vector<se3> poses_;
  std::vector<std::uint8_t> fixed_;
  std::vector<landmark_id> landmarks_;  // ascending
  std::vector<vec3> points_;
  std::vector<optimize::bundle_observation> observations_;
  std::vector<observation> sources_;  // of each of these
  std::vector<std::uint8_t> outliers_;
  std::vector<double> squared_;
  global_adjustment_report report_;
};

/// Adjusts a whole map at once; see `global_adjustment`.
template <camera::camera_model Camera>
global_adjustment_report adjust_globally(map& m, const optimize::reprojection<Camera>& model,
                                         const pyramid_scales& scales, const global_adjustment_options& o = {}) {
  global_adjustment<Camera> adjustment;
  if (!adjustment.gather(m, model, scales, o) || !adjustment.solve()) return {};
  return adjustment.apply(m);
}

}  // namespace orbis::slam::detail

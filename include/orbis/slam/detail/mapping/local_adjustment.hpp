// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Local bundle adjustment: the newest keyframe, its neighbours, and all they see.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section VI.D.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/progress.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/covisibility_graph.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Moves the keyframes around one and their landmarks to where the observations agree best. Other keyframes that see
/// these landmarks hold the whole in place, as does the root of the map. In three parts, so that whoever shares the map
/// locks it for the first and the last only:
///
/// @code
///   if (adjustment.gather(map, newest, model, scales, options)) {  // reads the map
///     adjustment.solve(go_on);                                     // does not touch it, and takes long
///     adjustment.apply(map);                                       // changes it
///   }
/// @endcode
///
/// Between `gather` and `apply`, keyframes, landmarks and observations may be added to the map. What was gathered must
/// not be moved meanwhile by others; that some of it is gone does no harm. Kept from one time to the next: `solve` of a
/// problem that is no larger than one before allocates next to nothing.
template <camera::camera_model Camera>
class local_adjustment {
 public:
  /// Copies what takes part. False if there is nothing to adjust. O(observations of the landmarks that take part).
  /// @pre m.has_keyframe(newest)
  [[nodiscard]] bool gather(const map& m, keyframe_id newest, const optimize::reprojection<Camera>& model,
                            const pyramid_scales& scales, const adjustment_options& o) {
    assert(m.has_keyframe(newest));
    stage_ = stage::empty;
    if (m.keyframes().size() < 2 || o.keyframes == 0) return false;
    options_ = o;
    end_keyframe_ = m.keyframe_end();
    end_landmark_ = m.landmark_end();
    gather_keyframes(m, newest);
    gather_landmarks(m, model, scales);
    if (observations_.empty() || std::find(is_fixed_.begin(), is_fixed_.end(), 0) == is_fixed_.end()) return false;
    use(model);
    stage_ = stage::gathered;
    return true;
  }

  /// Adjusts the copy. `go_on` is asked before each step. True if it came to its end; if it was stopped, the steps that
  /// were taken count (each is for the better), but nothing is called an outlier before the first half is over. False,
  /// too, if the input is useless (poses that are not finite): then `apply` changes nothing.
  /// @pre `gather` returned true
  bool solve(const progress& go_on = {}) {
    assert(stage_ == stage::gathered);
    const std::span<se3> poses{poses_};
    const std::span<vec3> points{points_};
    outliers_.assign(observations_.size(), 0);
    stage_ = stage::solved;
    if (!go_on(0, static_cast<std::size_t>(std::max(0, options_.robust_iterations)))) return false;
    const auto first =
        adjuster_->solve(seq, poses, points, std::span<const optimize::bundle_observation>(observations_),
                         {.max_iterations = options_.robust_iterations, .fixed_poses = is_fixed_}, go_on);
    if (is_failure(first.status)) stage_ = stage::empty;
    if (is_failure(first.status) || first.status == optimize::bundle_status::cancelled) return false;
    find_outliers();
    const auto second = adjuster_->solve_again(
        seq, poses, points, {.max_iterations = options_.iterations, .fixed_poses = is_fixed_, .ignored = outliers_},
        go_on);
    if (is_failure(second.status)) stage_ = stage::empty;
    if (is_failure(second.status)) return false;
    find_outliers();
    return second.status != optimize::bundle_status::cancelled;
  }

  /// Writes back what `solve` found. Keyframes that were added since move along with their ancestor in the spanning
  /// tree, and landmarks that were added with the keyframe that made them. Observations that disagree are forgotten;
  /// with them go landmarks whose place nothing determines any more (seen by one keyframe, without depth).
  void apply(map& m) {
    if (stage_ != stage::solved) return;
    stage_ = stage::empty;
    for (std::size_t i = 0; i != keyframes_.size(); ++i)
      if (is_fixed_[i] == 0 && m.has_keyframe(keyframes_[i])) m.set_pose(keyframes_[i], poses_[i]);
    move_additions(m);
    for (std::size_t p = 0; p != landmarks_.size(); ++p)
      if (m.has_landmark(landmarks_[p])) m.set_position(landmarks_[p], points_[p]);
    for (std::size_t i = 0; i != observations_.size(); ++i)
      if (outliers_[i] != 0) forget(m, landmarks_[observations_[i].point], sources_[i]);
    for (const landmark_id l : landmarks_)
      if (m.has_landmark(l)) m.update(l);
  }

  /// What takes part: keyframes, those of them that are held, and landmarks; after `solve`, observations that disagree.
  [[nodiscard]] std::span<const keyframe_id> keyframes() const noexcept { return keyframes_; }
  [[nodiscard]] std::span<const std::uint8_t> is_fixed() const noexcept { return is_fixed_; }
  [[nodiscard]] std::span<const landmark_id> landmarks() const noexcept { return landmarks_; }
  [[nodiscard]] std::size_t outliers() const noexcept {
    return static_cast<std::size_t>(std::count(outliers_.begin(), outliers_.end(), 1));
  }

 private:
  enum class stage { empty, gathered, solved };
  using model_type = optimize::reprojection<Camera>;

  /// Those that move, and all that share a landmark with one of them.
  void gather_keyframes(const map& m, keyframe_id newest) {
    moving_.assign(1, newest);
    for (const covisible& n : m.covisibility().at_least(newest, static_cast<std::uint32_t>(options_.min_shared)))
      if (moving_.size() < options_.keyframes) moving_.push_back(n.keyframe);
    keyframes_ = moving_;
    for (const keyframe_id k : moving_)
      for (const covisible& n : m.covisibility().sharing(k)) keyframes_.push_back(n.keyframe);
    std::sort(keyframes_.begin(), keyframes_.end());
    keyframes_.erase(std::unique(keyframes_.begin(), keyframes_.end()), keyframes_.end());
    is_fixed_.clear();
    before_.clear();
    bool any_fixed = false;
    for (const keyframe_id k : keyframes_) {
      const bool moves = k != m.tree().root() && std::find(moving_.begin(), moving_.end(), k) != moving_.end();
      any_fixed = any_fixed || !moves;
      is_fixed_.push_back(moves ? 0 : 1);
      before_.push_back(m.at(k).T_world_camera);
    }
    if (!any_fixed) is_fixed_.front() = 1;
    poses_ = before_;
  }

  void gather_landmarks(const map& m, const model_type& model, const pyramid_scales& scales) {
    landmarks_ = landmarks_of(m, moving_);
    points_.clear();
    observations_.clear();
    sources_.clear();
    for (std::uint32_t p = 0; p != landmarks_.size(); ++p) {
      const landmark& l = m.landmark_at(landmarks_[p]);
      points_.push_back(l.position);
      for (const observation& seen : l.observations) {
        const auto at = observation_of(model, scales, m.at(seen.keyframe), seen.feature, l.position);
        observations_.push_back({place_of(seen.keyframe), p, at.pixel, at.right, at.information});
        sources_.push_back(seen);
      }
    }
  }

  /// The solver, with its memory, is kept as long as the model stays the same.
  void use(const model_type& model) {
    if constexpr (std::equality_comparable<Camera>) {
      if (adjuster_ && model_->camera == model.camera && model_->bf == model.bf) return;
    }
    model_.emplace(model);
    adjuster_.emplace(model);
  }

  void find_outliers() { detail::find_outliers(*adjuster_, poses_, points_, observations_, squared_, outliers_); }

  /// Where a keyframe is in the arrays. @pre it takes part
  [[nodiscard]] std::uint32_t place_of(keyframe_id k) const {
    return static_cast<std::uint32_t>(std::lower_bound(keyframes_.begin(), keyframes_.end(), k) - keyframes_.begin());
  }

  /// How a keyframe moves in the world; an added one as its nearest ancestor that is not. Empty if it does not.
  [[nodiscard]] std::optional<se3> motion_of(const map& m, keyframe_id k) const {
    k = m.heir(k);
    while (k != no_id && k >= end_keyframe_) k = m.tree().parent(k);
    if (k == no_id) return std::nullopt;
    const std::size_t i = place_of(k);
    if (i == keyframes_.size() || keyframes_[i] != k || is_fixed_[i] != 0) return std::nullopt;
    return poses_[i] * before_[i].inverse();
  }

  void move_additions(map& m) const {
    for (keyframe_id k = end_keyframe_; k < m.keyframe_end(); ++k)
      if (m.has_keyframe(k))
        if (const auto T_new_old = motion_of(m, k)) m.set_pose(k, *T_new_old * m.at(k).T_world_camera);
    for (landmark_id l = end_landmark_; l < m.landmark_end(); ++l) {
      if (!m.has_landmark(l)) continue;
      if (const auto T_new_old = motion_of(m, m.landmark_at(l).created)) {
        m.move_landmark(l, *T_new_old);
        m.update(l);
      }
    }
  }

  static void forget(map& m, landmark_id l, const observation& source) {
    if (!m.forget(l, source) || !m.has_landmark(l) || m.landmark_at(l).observations.size() > 1) return;
    const observation& last = m.landmark_at(l).observations.front();
    if (!m.at(last.keyframe).has_depth(last.feature)) m.remove_landmark(l);
  }

  stage stage_ = stage::empty;
  adjustment_options options_;
  keyframe_id end_keyframe_ = 0;  ///< from here on, they were added after `gather`
  landmark_id end_landmark_ = 0;
  std::vector<keyframe_id> moving_, keyframes_;  ///< all that take part in ascending order
  std::vector<std::uint8_t> is_fixed_;           ///< by keyframe
  std::vector<se3> before_, poses_;              ///< `T_world_camera` by keyframe, then and now
  std::vector<landmark_id> landmarks_;           ///< in ascending order
  std::vector<vec3> points_;                     ///< by landmark
  std::vector<optimize::bundle_observation> observations_;
  std::vector<observation> sources_;    ///< of each of these, the keyframe and keypoint
  std::vector<std::uint8_t> outliers_;  ///< likewise
  std::vector<double> squared_;
  std::optional<model_type> model_;
  std::optional<optimize::bundle_adjuster<model_type>> adjuster_;
};

/// The three parts in a row. Returns whether there was something to adjust. @pre m.has_keyframe(newest)
template <camera::camera_model Camera>
bool adjust_locally(map& m, keyframe_id newest, local_adjustment<Camera>& adjustment,
                    const optimize::reprojection<Camera>& model, const pyramid_scales& scales,
                    const adjustment_options& o, const progress& go_on = {}) {
  if (!adjustment.gather(m, newest, model, scales, o)) return false;
  adjustment.solve(go_on);
  adjustment.apply(m);
  return true;
}

}  // namespace orbis::slam::detail

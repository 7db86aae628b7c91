// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The map: keyframes, landmarks, and which keyframe sees which landmark.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/features/hamming.hpp>
#include <orbis/slam/frame.hpp>

namespace orbis::slam {

/// A frame that the map keeps. `landmarks` of the frame are its observations.
struct keyframe : frame {
  keyframe_id id = no_id;
};

struct observation {
  keyframe_id keyframe = no_id;
  std::uint32_t feature = 0;
  friend bool operator==(const observation&, const observation&) = default;
};

struct landmark {
  vec3 position = vec3::Zero();                 ///< in the world, metres
  vec3 normal = vec3::Zero();                   ///< mean direction towards the keyframes that see it, unit length
  features::binary_descriptor<256> descriptor;  ///< the most typical of those observed
  double min_distance = 0.0;                    ///< from which a keypoint at the coarsest level shows it, metres
  double max_distance = 0.0;                    ///< the same at the finest level
  std::vector<observation> observations;        ///< in ascending order of keyframe
  keyframe_id created = no_id;
  std::uint32_t visible = 0;  ///< frames that should have shown it
  std::uint32_t found = 0;    ///< frames that did
  bool alive = false;         ///< a dead landmark keeps its number and nothing else
};

/// Both sides of every observation are kept in step:
/// `keyframe.landmarks[f] == l` if and only if `landmark.observations` has `{keyframe, f}`.
class map {
 public:
  map() = default;
  map(int levels, double scale_factor) : levels_{levels}, scale_factor_{scale_factor} {}

  [[nodiscard]] const std::vector<keyframe>& keyframes() const noexcept { return keyframes_; }
  [[nodiscard]] const keyframe& at(keyframe_id id) const { return keyframes_[id]; }
  /// With dead ones among them.
  [[nodiscard]] const std::vector<landmark>& landmarks() const noexcept { return landmarks_; }
  [[nodiscard]] const landmark& landmark_at(landmark_id id) const { return landmarks_[id]; }
  [[nodiscard]] std::size_t landmark_count() const noexcept { return alive_; }
  [[nodiscard]] bool is_alive(landmark_id id) const noexcept { return id < landmarks_.size() && landmarks_[id].alive; }

  void count_visible(landmark_id id) { ++landmarks_[id].visible; }
  void count_found(landmark_id id) { ++landmarks_[id].found; }
  void set_pose(keyframe_id id, const se3& T_world_camera) { keyframes_[id].T_world_camera = T_world_camera; }
  void set_position(landmark_id id, const vec3& position) { landmarks_[id].position = position; }

  /// Adds a frame with the landmarks it shows.
  keyframe_id add_keyframe(frame f) {
    const auto id = static_cast<keyframe_id>(keyframes_.size());
    const std::vector<landmark_id> seen =
        std::exchange(f.landmarks, std::vector<landmark_id>(f.features.size(), no_id));
    keyframes_.push_back({std::move(f), id});
    for (std::uint32_t i = 0; i < seen.size(); ++i)
      if (is_alive(seen[i])) observe(seen[i], id, i);
    return id;
  }

  /// A new landmark at keypoint `feature` of a keyframe, where its depth says.
  /// @pre the keypoint has depth and shows no landmark yet
  landmark_id add_landmark(keyframe_id id, std::uint32_t feature) {
    const auto created = static_cast<landmark_id>(landmarks_.size());
    landmark l;
    l.position = keyframes_[id].point_world(feature);
    l.created = id;
    l.visible = l.found = 1;
    l.alive = true;
    landmarks_.push_back(std::move(l));
    ++alive_;
    observe(created, id, feature);
    update(created);
    return created;
  }

  /// Notes that a keypoint of a keyframe shows a landmark; nothing if either is taken already.
  bool observe(landmark_id l, keyframe_id k, std::uint32_t feature) {
    auto& seen = keyframes_[k].landmarks[feature];
    auto& observations = landmarks_[l].observations;
    const auto at = std::lower_bound(observations.begin(), observations.end(), k,
                                     [](const observation& o, keyframe_id id) { return o.keyframe < id; });
    if (seen != no_id || (at != observations.end() && at->keyframe == k)) return false;
    seen = l;
    observations.insert(at, {k, feature});
    return true;
  }

  /// Takes one observation back; a landmark that nobody sees any more dies.
  void forget(landmark_id l, keyframe_id k) {
    auto& observations = landmarks_[l].observations;
    const auto at =
        std::find_if(observations.begin(), observations.end(), [&](const observation& o) { return o.keyframe == k; });
    if (at == observations.end()) return;
    keyframes_[k].landmarks[at->feature] = no_id;
    observations.erase(at);
    if (observations.empty()) remove_landmark(l);
  }

  void remove_landmark(landmark_id id) {
    landmark& l = landmarks_[id];
    if (!l.alive) return;
    for (const observation& o : l.observations) keyframes_[o.keyframe].landmarks[o.feature] = no_id;
    l = landmark{};
    --alive_;
  }

  /// The observations of `from` become those of `into`, as far as no keyframe sees both; `from` dies.
  void merge(landmark_id from, landmark_id into) {
    assert(from != into);
    const std::vector<observation> moved = landmarks_[from].observations;
    const auto found = landmarks_[from].found, visible = landmarks_[from].visible;
    remove_landmark(from);
    for (const observation& o : moved) observe(into, o.keyframe, o.feature);
    landmarks_[into].found += found;
    landmarks_[into].visible += visible;
  }

  /// Recomputes what follows from a landmark's observations: normal, range of distances, descriptor.
  void update(landmark_id id) {
    landmark& l = landmarks_[id];
    vec3 sum = vec3::Zero();
    for (const observation& o : l.observations)
      sum += (keyframes_[o.keyframe].T_world_camera.translation() - l.position).normalized();
    l.normal = sum.norm() > 0.0 ? vec3(sum.normalized()) : vec3::Zero();
    const observation& last = l.observations.back();
    const keyframe& k = keyframes_[last.keyframe];
    const double distance = (k.T_world_camera.translation() - l.position).norm();
    l.max_distance = distance * std::pow(scale_factor_, k.features.keypoints[last.feature].octave);
    l.min_distance = l.max_distance / std::pow(scale_factor_, levels_ - 1);
    l.descriptor = typical_descriptor(l);
  }

  /// The keyframes that share the most landmarks with the given ones, most first (older first where
  /// equal), with the number they share.
  [[nodiscard]] std::vector<std::pair<keyframe_id, std::size_t>> sharing(const std::vector<landmark_id>& seen) const {
    std::vector<std::size_t> shared(keyframes_.size(), 0);
    for (const landmark_id l : seen)
      if (is_alive(l))
        for (const observation& o : landmarks_[l].observations) ++shared[o.keyframe];
    std::vector<std::pair<keyframe_id, std::size_t>> order;
    for (keyframe_id k = 0; k < shared.size(); ++k)
      if (shared[k] > 0) order.emplace_back(k, shared[k]);
    std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
    return order;
  }

 private:
  /// The observed descriptor whose median distance to the others is least.
  [[nodiscard]] features::binary_descriptor<256> typical_descriptor(const landmark& l) const {
    const auto of = [&](const observation& o) -> const auto& {
      return keyframes_[o.keyframe].features.descriptors[o.feature];
    };
    const std::size_t n = l.observations.size();
    if (n < 3) return of(l.observations.back());
    std::size_t best = 0;
    std::uint32_t best_median = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> distances(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j)
        distances[j] = features::hamming{}(of(l.observations[i]), of(l.observations[j]));
      const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(n / 2);
      std::nth_element(distances.begin(), middle, distances.end());
      if (*middle < best_median) {
        best_median = *middle;
        best = i;
      }
    }
    return of(l.observations[best]);
  }

  int levels_ = 8;
  double scale_factor_ = 1.2;
  std::vector<keyframe> keyframes_;
  std::vector<landmark> landmarks_;
  std::size_t alive_ = 0;
};

}  // namespace orbis::slam

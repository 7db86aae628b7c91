// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The tracked frames, each relative to a keyframe, so that they follow later corrections. A limited log keeps only the
/// latest frames and counts the others.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/ids.hpp>

namespace orbis::slam::detail {

struct logged_frame {
  double timestamp = 0.0;  ///< seconds
  map_keyframe reference;
  se3 T_reference_camera;  ///< translation divided by the reference's scale (`basic_map::scale`)
};

class frame_log {
 public:
  /// Creates a log that keeps only the latest `most` frames.
  explicit frame_log(std::size_t most = std::numeric_limits<std::size_t>::max()) : most_{most} {}

  void add(const logged_frame& f) {
    frames_.push_back(f);
    if (frames_.size() <= most_) return;
    forgotten& old = forgotten_[frames_.front().reference.map];
    ++old.frames;
    old.reference = frames_.front().reference;
    frames_.pop_front();
    ++first_number_;
  }
  /// The index of the next frame; the first frame has index 0.
  [[nodiscard]] std::size_t end_number() const noexcept { return first_number_ + frames_.size(); }
  /// Returns the reference keyframe of a kept frame, with its id at the time of tracking.
  /// @pre the frame is kept
  [[nodiscard]] const map_keyframe& reference(std::size_t number) const {
    return frames_[number - first_number_].reference;
  }
  /// Returns the current pose of a frame in the map of its reference; empty if the reference is no longer known.
  template <feature_descriptor D>
  [[nodiscard]] static std::optional<se3> pose(const logged_frame& f, const basic_atlas<D>& maps) {
    const map_keyframe k = maps.current(f.reference);
    if (!maps.contains(k.map) || !maps.at(k.map).remembers(k.keyframe)) return std::nullopt;
    return maps.at(k.map).pose(k.keyframe) * scaled(f.T_reference_camera, maps.at(k.map).scale(k.keyframe));
  }
  /// As above, for the frame with index `number`; also empty if the frame is not kept.
  template <feature_descriptor D>
  [[nodiscard]] std::optional<se3> pose(std::size_t number, const basic_atlas<D>& maps) const {
    const bool is_kept = number >= first_number_ && number < end_number();
    return is_kept ? pose(frames_[number - first_number_], maps) : std::nullopt;
  }
  /// Returns the twist of the camera in its own frame at frame `number`, per second, translation first: the mean from
  /// the previous to the next frame. Empty unless both are kept, in the same map, and close in time.
  template <feature_descriptor D>
  [[nodiscard]] std::optional<vec6> motion(std::size_t number, const basic_atlas<D>& maps) const {
    const auto before = number == 0 ? std::nullopt : pose(number - 1, maps), after = pose(number + 1, maps);
    if (!before || !after) return std::nullopt;
    const logged_frame &a = frames_[number - 1 - first_number_], &b = frames_[number + 1 - first_number_];
    constexpr double longest = 0.25;  // seconds
    const double interval = b.timestamp - a.timestamp;
    const bool are_close =
        interval > 0.0 && interval < longest && maps.current(a.reference).map == maps.current(b.reference).map;
    return are_close ? std::optional<vec6>((before->inverse() * *after).log() / interval) : std::nullopt;
  }
  /// Corrects the pose of a frame. @pre pose(number, maps)
  template <feature_descriptor D>
  void set_pose(std::size_t number, const se3& T_world_camera, const basic_atlas<D>& maps) {
    logged_frame& f = frames_[number - first_number_];
    const map_keyframe k = maps.current(f.reference);
    const basic_map<D>& m = maps.at(k.map);
    f.T_reference_camera = scaled(m.pose(k.keyframe).inverse() * T_world_camera, 1.0 / m.scale(k.keyframe));
  }

  /// Returns the current poses of the kept frames that were tracked in a map, or in a map that was merged into it.
  /// Empty if there is no such map. O(frames).
  template <feature_descriptor D>
  [[nodiscard]] orbis::trajectory trajectory(const basic_atlas<D>& maps, map_id map) const {
    orbis::trajectory all;
    for (const logged_frame& f : frames_) {
      if (maps.current(f.reference).map != map) continue;
      if (const auto T_world_camera = pose(f, maps)) all.push_back({f.timestamp, *T_world_camera});
    }
    return all;
  }

  /// Returns the reference keyframes of the kept frames in a map, with their current ids. O(frames).
  template <feature_descriptor D>
  [[nodiscard]] std::vector<keyframe_id> references(const basic_atlas<D>& maps, map_id map) const {
    std::vector<keyframe_id> all;
    map_keyframe before;
    for (const logged_frame& f : frames_) {
      if (std::exchange(before, f.reference) == f.reference) continue;  // true for most frames
      if (const map_keyframe k = maps.current(f.reference); k.map == map) all.push_back(k.keyframe);
    }
    return all;
  }

  /// Returns the map with the most frames, kept or not; the oldest in case of a tie; the active map if there are no
  /// frames. O(frames).
  template <feature_descriptor D>
  [[nodiscard]] map_id largest_map(const basic_atlas<D>& maps) const {
    std::map<map_id, std::size_t> frames;
    const auto count = [&](const map_keyframe& reference, std::size_t number) {
      if (const map_id m = maps.current(reference).map; maps.contains(m)) frames[m] += number;
    };
    for (const logged_frame& f : frames_) count(f.reference, 1);
    for (const auto& [map, old] : forgotten_) count(old.reference, old.frames);
    const auto most = std::max_element(frames.begin(), frames.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    return most == frames.end() ? maps.active_id() : most->first;
  }

 private:
  /// The number of forgotten frames of a map.
  struct forgotten {
    std::size_t frames = 0;
    /// Reference of the last forgotten frame: identifies the map into which this one was merged.
    map_keyframe reference;
  };

  std::size_t most_, first_number_ = 0;
  std::deque<logged_frame> frames_;        // grows without moving its elements, so that tracking does not wait
  std::map<map_id, forgotten> forgotten_;  ///< keyed by the map in which the frames were tracked
};

}  // namespace orbis::slam::detail

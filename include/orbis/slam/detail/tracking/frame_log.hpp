// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The tracked frames, each relative to a keyframe, so that they follow later corrections. With a limit, only the
/// latest frames are kept, and the others are counted.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <limits>
#include <map>
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
  se3 T_reference_camera;  ///< translation divided by the reference's scale (`basic_map::scale_of`)
};

class frame_log {
 public:
  /// Creates a log that keeps at most the `most` latest frames.
  explicit frame_log(std::size_t most = std::numeric_limits<std::size_t>::max()) : most_{most} {}

  void add(const logged_frame& f) {
    frames_.push_back(f);
    if (frames_.size() <= most_) return;
    forgotten& old = forgotten_[frames_.front().reference.map];
    ++old.frames;
    old.reference = frames_.front().reference;
    frames_.pop_front();
  }

  /// Returns the current poses of the kept frames that were tracked in a map, or in one that was merged into it. Empty
  /// if there is no such map. O(frames).
  template <feature_descriptor D>
  [[nodiscard]] orbis::trajectory trajectory(const basic_atlas<D>& maps, map_id map) const {
    orbis::trajectory all;
    for (const logged_frame& f : frames_) {
      const map_keyframe k = maps.current(f.reference);
      if (k.map == map && maps.contains(map))
        all.push_back({f.timestamp, maps.at(map).pose_of(k.keyframe) *
                                        scaled(f.T_reference_camera, maps.at(map).scale_of(k.keyframe))});
    }
    return all;
  }

  /// Returns the reference keyframes of the kept frames that are in a map, by their current ids. O(frames).
  template <feature_descriptor D>
  [[nodiscard]] std::vector<keyframe_id> references(const basic_atlas<D>& maps, map_id map) const {
    std::vector<keyframe_id> all;
    map_keyframe before;
    for (const logged_frame& f : frames_) {
      if (std::exchange(before, f.reference) == f.reference) continue;  // as for most frames
      if (const map_keyframe k = maps.current(f.reference); k.map == map) all.push_back(k.keyframe);
    }
    return all;
  }

  /// Returns the map with most frames, kept or not; the oldest on ties; the active map if there are no frames.
  /// O(frames).
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
  /// The forgotten frames of a map.
  struct forgotten {
    std::size_t frames = 0;
    map_keyframe reference;  ///< of the last frame: it leads to the map into which this one was merged
  };

  std::size_t most_;
  std::deque<logged_frame> frames_;        // grows without moving its elements, so tracking does not wait
  std::map<map_id, forgotten> forgotten_;  ///< by the map in which they were tracked
};

}  // namespace orbis::slam::detail

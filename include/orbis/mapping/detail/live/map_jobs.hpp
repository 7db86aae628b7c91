// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Queue of jobs for a live map's thread.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/mapping/live_map.hpp>

namespace orbis::mapping::detail {

struct map_job {
  enum kind_type : std::uint8_t { keyframe, between, removal, positions, finish, poll };
  kind_type kind = keyframe;
  std::uint64_t frame = 0;
  std::uint64_t keyframe_of = 0;
  se3 T{};  ///< T_world_camera of a keyframe, T_keyframe_camera of a frame between keyframes
  image<std::uint16_t> pixels{};
  double scale = 1.0;
  float min_depth = 0.0F, max_depth = 0.0F;
  std::vector<keyframe_position> poses{};
  unlisted others = unlisted::keep;
  std::chrono::steady_clock::time_point since{};

  [[nodiscard]] bool has_image() const noexcept { return kind <= between; }
};

/// A job queue. A limit on the number of images limits the whole queue, because between two images it holds at most one
/// pose and one removal for each keyframe.
template <class = void>
class basic_map_jobs {
 public:
  [[nodiscard]] bool empty() const noexcept { return jobs_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return jobs_.size(); }
  /// Number of jobs with an image.
  [[nodiscard]] std::size_t images() const noexcept { return images_; }

  /// Appends a job. Poses are merged into poses already waiting at the end of the queue (only removals may follow
  /// them), and a removal that is already waiting is not added again; the resulting map is the same. O(poses log
  /// poses).
  void push(map_job j) {
    if (j.kind == map_job::positions || j.kind == map_job::removal)
      for (auto at = jobs_.rbegin(); at != jobs_.rend(); ++at) {
        if (at->kind == map_job::removal) {
          if (j.kind == map_job::removal && j.frame == at->frame) return;
        } else if (at->kind == map_job::positions && j.kind == map_job::positions) {
          merge(*at, std::move(j));
          return;
        } else if (at->kind != map_job::positions) {
          break;
        }
      }
    const bool has_image = j.has_image();
    jobs_.push_back(std::move(j));
    images_ += has_image ? 1U : 0U;  // after all operations that may throw
  }
  /// Removes and returns the first job. @pre !empty()
  [[nodiscard]] map_job pop() {
    map_job first = std::move(jobs_.front());
    jobs_.pop_front();
    images_ -= first.has_image() ? 1U : 0U;
    return first;
  }
  /// Removes and returns the oldest frame between keyframes, if there is one.
  [[nodiscard]] std::optional<map_job> pop_frame() {
    const auto at =
        std::find_if(jobs_.begin(), jobs_.end(), [](const map_job& j) { return j.kind == map_job::between; });
    if (at == jobs_.end()) return std::nullopt;
    std::optional<map_job> frame{std::move(*at)};
    jobs_.erase(at);
    --images_;
    return frame;
  }
  /// Drops the depth images of `frames`.
  void forget(const std::vector<std::uint64_t>& frames) {
    images_ -= std::erase_if(jobs_, [&](const map_job& j) {
      return j.has_image() && std::find(frames.begin(), frames.end(), j.frame) != frames.end();
    });
  }
  void clear() noexcept {
    jobs_.clear();
    images_ = 0;
  }

 private:
  /// Sets `earlier` to the combined effect of `earlier` followed by `later`.
  static void merge(map_job& earlier, map_job later) {
    if (later.others == unlisted::hide) {  // lists all keyframes: replaces all earlier poses
      earlier.poses = std::move(later.poses);
      earlier.others = unlisted::hide;
      return;
    }
    auto& all = earlier.poses;
    all.insert(all.end(), std::make_move_iterator(later.poses.begin()), std::make_move_iterator(later.poses.end()));
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.frame < b.frame; });
    // The last pose of a frame is the latest.
    auto end = all.begin();
    for (auto p = all.begin(); p != all.end(); ++p)
      if (std::next(p) == all.end() || std::next(p)->frame != p->frame) *end++ = *p;
    all.erase(end, all.end());
  }

  std::deque<map_job> jobs_;
  std::size_t images_ = 0;
};
using map_jobs = basic_map_jobs<>;

}  // namespace orbis::mapping::detail

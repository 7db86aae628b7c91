// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The frames that go into the map, as a range of keyframes that can be gone through again and
/// again: the first ones are kept in memory, the rest is read again when its turn comes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/mapping/keyframe.hpp>
#include <orbis/slam/atlas.hpp>

#include "source.hpp"

namespace app {

class posed_frames {
 public:
  explicit posed_frames(const frame_source& source) : source_{&source} {}

  /// Frame number `i` of the source, where the camera was at `T_world_camera`.
  void add(std::size_t i, const orbis::se3& T_world_camera, const orbis::camera::rgbd_frame& frame) {
    entries_.push_back({i, {}, T_world_camera, kept_of(frame)});
  }
  /// Frame number `i` of the source, which has become a keyframe; where it was is said in the end (`place`).
  void add(std::size_t i, orbis::slam::map_keyframe keyframe, const orbis::camera::rgbd_frame& frame) {
    entries_.push_back({i, keyframe, {}, kept_of(frame)});
  }
  /// Puts each frame where `where(keyframe)` says; those of which it says nothing are dropped.
  template <class Where>
  void place(const Where& where) {
    std::erase_if(entries_, [&](entry& e) {
      const std::optional<orbis::se3> T_world_camera = where(e.keyframe);
      if (T_world_camera) e.T_world_camera = *T_world_camera;
      return !T_world_camera;
    });
  }

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] orbis::trajectory trajectory() const {
    orbis::trajectory poses;  // numbers for times: nobody asks for those
    for (const entry& e : entries_) poses.push_back({static_cast<double>(e.index), e.T_world_camera});
    return poses;
  }

  class iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = orbis::mapping::keyframe<>;
    using difference_type = std::ptrdiff_t;
    using reference = value_type;
    using pointer = void;

    iterator() = default;
    iterator(const posed_frames& of, std::size_t at) : of_{&of}, at_{at} {}
    [[nodiscard]] reference operator*() const {
      if (!frame_) frame_ = of_->load(at_);
      return {frame_->depth_metres(), frame_->color.view(), of_->entries_[at_].T_world_camera};
    }
    iterator& operator++() {
      ++at_;
      frame_.reset();
      return *this;
    }
    iterator operator++(int) {
      iterator before = *this;
      ++*this;
      return before;
    }
    [[nodiscard]] friend bool operator==(const iterator& a, const iterator& b) { return a.at_ == b.at_; }

   private:
    const posed_frames* of_ = nullptr;
    std::size_t at_ = 0;
    mutable std::shared_ptr<const orbis::camera::rgbd_frame> frame_;  // what the value points to
  };
  [[nodiscard]] iterator begin() const { return {*this, 0}; }
  [[nodiscard]] iterator end() const { return {*this, size()}; }

  /// Why a frame could not be read again, if so; it then had no pixels.
  [[nodiscard]] const std::optional<orbis::error>& trouble() const { return trouble_; }

 private:
  struct entry {
    std::size_t index;
    orbis::slam::map_keyframe keyframe;
    orbis::se3 T_world_camera;
    std::shared_ptr<const orbis::camera::rgbd_frame> frame;
  };

  /// A copy, while there is room for it.
  [[nodiscard]] std::shared_ptr<const orbis::camera::rgbd_frame> kept_of(const orbis::camera::rgbd_frame& frame) {
    constexpr std::size_t budget = std::size_t{512} << 20U;
    const std::size_t bytes = frame.color.pixels().size_bytes() + frame.depth.pixels().size_bytes();
    if (in_memory_ + bytes > budget) return nullptr;
    in_memory_ += bytes;
    return std::make_shared<const orbis::camera::rgbd_frame>(frame);
  }

  [[nodiscard]] std::shared_ptr<const orbis::camera::rgbd_frame> load(std::size_t number) const {
    if (entries_[number].frame) return entries_[number].frame;
    auto frame = source_->frame(entries_[number].index);
    if (frame) return std::make_shared<const orbis::camera::rgbd_frame>(*std::move(frame));
    trouble_ = frame.error();
    return std::make_shared<const orbis::camera::rgbd_frame>();
  }

  const frame_source* source_;
  std::vector<entry> entries_;
  std::size_t in_memory_ = 0;
  mutable std::optional<orbis::error> trouble_;
};

}  // namespace app

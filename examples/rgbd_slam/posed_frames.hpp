// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The frames that go into the map, as a range of keyframes that can be gone through again and again. Depth is kept
/// compressed; colour, which is needed once, is read again. One frame at a time is unpacked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/mapping/depth_store.hpp>
#include <orbis/mapping/keyframe.hpp>
#include <orbis/slam/atlas.hpp>

#include "source.hpp"

namespace app {

/// The name of the spill file, in the folder where the files are made. The file has no name once it is open.
inline constexpr const char* spill_name = "depth.spill";

class posed_frames {
  struct unpacked {
    orbis::image<std::uint16_t> depth;
    std::optional<orbis::image<orbis::rgb8>> color;  // once it was asked for
  };

 public:
  /// `spill_file`: for depth beyond what there is room for in memory; see `depth_store_options`.
  posed_frames(const frame_source& source, std::filesystem::path spill_file)
      : source_{&source}, depths_{{.memory_budget = std::size_t{32} << 20U, .spill_file = std::move(spill_file)}} {}

  /// Frame number `i` of the source, where the camera was at `T_world_camera`.
  void add(std::size_t i, const orbis::se3& T_world_camera, const orbis::camera::rgbd_frame& frame) {
    add({i, {}, T_world_camera}, frame);
  }
  /// Frame number `i` of the source, which has become a keyframe; `place` sets its pose later.
  void add(std::size_t i, orbis::slam::map_keyframe keyframe, const orbis::camera::rgbd_frame& frame) {
    add({i, keyframe, {}}, frame);
  }
  /// Gives each frame the pose `where(keyframe)`; frames without a pose are dropped.
  template <class Where>
  void place(const Where& where) {
    std::erase_if(entries_, [&](entry& e) {
      const std::optional<orbis::se3> T_world_camera = where(e.keyframe);
      if (T_world_camera) e.T_world_camera = *T_world_camera;
      if (!T_world_camera) depths_.erase(e.index);
      return !T_world_camera;
    });
  }

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] orbis::trajectory trajectory() const {
    orbis::trajectory poses;  // numbers for times: nobody asks for those
    for (const entry& e : entries_) poses.push_back({static_cast<double>(e.index), e.T_world_camera});
    return poses;
  }

  /// A frame's colours, which are read when they are asked for.
  class colors {
   public:
    colors(const posed_frames& of, std::size_t index, std::shared_ptr<unpacked> images)
        : of_{&of}, index_{index}, images_{std::move(images)} {}
    operator orbis::image_view<const orbis::rgb8>() const {  // NOLINT(google-explicit-constructor)
      if (!images_->color) images_->color = of_->read_color(index_);
      return images_->color->view();
    }

   private:
    const posed_frames* of_;
    std::size_t index_;
    std::shared_ptr<unpacked> images_;
  };
  /// What `mapping::keyframe` is. Its images last as long as it does, or a copy of it.
  struct value {
    orbis::camera::depth_view<std::uint16_t> depth;
    colors color;
    orbis::se3 T_world_camera;
    std::uint64_t frame;  // its number in the source
  };

  class iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = value;
    using difference_type = std::ptrdiff_t;
    using reference = value_type;
    using pointer = void;

    iterator() = default;
    iterator(const posed_frames& of, std::size_t at) : of_{&of}, at_{at} {}
    [[nodiscard]] reference operator*() const {
      if (!images_) images_ = of_->unpack(at_);
      const entry& e = of_->entries_[at_];
      return {orbis::camera::depth_view<std::uint16_t>(images_->depth.view(), of_->source_->camera.depth_scale),
              colors{*of_, e.index, images_}, e.T_world_camera, e.index};
    }
    iterator& operator++() {
      ++at_;
      images_.reset();
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
    mutable std::shared_ptr<unpacked> images_;  // what the value points to
  };
  [[nodiscard]] iterator begin() const { return {*this, 0}; }
  [[nodiscard]] iterator end() const { return {*this, size()}; }

  /// Why depth images that should be in the spill file are in memory instead, if so.
  [[nodiscard]] const std::optional<orbis::error>& unspilled() const { return unspilled_; }
  /// Why an image could not be had again, if so; it then had no pixels.
  [[nodiscard]] const std::optional<orbis::error>& trouble() const { return trouble_; }

 private:
  struct entry {
    std::size_t index;
    orbis::slam::map_keyframe keyframe;
    orbis::se3 T_world_camera;
  };

  void add(const entry& e, const orbis::camera::rgbd_frame& frame) {
    entries_.push_back(e);
    if (auto kept = depths_.put(e.index, frame.depth); !kept) unspilled_ = kept.error();
  }
  [[nodiscard]] std::shared_ptr<unpacked> unpack(std::size_t number) const {
    auto images = std::make_shared<unpacked>();
    if (auto done = depths_.get(entries_[number].index, images->depth); !done) {
      trouble_ = done.error();
      images->depth = orbis::image<std::uint16_t>(source_->camera.model.width(), source_->camera.model.height());
    }
    return images;
  }
  [[nodiscard]] orbis::image<orbis::rgb8> read_color(std::size_t index) const {
    auto read = source_->color(index);
    if (read) return *std::move(read);
    trouble_ = read.error();
    return {};
  }

  const frame_source* source_;
  std::vector<entry> entries_;
  orbis::mapping::depth_store depths_;
  std::optional<orbis::error> unspilled_;
  mutable std::optional<orbis::error> trouble_;
};

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The frames of a map, as a multi-pass range of keyframes. Depth is stored compressed. Colour, which is needed only
/// once and only for the pixels that become points, is stored in a file, or read again if the file would be too large.
/// One frame at a time is unpacked, while another thread unpacks the next one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <future>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/mapping/keyframe.hpp>
#include <orbis/slam/atlas.hpp>

#include "background.hpp"
#include "color_file.hpp"
#include "corrected_frame.hpp"
#include "keyframe_depths.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

/// The name of the spill file in the folder of new files. The file is unlinked as soon as it is open.
inline constexpr const char* spill_name = ".rgbd_slam.depths";  // no result may have this name

/// The maximum size of the colour file if colours can be read again.
inline constexpr std::uint64_t most_color_bytes = std::uint64_t{256} << 20U;

class posed_frames {
  struct unpacked {
    orbis::image<std::uint16_t> depth;
    std::optional<orbis::image<orbis::rgb8>> color;  // set by the first access
    std::optional<orbis::error> error;
  };

 public:
  /// `spill_file`: for depth images beyond the memory budget; see `depth_store_options`.
  posed_frames(const frame_source& source, const settings& s, const std::filesystem::path& spill_file)
      : source_{&source},
        background_{s.threads != 1},
        depths_{std::make_unique<keyframe_depths>(
            orbis::mapping::depth_store_options{.memory_budget = s.depth_memory << 20U, .spill_file = spill_file},
            background_)},
        colors_{spill_file.string() + ".colors", point_stride,
                source.made ? std::numeric_limits<std::uint64_t>::max() : most_color_bytes} {}

  /// Adds frame `i` of the source with its pose. `corrected_by`: see the overload for keyframes.
  void add(std::size_t i, const orbis::se3& T_world_camera, const orbis::slam::frame_motion& corrected_by,
           const orbis::image<std::uint16_t>& depth, const orbis::image<orbis::rgb8>& color) {
    add({i, {}, T_world_camera, corrected_by}, depth, color);
  }
  /// Adds frame `i` of the source, a keyframe whose pose is set later by `place`. `corrected_by`: the camera motion for
  /// which its images were corrected; zero if they are unchanged images of the source.
  void add(std::size_t i, orbis::slam::map_keyframe keyframe, const orbis::slam::frame_motion& corrected_by,
           const orbis::image<std::uint16_t>& depth, const orbis::image<orbis::rgb8>& color) {
    add({i, keyframe, {}, corrected_by}, depth, color);
  }
  /// Sets the pose of each frame to `where(keyframe)` and drops frames without a pose.
  template <class Where>
  void place(const Where& where) {
    depths_->finish();
    std::erase_if(entries_, [&](entry& e) {
      const std::optional<orbis::se3> T_world_camera = where(e.keyframe);
      if (T_world_camera) e.T_world_camera = *T_world_camera;
      if (!T_world_camera) depths_->erase(e.index);
      return !T_world_camera;
    });
    depths_->free_buffers();  // no more frames follow
  }

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] orbis::trajectory trajectory() const {
    orbis::trajectory poses;  // with frame numbers in place of time stamps
    for (const entry& e : entries_) poses.push_back({static_cast<double>(e.index), e.T_world_camera});
    return poses;
  }

  /// The colours of a frame, read on access. Pixels that do not become points may be black.
  class colors {
   public:
    colors(const posed_frames& of, std::size_t entry, std::shared_ptr<unpacked> images)
        : of_{&of}, entry_{entry}, images_{std::move(images)} {}
    operator orbis::image_view<const orbis::rgb8>() const {  // NOLINT(google-explicit-constructor)
      if (!images_->color) of_->read_color(of_->entries_[entry_], *images_);
      of_->note_error(*images_);
      return images_->color->view();
    }

   private:
    const posed_frames* of_;
    std::size_t entry_;
    std::shared_ptr<unpacked> images_;
  };
  /// Models `mapping::keyframe`. Its images live as long as the value or a copy of it.
  struct value {
    orbis::camera::depth_view<std::uint16_t> depth;
    colors color;
    orbis::se3 T_world_camera;
    std::uint64_t frame;  // index in the source
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
              colors{*of_, at_, images_}, e.T_world_camera, e.index};
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
    mutable std::shared_ptr<unpacked> images_;  // also owned by the value
  };
  [[nodiscard]] iterator begin() const {
    depths_->finish();
    spare_.clear();  // of a pass that did not reach its end
    return {*this, 0};
  }
  [[nodiscard]] iterator end() const { return {*this, size()}; }

  /// The spill file error that forced depth images to be kept in memory; empty if there was none.
  [[nodiscard]] std::optional<orbis::error> unspilled() const { return depths_->unspilled(); }
  /// The depth images, which are shared with the live map.
  [[nodiscard]] keyframe_depths& depths() const { return *depths_; }
  /// The last error in reading an image, which was then treated as empty; nullopt if there was none.
  [[nodiscard]] const std::optional<orbis::error>& read_error() const { return read_error_; }

 private:
  struct entry {
    std::size_t index;
    orbis::slam::map_keyframe keyframe;
    orbis::se3 T_world_camera;
    orbis::slam::frame_motion corrected_by;
  };

  void add(const entry& e, const orbis::image<std::uint16_t>& depth, const orbis::image<orbis::rgb8>& color) {
    entries_.push_back(e);
    depths_->put(e.index, depth);
    colors_.put(e.index, color);
  }
  /// Returns the images of entry `number`, from the background thread if it was started for this entry.
  [[nodiscard]] std::shared_ptr<unpacked> unpack(std::size_t number) const {
    std::shared_ptr<unpacked> images;
    if (ahead_.valid()) {
      images = ahead_.get();
      if (ahead_number_ != number) images.reset();
    }
    if (!images) images = read(number, free_images());
    note_error(*images);
    if (number + 1 == entries_.size()) {
      spare_.clear();
    } else if (background_) {
      ahead_number_ = number + 1;
      ahead_ = thread_->start([this, next = number + 1, to = free_images()] { return read(next, to); });
    }
    return images;
  }
  /// Returns images that no value owns any more, or new ones. A value must be released on the thread that iterates:
  /// `use_count` does not synchronise with other threads.
  [[nodiscard]] std::shared_ptr<unpacked> free_images() const {
    const auto unused =
        std::find_if(spare_.begin(), spare_.end(), [](const auto& images) { return images.use_count() == 1; });
    return unused != spare_.end() ? *unused : spare_.emplace_back(std::make_shared<unpacked>());
  }
  [[nodiscard]] std::shared_ptr<unpacked> read(std::size_t number, const std::shared_ptr<unpacked>& to) const {
    to->color.reset();  // few frames need their colours at the same time
    to->error.reset();
    if (auto done = depths_->get_whole(entries_[number].index, to->depth); !done) {
      to->error = done.error();
      to->depth = orbis::image<std::uint16_t>(source_->camera.model.width(), source_->camera.model.height());
    }
    return to;
  }
  void read_color(const entry& e, unpacked& images) const {
    images.color.emplace(source_->camera.model.width(), source_->camera.model.height());
    if (colors_.get(e.index, *images.color)) return;
    auto read = source_->color(e.index);
    if (!read) images.error = read.error();
    images.color = read ? *std::move(read) : orbis::image<orbis::rgb8>{};
    const orbis::camera::depth_view depth{images.depth, source_->camera.depth_scale};
    if (read && !e.corrected_by.twist.isZero(0.0))
      frame_correction{source_->camera.model}.correct_color(depth, e.corrected_by, *images.color);
  }
  void note_error(const unpacked& images) const {
    if (images.error) read_error_ = images.error;
  }

  const frame_source* source_;
  bool background_;
  std::vector<entry> entries_;
  std::unique_ptr<keyframe_depths> depths_;
  color_file colors_;
  mutable std::optional<orbis::error> read_error_;
  mutable std::vector<std::shared_ptr<unpacked>> spare_;  // images in use, and images to reuse
  mutable std::size_t ahead_number_ = 0;
  mutable std::future<std::shared_ptr<unpacked>> ahead_;
  std::unique_ptr<background_thread> thread_ = std::make_unique<background_thread>();  // uses the other members
};

}  // namespace app

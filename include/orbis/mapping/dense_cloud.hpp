// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The points of all keyframes' depth images as one cloud in the world frame, updated when keyframe poses change.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ranges>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/camera/rays.hpp>
#include <orbis/cloud/flying_pixels.hpp>
#include <orbis/cloud/voxel_sums.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/types.hpp>
#include <orbis/mapping/detail/live/view_frustum.hpp>
#include <orbis/mapping/keyframe.hpp>
#include <orbis/mapping/keyframe_points.hpp>
#include <orbis/mapping/masked_depth.hpp>

namespace orbis::mapping {

struct dense_options {
  int stride = 2;           ///< every stride-th pixel of every stride-th row; > 0
  float min_depth = 0.0F;   ///< metres along the optical axis
  float max_depth = 4.0F;   ///< metres along the optical axis
  double voxel_size = 0.0;  ///< metres; points in a voxel are replaced by their centroid. 0: every point is kept
  /// Removal of flying pixels, whose depth lies between two surfaces, before they become points; empty: no removal.
  std::optional<cloud::flying_pixel_options> flying_pixels{};
};

/// Returns the options that select the pixels that become points of the cloud.
[[nodiscard]] inline keyframe_point_options point_options(const dense_options& options) {
  return {options.stride, options.min_depth, options.max_depth, options.flying_pixels};
}

/// A cloud that grows with each keyframe and is updated when keyframe poses change.
///
/// With a voxel size, memory is proportional to the observed surface (about 50 bytes for each voxel, and 20 for each
/// measurement of the largest keyframe); without one, it is proportional to the number of measurements. In both cases
/// the cloud depends only on the keyframes and their latest poses: after corrections without a tolerance it is, byte
/// for byte, the cloud built with the corrected poses from the start. With a voxel size it does not depend on the order
/// of the keyframes either.
class dense_cloud {
 public:
  /// @pre options.stride > 0, options.voxel_size >= 0
  explicit dense_cloud(camera::ray_table rays, const dense_options& options = {})
      : rays_{std::move(rays)}, options_{options}, voxels_{options.voxel_size > 0 ? options.voxel_size : 1.0} {
    assert(options.stride > 0 && options.voxel_size >= 0);
  }

  /// Adds a keyframe's points; returns the number of measurements. The index of the keyframe (`number` below) is the
  /// number of keyframes added before it. Colours are kept if every keyframe has them. O(pixels). @pre the images have
  /// the size of the ray table; the pose is finite; with a voxel size, fewer than 2^22 measurements per voxel; `finish`
  /// has not been called
  template <execution_policy Policy, keyframe_like Keyframe>
  std::size_t add_keyframe(const Policy& policy, const Keyframe& k) {
    assert(!finished_);
    frames_.push_back({});
    return put(policy, k, frames_.size() - 1);
  }
  /// Removes keyframe `number`. Reads only the images of `k`. O(pixels). @pre it was added with the same images and has
  /// not been removed; `finish` has not been called
  template <execution_policy Policy, keyframe_like Keyframe>
  void remove(const Policy& policy, const Keyframe& k, std::size_t number) {
    assert(contains(number) && !finished_);
    frame& f = frames_[number];
    if (merging()) {
      static_cast<void>(measure(policy, k, f.T_world_camera));
      voxels_.remove(policy, parts_);
    } else {
      size_ -= f.cloud.size();
    }
    present_ -= 1;
    colored_ -= f.colored ? 1 : 0;
    f = {};
  }
  /// Moves keyframe `number` to the current pose of `k`. O(pixels).
  /// @pre it was added with the same images and has not been removed; the pose is finite; `finish` has not been called
  template <execution_policy Policy, keyframe_like Keyframe>
  void move(const Policy& policy, const Keyframe& k, std::size_t number) {
    remove(policy, k, number);
    put(policy, k, number);
  }
  /// Moves all keyframes whose pose has changed since they were last placed. With `tolerance` 0, or if `max_depth` is
  /// not finite, any bitwise change counts; with a `tolerance` (metres), only a change that moves a point in the
  /// keyframe's view, up to `max_depth`, by more than the tolerance. Returns the number of moved keyframes.
  /// `keyframes`: all keyframes added so far, in the order in which they were added; removed ones are skipped.
  /// O(keyframes + pixels of those that moved), plus O(pixels of one image) with a tolerance. @pre `keyframes` has one
  /// entry per added keyframe; the poses are finite; tolerance >= 0; `finish` has not been called
  template <execution_policy Policy, keyframe_range Keyframes>
  std::size_t reassemble(const Policy& policy, const Keyframes& keyframes, double tolerance = 0.0) {
    assert(std::ranges::size(keyframes) == frames_.size() && tolerance >= 0 && !finished_);
    std::optional<detail::view_frustum> view;
    if (tolerance > 0) view.emplace(rays_);
    const auto has_moved = [&](const se3& before, const se3& now) {
      if (before.to_matrix() == now.to_matrix()) return false;
      return !view || !(view->displacement(before, now, static_cast<double>(options_.max_depth)) <= tolerance);
    };
    std::size_t moved = 0;
    std::size_t number = 0;
    for (const auto& k : keyframes) {
      if (contains(number) && has_moved(frames_[number].T_world_camera, se3(k.T_world_camera))) {
        move(policy, k, number);
        ++moved;
      }
      ++number;
    }
    return moved;
  }

  /// Returns true if keyframe `number` was added and not removed.
  [[nodiscard]] bool contains(std::size_t number) const noexcept {
    return number < frames_.size() && frames_[number].present;
  }
  /// Number of points.
  [[nodiscard]] std::size_t size() const noexcept { return merging() ? voxels_.size() : size_; }
  /// Returns the current cloud in the world frame: voxel by voxel in the order of `cloud::voxel_sums`, or keyframe by
  /// keyframe. O(size()), and O(bricks log bricks) with a voxel size. @pre `finish` has not been called
  template <execution_policy Policy = sequential_policy>
  [[nodiscard]] point_cloud cloud(const Policy& policy = {}) const {
    assert(!finished_);
    const bool with_colors = colored_ == present_;
    if (merging()) return voxels_.cloud(policy, voxels_.in_order(), with_colors);
    point_cloud out;
    for (const frame& f : frames_) {
      out.points.insert(out.points.end(), f.cloud.points.begin(), f.cloud.points.end());
      if (with_colors) out.colors.insert(out.colors.end(), f.cloud.colors.begin(), f.cloud.colors.end());
    }
    return out;
  }
  /// Returns the distance (metres) from which each point of the cloud was observed; with a voxel size, the mean over
  /// the measurements in the voxel, to the nearest millimetre. (A mean can be updated when a keyframe is removed; a
  /// minimum could not.) O(size()). @pre `finish` has not been called
  template <execution_policy Policy = sequential_policy>
  [[nodiscard]] std::vector<float> ranges(const Policy& policy = {}) const {
    assert(!finished_);
    if (merging()) return voxels_.ranges(policy, voxels_.in_order());
    std::vector<float> out;
    for (const frame& f : frames_) out.insert(out.end(), f.ranges.begin(), f.ranges.end());
    return out;
  }
  /// Finalises the cloud and frees the memory that only `cloud`, `ranges` and changes of the keyframes use. Call it
  /// after the last call to `cloud` and `ranges`; no keyframe may be added, removed or moved afterwards. With a voxel
  /// size, a few bytes for each voxel remain, for `select`, `masked_depth` and `measurements`; without one, nothing is
  /// freed. O(bricks).
  void finish() {
    finished_ = true;
    voxels_.finish();
    std::vector<cloud::voxel_measurements>{}.swap(parts_);
  }
  /// Numbers of examined and removed pixels in the full images of all keyframes.
  [[nodiscard]] cloud::flying_pixel_count flying_pixels() const noexcept {
    cloud::flying_pixel_count sum;
    for (const frame& f : frames_) {
      sum.valid += f.flying.valid;
      sum.removed += f.flying.removed;
    }
    return sum;
  }
  /// Memory in use, excluding the ray table, bytes.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = voxels_.memory_bytes() + frames_.capacity() * sizeof(frame);
    for (const cloud::voxel_measurements& part : parts_) bytes += part.memory_bytes();
    for (const frame& f : frames_) {
      bytes += f.cloud.points.capacity() * sizeof(vec3f) + f.cloud.colors.capacity() * sizeof(rgb8) +
               f.ranges.capacity() * sizeof(float);
    }
    return bytes;
  }

  /// A subset of the cloud's points to keep, stored for fast look-ups. Valid until the cloud changes.
  class selection {
   public:
    /// Keeps every point.
    selection() = default;

   private:
    friend class dense_cloud;
    [[nodiscard]] bool is_everything() const noexcept { return !voxels_ && first_of_frame_.empty(); }
    std::vector<char> kept_;                           ///< used if points are not merged
    std::optional<cloud::voxel_sums::choice> voxels_;  ///< used if points are merged
    std::vector<std::size_t> first_of_frame_;
  };
  /// Creates a selection of the points with the given indices, such as a filter of the cloud returns. O(size).
  /// @pre every index < size()
  [[nodiscard]] selection select(std::span<const std::uint32_t> inliers) const {
    std::vector<char> kept(size(), 0);
    for (const std::uint32_t i : inliers) {
      assert(i < kept.size());
      kept[i] = 1;
    }
    selection out;
    if (merging()) {
      out.voxels_ = voxels_.choose(kept);
    } else {
      out.kept_ = std::move(kept);
      std::size_t first = 0;
      for (const frame& f : frames_) {
        out.first_of_frame_.push_back(first);
        first += f.cloud.size();
      }
    }
    return out;
  }
  /// The whole depth image of keyframe `number` (every pixel, regardless of the stride; the stored values, see
  /// `view_like`) with 0 in the pixels that the cloud excludes: those with a depth out of range, flying pixels if they
  /// are removed, and pixels that belong to a point that is not in `kept`. A pixel that the stride skips belongs to the
  /// point in its voxel. Without voxels, it belongs to the point of its block of stride x stride pixels if the depths
  /// of the two pixels differ by at most 3 cm plus 2 % for each pixel of distance between them. A pixel that belongs to
  /// no point is excluded. O(pixels).
  /// @pre same as for `measurements`
  template <execution_policy Policy, keyframe_like Keyframe>
  [[nodiscard]] auto masked_depth(const Policy& policy, const Keyframe& k, std::size_t number,
                                  const selection& kept = {}) const {
    assert(contains(number));
    keyframe_points reader;  // const functions must not share buffers
    auto out = reader.masked(policy, k.depth, rays_, point_options(options_));
    if (kept.is_everything()) return out;
    const auto whole = out;
    remove_points(
        policy,
        view_like(k.depth, image_view<const camera::depth_pixel<std::remove_cvref_t<decltype(k.depth)>>>(whole)),
        number, kept, out.view());
    return out;
  }
  /// The second half of `masked_depth`: sets pixels of `out`, a copy of the stored values of `depth`, to 0 if they
  /// belong to no point of the cloud or to a point that is not kept. O(pixels). @pre contains(number), and `depth` is
  /// its image as returned by `keyframe_points::masked`
  template <execution_policy Policy, camera::depth_source Depth>
  void remove_points(const Policy& policy, const Depth& depth, std::size_t number, const selection& kept,
                     image_view<camera::depth_pixel<Depth>> out) const {
    assert(contains(number));
    if (kept.is_everything()) return;
    keyframe_point_options points = point_options(options_);
    points.flying_pixels.reset();  // already removed
    const se3& T_world_camera = frames_[number].T_world_camera;
    keyframe_points reader;  // const functions must not share buffers
    if (!kept.voxels_) {
      image<std::uint8_t> block_kept((rays_.width() + options_.stride - 1) / options_.stride,
                                     (rays_.height() + options_.stride - 1) / options_.stride);
      std::size_t next = kept.first_of_frame_[number];
      reader.read(seq, depth, rays_, points, T_world_camera, [&](std::size_t, int x, int y, const vec3f&, float) {
        assert(next < kept.first_of_frame_[number] + frames_[number].cloud.size());
        block_kept(x / options_.stride, y / options_.stride) = kept.kept_[next++] != 0 ? 1 : 0;
      });
      for (int y = 0; y != rays_.height(); ++y)
        for (int x = 0; x != rays_.width(); ++x)
          if (block_kept(x / options_.stride, y / options_.stride) == 0 || !is_like_its_block(depth, x, y))
            out(x, y) = 0;
      return;
    }
    points.stride = 1;
    const camera::float_pose pose{T_world_camera};
    std::vector<cloud::voxel_sums::choice::reader> readers(keyframe_points::parts(rays_, 1),
                                                           cloud::voxel_sums::choice::reader{*kept.voxels_});
    reader.read(
        policy, depth, rays_, points, T_world_camera, [&](std::size_t part, int x, int y, const vec3f& point, float) {
          std::optional<bool> is_kept = readers[part].find(point.cast<double>());
          if (!is_kept && is_like_its_block(depth, x, y)) {  // decided by the point of its block
            const auto block =
                keyframe_points::point_at(depth, x - x % options_.stride, y - y % options_.stride, rays_, points, pose);
            if (block) is_kept = readers[part].find(block->template cast<double>());
          }
          if (!is_kept.value_or(false)) out(x, y) = 0;
        });
  }
  /// Returns those measurements of keyframe `number` whose cloud point is in `kept`, in the world frame, at the latest
  /// pose of the keyframe. Reads only the images of `k`. O(pixels). @pre contains(number); the keyframe was added with
  /// the images of `k`
  template <execution_policy Policy, keyframe_like Keyframe>
  [[nodiscard]] std::vector<vec3f> measurements(const Policy& policy, const Keyframe& k, std::size_t number,
                                                const selection& kept = {}) const {
    assert(contains(number));
    const bool all = kept.is_everything();
    std::vector<vec3f> out;
    if (!merging()) {
      const std::vector<vec3f>& points = frames_[number].cloud.points;
      if (all) return points;
      const std::size_t first = kept.first_of_frame_[number];
      for (std::size_t i = 0; i != points.size(); ++i) {
        if (kept.kept_[first + i] != 0) out.push_back(points[i]);
      }
      return out;
    }
    keyframe_points reader;  // const functions must not share buffers
    std::vector<std::vector<vec3f>> parts(reader.parts(rays_, options_.stride));
    std::vector<cloud::voxel_sums::choice::reader> readers;
    if (!all) readers.assign(parts.size(), cloud::voxel_sums::choice::reader{*kept.voxels_});
    reader.read(policy, k.depth, rays_, point_options(options_), frames_[number].T_world_camera,
                [&](std::size_t part, int, int, const vec3f& point, float) {
                  if (!all && !readers[part].find(point.cast<double>()).value_or(false)) return;
                  parts[part].push_back(point);
                });
    for (const auto& part : parts) out.insert(out.end(), part.begin(), part.end());
    return out;
  }

 private:
  /// Returns true if the depth of a pixel agrees with the depth of the pixel that represents its block in the cloud:
  /// for each pixel of distance they may differ by 3 cm plus 2 % of the depth, so that slanted surfaces agree at any
  /// stride.
  template <class Depth>
  [[nodiscard]] bool is_like_its_block(const Depth& depth, int x, int y) const {
    const int dx = x % options_.stride, dy = y % options_.stride;
    const float z = depth(x, y), of_block = depth(x - dx, y - dy);
    return std::abs(z - of_block) <= static_cast<float>(std::max(dx, dy)) * (0.03F + 0.02F * std::min(z, of_block));
  }

  struct frame {
    se3 T_world_camera{};
    bool present = false;
    bool colored = false;
    cloud::flying_pixel_count flying{};
    point_cloud cloud{};  ///< used if points are not merged
    std::vector<float> ranges{};
  };

  [[nodiscard]] bool merging() const noexcept { return options_.voxel_size > 0; }
  template <execution_policy Policy, keyframe_like Keyframe>
  std::size_t put(const Policy& policy, const Keyframe& k, std::size_t number) {
    frame& f = frames_[number];
    f.T_world_camera = k.T_world_camera;
    f.present = true;
    f.colored = !image_view<const rgb8>(k.color).empty();
    present_ += 1;
    colored_ += f.colored ? 1 : 0;
    std::size_t measured = 0;
    f.flying = measure(policy, k, f.T_world_camera);
    if (merging()) {
      voxels_.add(policy, parts_);
      for (const auto& part : parts_) measured += part.size() + part.without_voxel();
      return measured;
    }
    for (const plain_points& part : plain_) {
      f.cloud.points.insert(f.cloud.points.end(), part.cloud.points.begin(), part.cloud.points.end());
      f.cloud.colors.insert(f.cloud.colors.end(), part.cloud.colors.begin(), part.cloud.colors.end());
      f.ranges.insert(f.ranges.end(), part.ranges.begin(), part.ranges.end());
    }
    size_ += f.cloud.size();
    return f.cloud.size();
  }

  /// Fills `parts_`, or `plain_` if points are not merged.
  template <execution_policy Policy, keyframe_like Keyframe>
  [[nodiscard]] cloud::flying_pixel_count measure(const Policy& policy, const Keyframe& k, const se3& T_world_camera) {
    const image_view<const rgb8> color = k.color;
    assert(color.empty() || (color.width() == rays_.width() && color.height() == rays_.height()));
    const std::size_t parts = reader_.parts(rays_, options_.stride);
    const auto color_at = [&](int x, int y) { return color.empty() ? rgb8{} : color(x, y); };
    if (merging()) {
      parts_.resize(parts, cloud::voxel_measurements{options_.voxel_size});
      for (auto& part : parts_) part.clear();
      return reader_.read(policy, k.depth, rays_, point_options(options_), T_world_camera,
                          [&](std::size_t part, int x, int y, const vec3f& point, float range) {
                            parts_[part].push(point.cast<double>(), color_at(x, y), range);
                          });
    }
    plain_.resize(parts);
    for (auto& part : plain_) part.clear();
    return reader_.read(policy, k.depth, rays_, point_options(options_), T_world_camera,
                        [&](std::size_t part, int x, int y, const vec3f& point, float range) {
                          plain_[part].cloud.points.push_back(point);
                          plain_[part].cloud.colors.push_back(color_at(x, y));
                          plain_[part].ranges.push_back(range);
                        });
  }

  struct plain_points {
    point_cloud cloud;
    std::vector<float> ranges;
    void clear() {
      cloud.points.clear();
      cloud.colors.clear();
      ranges.clear();
    }
  };

  camera::ray_table rays_;
  dense_options options_;
  cloud::voxel_sums voxels_;
  std::vector<frame> frames_;
  bool finished_ = false;
  std::size_t size_ = 0;     ///< number of points, if points are not merged
  std::size_t present_ = 0;  ///< number of keyframes
  std::size_t colored_ = 0;  ///< number of keyframes with colours
  // Members only so that their memory is reused.
  keyframe_points reader_;
  std::vector<cloud::voxel_measurements> parts_;
  std::vector<plain_points> plain_;
};

}  // namespace orbis::mapping

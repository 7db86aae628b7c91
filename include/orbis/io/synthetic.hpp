// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Synthetic recordings: a furnished room, a hand-held camera, and ground truth for both.
///
/// @code
///   orbis::io::synthetic_recording room{{.frames = 300, .seed = 7}};
///   for (const orbis::camera::rgbd_frame& frame : room) slam.track(frame);
///   double error = room.surface_distance(point_of_the_map);
/// @endcode
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <memory>
#include <type_traits>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/camera/stereo_frame.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/detail/synthetic/exact_view.hpp>
#include <orbis/io/synthetic_options.hpp>

namespace orbis::io {

namespace detail::synthetic {

class scene;
struct recorded_room;

/// A parallel policy with the number of threads of `policy`. The rendered images do not depend on the policy.
template <execution_policy Policy>
[[nodiscard]] parallel_policy as_parallel(const Policy& policy) {
  if constexpr (std::is_same_v<Policy, parallel_policy>)
    return policy;
  else
    return par.with(std::max(1U, static_cast<unsigned>(policy.threads())));
}

}  // namespace detail::synthetic

/// A recording of a hand-held or robot-mounted camera that moves once around a furnished room, with exact ground truth.
/// Frames are independent: they may be requested in any order and from several threads, and are identical byte for byte
/// on every machine (except the pose, whose last bit may differ).
///
/// The floor of the room is at z = 0 with the origin at its centre. A surface's texture is generated when the surface
/// is first visible, which takes a few tenths of a second for the first frames at 640x480. All textures together take
/// about 50 MB; copies of the recording share them.
class synthetic_recording {
 public:
  class iterator;

  /// @pre frames >= 0, fps > 0, width and height > 0, depth_scale > 0, light > 0, and the preconditions of the scene
  /// and the path
  ORBIS_LAZY explicit synthetic_recording(const synthetic_options& options = {});

  [[nodiscard]] std::size_t size() const noexcept { return static_cast<std::size_t>(options_.frames); }
  [[nodiscard]] bool empty() const noexcept { return size() == 0; }
  /// Time in seconds.
  [[nodiscard]] double timestamp(std::size_t i) const noexcept { return static_cast<double>(i) / options_.fps; }
  [[nodiscard]] const synthetic_options& options() const noexcept { return options_; }
  /// The unsigned distance (metres) from a point in the world frame to the nearest surface visible to a camera: the
  /// error of a map point. Exact in front of the surfaces; behind them, where solids overlap, it is the distance to the
  /// surface of the solid in which the point is deepest. Ignores moving solids. O(number of solids)
  ORBIS_LAZY [[nodiscard]] double surface_distance(const vec3& p_world) const noexcept;
  /// The room's solids, for tests of this component (io/detail/synthetic/scene.hpp).
  [[nodiscard]] const detail::synthetic::scene& scene() const noexcept;
  /// A pinhole camera with a focal length of 525 pixels at a width of 640 pixels.
  [[nodiscard]] camera::camera_settings camera() const {
    return {.model = camera::pinhole{k_},
            .depth_scale = options_.depth_scale,
            .fps = options_.fps,
            .baseline = options_.sensor.baseline,
            .shutter = options_.sensor.shutter};
  }
  /// The camera of `stereo_frame`: like `camera()`, with the baseline.
  [[nodiscard]] camera::camera_settings stereo_camera() const {
    camera::camera_settings both = camera();
    both.baseline = options_.sensor.stereo_baseline;
    return both;
  }
  /// The exact pose of frame `i`.
  ORBIS_LAZY [[nodiscard]] se3 T_world_camera(std::size_t i) const;
  /// The exact poses of all frames.
  ORBIS_LAZY [[nodiscard]] trajectory ground_truth() const;

  /// Frame `i` as measured by the sensor. Errors: invalid_argument if there is no frame `i`.
  ORBIS_LAZY [[nodiscard]] result<camera::rgbd_frame> frame(std::size_t i) const;

  /// Frame `i` as measured by the sensor, rendered on the policy's threads. Errors: those of `frame`.
  template <execution_policy Policy>
  [[nodiscard]] result<camera::rgbd_frame> render(const Policy& policy, std::size_t i) const {
    return render_on(detail::synthetic::as_parallel(policy), i);
  }

  /// Frame `i` of a stereo camera, whose left camera is `camera()` and whose right camera is displaced by
  /// `stereo_camera().baseline` to the right. Errors: those of `frame`.
  ORBIS_LAZY [[nodiscard]] result<camera::stereo_frame> stereo_frame(std::size_t i) const;
  template <execution_policy Policy>
  [[nodiscard]] result<camera::stereo_frame> render_stereo(const Policy& policy, std::size_t i) const {
    return render_stereo_on(detail::synthetic::as_parallel(policy), i);
  }

  /// Colour, depth (metres) and angles of incidence of frame `i` without sensor errors. Errors: invalid_argument if
  /// there is no frame `i`.
  template <execution_policy Policy>
  [[nodiscard]] result<detail::synthetic::exact_view> exact(const Policy& policy, std::size_t i) const {
    return exact_on(detail::synthetic::as_parallel(policy), i);
  }

  /// Exact depth image for a camera of any model at any pose in the room: depths in metres along the optical axis; 0
  /// where a pixel has no ray, and everywhere if the camera is outside the room. Ignores moving solids.
  template <execution_policy Policy, camera::camera_model Camera>
  [[nodiscard]] image<float> exact_depth(const Policy& policy, const Camera& camera, const se3& T_world_camera) const {
    image<float> depth(camera.width(), camera.height());
    for_each_index(policy, static_cast<std::size_t>(camera.height()), 1, [&](std::size_t row) {
      const int y = static_cast<int>(row);
      for (int x = 0; x != camera.width(); ++x)
        if (const auto ray = camera.unproject(vec2{double(x), double(y)}))  // z = 1, so depth_along returns a depth
          depth(x, y) = static_cast<float>(depth_along(T_world_camera.translation(), T_world_camera.rotation() * *ray));
    });
    return depth;
  }

  /// Iterates over the frames; each one is rendered when the iterator reaches it.
  ORBIS_LAZY [[nodiscard]] iterator begin() const;
  ORBIS_LAZY [[nodiscard]] iterator end() const;

 private:
  ORBIS_LAZY [[nodiscard]] result<camera::rgbd_frame> render_on(const parallel_policy& policy, std::size_t i) const;
  ORBIS_LAZY [[nodiscard]] result<camera::stereo_frame> render_stereo_on(const parallel_policy& policy,
                                                                         std::size_t i) const;
  ORBIS_LAZY [[nodiscard]] result<detail::synthetic::exact_view> exact_on(const parallel_policy& policy,
                                                                          std::size_t i) const;
  /// Distance from a point along a ray to the nearest surface, in multiples of the ray's length; 0 if there is none.
  ORBIS_LAZY [[nodiscard]] double depth_along(const vec3& origin, const vec3& ray) const;

  synthetic_options options_;
  camera::intrinsics k_;
  std::shared_ptr<const detail::synthetic::recorded_room> room_;  // shared by copies
};

/// Single-pass iterator over the frames; a frame is valid until the iterator advances.
class synthetic_recording::iterator {
 public:
  using iterator_concept = std::input_iterator_tag;
  using iterator_category = std::input_iterator_tag;
  using value_type = camera::rgbd_frame;
  using difference_type = std::ptrdiff_t;
  using reference = const camera::rgbd_frame&;
  using pointer = const camera::rgbd_frame*;

  iterator() = default;
  ORBIS_LAZY iterator(const synthetic_recording& recording, std::size_t index) : recording_{&recording}, index_{index} {
    load();
  }

  [[nodiscard]] reference operator*() const noexcept { return *frame_; }
  [[nodiscard]] pointer operator->() const noexcept { return frame_.get(); }
  ORBIS_LAZY iterator& operator++() {
    ++index_;
    load();
    return *this;
  }
  ORBIS_LAZY void operator++(int) { ++*this; }
  [[nodiscard]] friend bool operator==(const iterator& a, const iterator& b) noexcept { return a.index_ == b.index_; }

 private:
  ORBIS_LAZY void load();

  const synthetic_recording* recording_ = nullptr;
  std::size_t index_ = 0;
  std::shared_ptr<const camera::rgbd_frame> frame_;
};

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/synthetic-inl.hpp>
#endif

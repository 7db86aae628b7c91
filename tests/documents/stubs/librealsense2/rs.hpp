// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of librealsense2: just the names that the tutorial uses, with the library's signatures. The pipeline gives a
/// few frames, and then none, as if the camera had been unplugged.
#pragma once

#include <cstddef>
#include <optional>

#include <orbis/camera/rgbd_frame.hpp>

#include "../synthetic_camera.hpp"

enum rs2_stream { RS2_STREAM_DEPTH, RS2_STREAM_COLOR };
enum rs2_format { RS2_FORMAT_Z16, RS2_FORMAT_RGB8 };
enum rs2_distortion { RS2_DISTORTION_NONE, RS2_DISTORTION_INVERSE_BROWN_CONRADY, RS2_DISTORTION_BROWN_CONRADY };
struct rs2_intrinsics {
  int width, height;
  float ppx, ppy, fx, fy;
  rs2_distortion model;
  float coeffs[5];
};

namespace rs2 {

class config {
 public:
  void enable_stream(rs2_stream, int, int, rs2_format, int) {}
};
class video_stream_profile {
 public:
  [[nodiscard]] rs2_intrinsics get_intrinsics() const {
    const auto& k = stubs::intrinsics();
    return {k.width,
            k.height,
            static_cast<float>(k.cx),
            static_cast<float>(k.cy),
            static_cast<float>(k.fx),
            static_cast<float>(k.fy),
            RS2_DISTORTION_NONE,
            {}};
  }
};
class stream_profile {
 public:
  template <class T>
  [[nodiscard]] T as() const {
    return {};
  }
};
class depth_sensor {
 public:
  [[nodiscard]] float get_depth_scale() const { return 0.001F; }
};
class device {
 public:
  template <class T>
  [[nodiscard]] T first() const {
    return {};
  }
};
class pipeline_profile {
 public:
  [[nodiscard]] stream_profile get_stream(rs2_stream) const { return {}; }
  [[nodiscard]] device get_device() const { return {}; }
};

class video_frame {
 public:
  video_frame(const void* data, int width, int height, int pixel, double time)
      : data_{data}, width_{width}, height_{height}, pixel_{pixel}, time_{time} {}
  operator bool() const { return data_ != nullptr; }  // NOLINT(google-explicit-constructor)
  [[nodiscard]] const void* get_data() const { return data_; }
  [[nodiscard]] int get_width() const { return width_; }
  [[nodiscard]] int get_height() const { return height_; }
  [[nodiscard]] int get_stride_in_bytes() const { return width_ * pixel_; }
  [[nodiscard]] double get_timestamp() const { return time_; }  // milliseconds

 private:
  const void* data_;
  int width_, height_, pixel_;
  double time_;
};
class depth_frame : public video_frame {
 public:
  using video_frame::video_frame;
};
class frameset {
 public:
  [[nodiscard]] video_frame get_color_frame() const {
    return {frame.color.data(), frame.color.width(), frame.color.height(), 3, 1e3 * frame.timestamp};
  }
  [[nodiscard]] depth_frame get_depth_frame() const {
    return {frame.depth.data(), frame.depth.width(), frame.depth.height(), 2, 1e3 * frame.timestamp};
  }
  orbis::camera::rgbd_frame frame;  ///< of the stub
};
class pipeline {
 public:
  pipeline_profile start(const config&) { return {}; }
  bool try_wait_for_frames(frameset* frames, unsigned int = 15000) const {
    if (next_ == stubs::camera().size()) return false;
    frames->frame = stubs::camera().frame(next_++).value();
    return true;
  }

 private:
  mutable std::size_t next_ = 0;
};
class align {
 public:
  explicit align(rs2_stream) {}
  [[nodiscard]] frameset process(frameset frames) { return frames; }
};

}  // namespace rs2

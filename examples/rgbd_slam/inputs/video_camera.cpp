// SPDX-License-Identifier: BSD-3-Clause
//
// Part of the video module; see video_module.hpp.
#include <algorithm>
#include <utility>

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/videoio.hpp>

#include "inputs/camera_device.hpp"
#include "inputs/file_recording.hpp"
#include "inputs/opencv_image.hpp"
#include "inputs/video_module.hpp"

namespace app {
namespace {

using orbis::errc;
using orbis::fail;
using orbis::result;

class video_camera final : public camera_device {
 public:
  explicit video_camera(cv::VideoCapture reader) : reader_{std::move(reader)} {}
  /// Ignores the time limit, because V4L2 itself waits at most ten seconds for a frame.
  result<std::optional<source_frame>> next(std::chrono::milliseconds) override {
    if (!reader_.grab()) return fail(errc::unreadable, name, "no longer delivers images; it may be disconnected");
    const double time = opened_at_ + seconds_now<std::chrono::steady_clock>() - opened_;
    cv::Mat image;
    if (!reader_.retrieve(image)) return std::optional<source_frame>{};  // damaged in transfer
    auto converted = to_rgb(image, name);
    if (!converted) return fail(converted.error());
    if (auto fits = check_camera(camera, sensor, converted->width(), converted->height(), name); !fits)
      return fail(fits.error());
    if (sensor == orbis::slam::sensor_kind::stereo) return std::optional{side_by_side(time, *converted)};
    source_frame f;
    f.timestamp = time;
    f.color = *std::move(converted);
    return std::optional{std::move(f)};
  }

 private:
  template <class Clock>
  [[nodiscard]] static double seconds_now() {
    return std::chrono::duration<double>{Clock::now().time_since_epoch()}.count();
  }

  cv::VideoCapture reader_;
  // The time of day at the start, to which the steady clock is added, because the system clock may be set.
  double opened_at_ = seconds_now<std::chrono::system_clock>(), opened_ = seconds_now<std::chrono::steady_clock>();
};

result<std::unique_ptr<camera_device>> make_video_camera(const device_options& options) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);  // errors are reported here
  const std::string name = options.name.empty() ? "/dev/video0" : options.name;
  if (options.sensor == orbis::slam::sensor_kind::rgbd)
    return fail(errc::unsupported, name, "video cameras have no depth");
  if (!options.camera)
    return fail(errc::invalid_argument, name, "unknown camera: specify it with --camera camera.toml");
  const bool is_number = name.find_first_not_of("0123456789") == std::string::npos && name.size() < 4;
  cv::VideoCapture reader;
  const bool opened = is_number ? reader.open(std::stoi(name), cv::CAP_V4L2) : reader.open(name, cv::CAP_V4L2);
  if (!opened) return fail(errc::not_found, name, "cannot be opened as a video camera");
  const auto& k = options.camera->model.k();
  reader.set(cv::CAP_PROP_FRAME_WIDTH, options.sensor == orbis::slam::sensor_kind::stereo ? 2 * k.width : k.width);
  reader.set(cv::CAP_PROP_FRAME_HEIGHT, k.height);
  reader.set(cv::CAP_PROP_FPS, options.camera->fps);
  reader.set(cv::CAP_PROP_BUFFERSIZE, 1);
  auto device = std::make_unique<video_camera>(std::move(reader));
  device->name = name;
  device->sensor = options.sensor.value_or(orbis::slam::sensor_kind::monocular);
  device->camera = *options.camera;
  return device;
}

}  // namespace
}  // namespace app

void rgbd_slam_open_video_camera(const app::device_options& options,
                                 orbis::result<std::unique_ptr<app::camera_device>>& opened) {
  opened = app::make_video_camera(options);
}

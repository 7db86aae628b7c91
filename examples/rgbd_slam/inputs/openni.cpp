// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/camera_device.hpp"
#include "inputs/frame_pairs.hpp"

#ifdef RGBD_SLAM_OPENNI
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include <OpenNI.h>

#include <orbis/core/trajectory.hpp>

namespace app {
namespace {

using orbis::errc;
using orbis::fail;
using orbis::result;

/// The first line of the library's error message.
std::string reason() {
  const std::string text = openni::OpenNI::getExtendedError();
  const std::size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
  return text.substr(begin, text.find('\n', begin) - begin);
}

/// The widest mode of a stream with this pixel format that is not wider than `width`, at the highest frame rate.
std::optional<openni::VideoMode> find_mode(const openni::SensorInfo& info, openni::PixelFormat format, int width) {
  std::optional<openni::VideoMode> best;
  const auto& modes = info.getSupportedVideoModes();
  for (int i = 0; i != modes.getSize(); ++i) {
    const auto& m = modes[i];
    if (m.getPixelFormat() != format || m.getResolutionX() > width) continue;
    if (!best || std::pair{m.getResolutionX(), m.getFps()} > std::pair{best->getResolutionX(), best->getFps()})
      best = m;
  }
  return best;
}

double seconds(const openni::VideoFrameRef& f) { return 1e-6 * static_cast<double>(f.getTimestamp()); }

class openni_camera final : public camera_device {
 public:
  // The thread of a stream sleeps for the duration of a frame. Some drivers, such as that of the dummy device, do not
  // wait until the thread has ended, but the data of the stream must exist until then. OpenNI2 itself is not shut down,
  // because that would unload the drivers.
  ~openni_camera() override {
    pairs_.clear();
    for (openni::VideoStream* s : {&depth_, &color_})
      if (s->isValid()) s->stop();
    if (is_started_) std::this_thread::sleep_for(std::chrono::duration<double>(std::max(0.1, 2.0 * interval_)));
    for (openni::VideoStream* s : {&depth_, &color_}) s->destroy();
    device_.close();
  }

  result<void> open(const device_options& options) {
    name = options.name.empty() ? "OpenNI2" : options.name;
    std::error_code ignored;
    if (std::filesystem::is_fifo(options.name, ignored)) return fail(errc::unreadable, name, "is not a regular file");
    if (openni::OpenNI::initialize() != openni::STATUS_OK) return fail(errc::unreadable, name, reason());
    if (device_.open(options.name.empty() ? openni::ANY_DEVICE : options.name.c_str()) != openni::STATUS_OK)
      return fail(errc::not_found, name, "no depth camera is connected (" + reason() + ")");
    if (options.name.empty()) name = device_.getDeviceInfo().getName();
    const int width = options.camera ? options.camera->model.width() : 640;
    if (auto ok = start(color_, openni::SENSOR_COLOR, openni::PIXEL_FORMAT_RGB888, width, "colour"); !ok) return ok;
    const auto mode = color_.getVideoMode();
    if (auto ok = start(depth_, openni::SENSOR_DEPTH, openni::PIXEL_FORMAT_DEPTH_1_MM, mode.getResolutionX(), "depth");
        !ok)
      return ok;
    if (depth_.getVideoMode().getResolutionX() != mode.getResolutionX() ||
        depth_.getVideoMode().getResolutionY() != mode.getResolutionY())
      return fail(errc::unsupported, name, "has no depth images with the size of its colour images");
    if (device_.isFile()) {
      device_.getPlaybackControl()->setRepeatEnabled(false);
      last_ = std::min(device_.getPlaybackControl()->getNumberOfFrames(color_),
                       device_.getPlaybackControl()->getNumberOfFrames(depth_));
    } else if (device_.isImageRegistrationModeSupported(openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR)) {
      device_.setImageRegistrationMode(openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR);
    } else {
      notes.emplace_back("the camera does not register depth to colour: colours may be slightly shifted");
    }
    device_.setDepthColorSyncEnabled(true);
    pairs_ = frame_pairs<openni::VideoFrameRef>{interval_};
    return choose_camera(options, mode);
  }

  result<std::optional<source_frame>> next(std::chrono::milliseconds patience) override {
    openni::VideoStream* streams[] = {&color_, &depth_};
    int ready = 0;
    const auto status = openni::OpenNI::waitForAnyStream(streams, 2, &ready, static_cast<int>(patience.count()));
    if (status == openni::STATUS_TIME_OUT) {
      if (last_ && newest_index_ >= *last_) return fail(errc::no_data, name, "end of recording");
      return std::optional<source_frame>{};
    }
    if (status != openni::STATUS_OK)
      return fail(errc::unreadable, name, "no longer delivers frames (" + reason() + ")");
    openni::VideoFrameRef frame;
    if (streams[ready]->readFrame(&frame) != openni::STATUS_OK || !frame.isValid())
      return fail(errc::unreadable, name, "was disconnected (" + reason() + ")");
    newest_index_ = std::max(newest_index_, frame.getFrameIndex());
    const double time = seconds(frame);
    auto both = pairs_.add(ready == 0 ? stream::color : stream::depth, std::move(frame), time);
    if (!both) return std::optional<source_frame>{};
    return make_frame(*both);
  }

 private:
  result<void> start(openni::VideoStream& stream, openni::SensorType type, openni::PixelFormat format, int width,
                     const std::string& what) {
    const openni::SensorInfo* info = device_.getSensorInfo(type);
    const auto mode = info != nullptr ? find_mode(*info, format, width) : std::nullopt;
    if (!mode) return fail(errc::unsupported, name, "has no " + what + " images in a supported format");
    if (stream.create(device_, type) != openni::STATUS_OK) return fail(errc::unreadable, name, reason());
    if (!device_.isFile()) stream.setVideoMode(*mode);
    stream.setMirroringEnabled(false);  // on by default
    if (stream.start() != openni::STATUS_OK) return fail(errc::unreadable, name, reason());
    is_started_ = true;
    interval_ = std::max(interval_, 1.0 / std::max(1, stream.getVideoMode().getFps()));
    return {};
  }

  /// Uses the camera in the options, or a pinhole camera with the device's field of view.
  result<void> choose_camera(const device_options& options, const openni::VideoMode& mode) {
    const int width = mode.getResolutionX(), height = mode.getResolutionY();
    if (options.camera) {
      camera = *options.camera;
      camera.depth_scale = 1000.0;
      if (camera.model.width() == width && camera.model.height() == height) return {};
      return fail(errc::invalid_argument, name,
                  "has images of " + std::to_string(width) + "x" + std::to_string(height) +
                      " pixels, but the camera has " + std::to_string(camera.model.width()) + "x" +
                      std::to_string(camera.model.height()));
    }
    const double angle = color_.getHorizontalFieldOfView();
    const bool is_known = std::isfinite(angle) && angle > 0.2 && angle < 2.5;
    const double f = is_known ? 0.5 * width / std::tan(0.5 * angle) : 525.0 * width / 640.0;
    notes.emplace_back(is_known
                           ? "the camera is not calibrated: its focal length is computed from the field of view "
                             "(specify it with --camera)"
                           : "the camera is not calibrated: the intrinsics of a Kinect are assumed (specify them with "
                             "--camera)");
    camera = {.model = orbis::camera::pinhole{width, height, f, f, 0.5 * (width - 1), 0.5 * (height - 1)},
              .depth_scale = 1000.0,
              .fps = static_cast<double>(std::max(1, mode.getFps()))};
    return {};
  }

  [[nodiscard]] result<std::optional<source_frame>> make_frame(
      const frame_pairs<openni::VideoFrameRef>::pair& both) const {
    const int width = camera.model.width(), height = camera.model.height();
    for (const auto* f : {&both.color, &both.depth})
      if (f->getWidth() != width || f->getHeight() != height)
        return fail(errc::malformed, name, "changed the size of its images");
    source_frame out;
    out.timestamp = seconds(both.color);
    out.depth_timestamp = seconds(both.depth);
    out.depth_scale = camera.depth_scale;
    out.color = orbis::image<orbis::rgb8>(width, height);
    out.depth = orbis::image<std::uint16_t>(width, height);
    const auto copy = [&](const openni::VideoFrameRef& from, auto& to, std::size_t bytes) {
      const auto* row = static_cast<const char*>(from.getData());
      for (int y = 0; y != height; ++y, row += from.getStrideInBytes())
        std::memcpy(&to(0, y), row, static_cast<std::size_t>(width) * bytes);
    };
    static_assert(sizeof(orbis::rgb8) == 3);
    copy(both.color, out.color, 3);
    copy(both.depth, out.depth, 2);
    return std::optional{std::move(out)};
  }

  openni::Device device_;
  openni::VideoStream color_, depth_;
  frame_pairs<openni::VideoFrameRef> pairs_;
  std::optional<int> last_;  // number of frames in a file
  int newest_index_ = 0;
  bool is_started_ = false;  // at least one stream is started
  double interval_ = 0.0;    // time between frames of the slower stream, seconds
};

}  // namespace

bool has_openni() { return true; }

result<std::unique_ptr<camera_device>> open_openni(const device_options& options) {
  if (options.sensor && *options.sensor != orbis::slam::sensor_kind::rgbd)
    return fail(errc::unsupported, options.name.empty() ? "OpenNI2" : options.name, "is a depth camera");
  auto device = std::make_unique<openni_camera>();
  if (auto opened = device->open(options); !opened) return fail(opened.error());
  return device;
}

}  // namespace app

#else

namespace app {

bool has_openni() { return false; }

orbis::result<std::unique_ptr<camera_device>> open_openni(const device_options& options) {
  return orbis::fail(orbis::errc::unsupported, options.name.empty() ? "OpenNI2" : options.name,
                     "this build has no support for depth cameras: it was built without OpenNI2 (libopenni2-dev)");
}

}  // namespace app

#endif

// SPDX-License-Identifier: BSD-3-Clause
//
// Part of the video module; see video_module.hpp.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <utility>

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/videoio.hpp>

#include <orbis/io/camera_file.hpp>

#include "inputs/file_recording.hpp"
#include "inputs/opencv_image.hpp"
#include "inputs/video_module.hpp"

namespace app {
namespace {

using orbis::errc;
using orbis::fail;
using orbis::result;

class video_recording final : public file_recording {
 public:
  video_recording(std::filesystem::path path, cv::VideoCapture reader, std::vector<double> times)
      : path_{std::move(path)}, reader_{std::move(reader)}, times_{std::move(times)} {
    kind = "video";
    files = {path_};
  }
  [[nodiscard]] std::size_t size() const override { return times_.size(); }
  [[nodiscard]] result<source_frame> frame(std::size_t i) const override {
    auto image = read(i);
    if (!image) return fail(image.error());
    if (sensor == orbis::slam::sensor_kind::stereo) return side_by_side(times_[i], *image);
    source_frame f;
    f.timestamp = times_[i];
    f.color = *std::move(image);
    return f;
  }
  [[nodiscard]] result<orbis::image<orbis::rgb8>> color(std::size_t i) const override {
    auto f = frame(i);
    if (!f) return fail(f.error());
    return std::move(f->color);
  }

 private:
  /// Reads a frame. Few containers support exact seeking, so the file is read forwards, and again from the beginning
  /// for an earlier frame.
  [[nodiscard]] result<orbis::image<orbis::rgb8>> read(std::size_t i) const {
    const std::lock_guard lock{mutex_};
    if (i < next_) {
      reader_.open(path_.string());
      next_ = 0;
    }
    while (next_ <= i) {
      if (!reader_.grab())
        return fail(errc::unreadable, path_.string(), "frame " + std::to_string(next_) + " cannot be read");
      ++next_;
    }
    cv::Mat image;
    if (!reader_.retrieve(image))
      return fail(errc::malformed, path_.string(), "frame " + std::to_string(i) + " cannot be decoded");
    auto converted = to_rgb(image, path_.string());
    if (!converted) return converted;
    if (auto fits = check_camera(camera, sensor, converted->width(), converted->height(), path_.string()); !fits)
      return fail(fits.error());
    return converted;
  }

  std::filesystem::path path_;
  mutable std::mutex mutex_;
  mutable cv::VideoCapture reader_;
  mutable std::size_t next_ = 0;
  std::vector<double> times_;
};

/// The time of each frame, seconds.
std::vector<double> times_in(cv::VideoCapture& reader, std::vector<std::string>& notes) {
  const double fps = reader.get(cv::CAP_PROP_FPS), declared = reader.get(cv::CAP_PROP_FRAME_COUNT);
  const double rate = std::isfinite(fps) && fps > 0.0 ? fps : 30.0;
  std::vector<double> times;
  while (reader.grab()) times.push_back(0.001 * reader.get(cv::CAP_PROP_POS_MSEC));
  const bool ascends =
      std::adjacent_find(times.begin(), times.end(), [](double a, double b) { return !(a < b); }) == times.end();
  if (!ascends) {
    for (std::size_t i = 0; i != times.size(); ++i) times[i] = static_cast<double>(i) / rate;
    notes.push_back("the container's timestamps do not ascend: a rate of " + std::to_string(rate) +
                    " images per second is assumed");
  }
  // Compares durations, because containers without a number of frames have an estimate from the duration.
  const double duration = declared / rate, present = times.empty() ? 0.0 : times.back() + 1.0 / rate;
  if (std::isfinite(duration) && present < 0.99 * duration - 1.5 / rate) {
    char text[160];
    std::snprintf(
        text, sizeof text,
        "the video is truncated or damaged: it has %.2f s of images, but declares %.2f s; times after damaged "
        "images may be wrong",
        present, duration);
    notes.emplace_back(text);
  }
  return times;
}

result<std::unique_ptr<file_recording>> read_video(const std::filesystem::path& path,
                                                   const file_recording_options& options) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);  // errors are reported here
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return fail(errc::not_found, path.string(), "no such file");
  if (options.sensor == orbis::slam::sensor_kind::rgbd)
    return fail(errc::unsupported, path.string(), "videos have no depth");
  auto camera = options.camera;
  std::optional<std::filesystem::path> camera_file;
  if (const auto beside = path.parent_path() / "camera.toml"; !camera && std::filesystem::exists(beside, ignored)) {
    auto read = orbis::io::read_camera(beside);
    if (!read) return fail(read.error());
    camera = *std::move(read);
    camera_file = beside;
  }
  cv::VideoCapture reader{path.string()};
  if (!reader.isOpened())
    return fail(errc::unsupported, path.string(), "is not a folder, a bag, or a video that OpenCV can read");
  if (!camera)
    return fail(errc::invalid_argument, path.string(),
                "unknown camera: put a camera.toml next to the video, or specify a camera");
  std::vector<std::string> notes;
  auto times = times_in(reader, notes);
  if (times.empty()) return fail(errc::no_data, path.string(), "the video contains no images");
  reader.open(path.string());
  auto video = std::make_unique<video_recording>(path, std::move(reader), std::move(times));
  video->sensor = options.sensor.value_or(orbis::slam::sensor_kind::monocular);
  video->camera = *std::move(camera);
  video->notes = std::move(notes);
  if (camera_file) video->files.push_back(*camera_file);
  if (auto first = video->color(0); !first) return fail(first.error());
  return video;
}

}  // namespace
}  // namespace app

void rgbd_slam_open_video(const std::filesystem::path& path, const app::file_recording_options& options,
                          orbis::result<std::unique_ptr<app::file_recording>>& opened) {
  opened = app::read_video(path, options);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <thread>
#include <utility>

#include <orbis/io/mono_recording.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/stereo_recording.hpp>

#include "inputs/camera_device.hpp"

namespace app {
namespace {

using orbis::errc;
using orbis::fail;
using orbis::result;

/// Plays `size` frames; `read(i)` returns frame `i`.
template <class Recording, class Read>
class playback final : public camera_device {
  using clock = std::chrono::steady_clock;

 public:
  playback(Recording recording, Read read, std::string from)
      : recording_{std::move(recording)}, read_{std::move(read)} {
    name = std::move(from);
    camera = recording_.camera();
    files = recording_.files();
  }
  result<std::optional<source_frame>> next(std::chrono::milliseconds patience) override {
    if (at_ == recording_.size()) return fail(errc::no_data, name, "end of recording");
    if (at_ == 0) begin_ = clock::now();
    constexpr double longest = 1e6;  // seconds; the clock cannot represent arbitrary durations
    const std::chrono::duration<double> after{std::min(recording_.timestamp(at_) - recording_.timestamp(0), longest)};
    const auto due = begin_ + std::chrono::duration_cast<clock::duration>(after);
    const auto give_up = clock::now() + patience;
    std::this_thread::sleep_until(std::min(due, give_up));
    if (due > give_up) return std::optional<source_frame>{};
    auto frame = read_(recording_, at_++);
    if (!frame) return fail(frame.error());
    return std::optional<source_frame>{*std::move(frame)};
  }

 private:
  Recording recording_;
  Read read_;
  std::size_t at_ = 0;
  clock::time_point begin_{};
};

}  // namespace

result<std::unique_ptr<camera_device>> open_playback(const device_options& options) {
  const auto play = [&](auto recording, orbis::slam::sensor_kind sensor, auto read) -> std::unique_ptr<camera_device> {
    auto device =
        std::make_unique<playback<decltype(recording), decltype(read)>>(std::move(recording), read, options.name);
    device->sensor = sensor;
    return device;
  };
  if (options.sensor == orbis::slam::sensor_kind::stereo) {
    auto recording = orbis::io::open_stereo_recording(options.name, {.camera = options.camera});
    if (!recording) return fail(recording.error());
    return play(*std::move(recording), orbis::slam::sensor_kind::stereo,
                [](const auto& r, std::size_t i) -> result<source_frame> {
                  auto pair = r.frame(i);
                  if (!pair) return fail(pair.error());
                  source_frame f;
                  f.timestamp = pair->timestamp;
                  f.color = std::move(pair->left);
                  f.right = std::move(pair->right);
                  return f;
                });
  }
  if (options.sensor == orbis::slam::sensor_kind::monocular) {
    auto recording = orbis::io::open_mono_recording(options.name, {.camera = options.camera});
    if (!recording) return fail(recording.error());
    return play(*std::move(recording), orbis::slam::sensor_kind::monocular,
                [](const auto& r, std::size_t i) -> result<source_frame> {
                  auto image = r.color(i);
                  if (!image) return fail(image.error());
                  source_frame f;
                  f.timestamp = r.timestamp(i);
                  f.color = *std::move(image);
                  return f;
                });
  }
  auto recording = orbis::io::open_recording(options.name, {.camera = options.camera});
  if (!recording) return fail(recording.error());
  return play(*std::move(recording), orbis::slam::sensor_kind::rgbd,
              [](const auto& r, std::size_t i) -> result<source_frame> {
                auto frame = r.frame(i);
                if (!frame) return fail(frame.error());
                frame->T_world_camera.reset();  // a live camera provides no poses
                return source_frame{*std::move(frame), {}};
              });
}

}  // namespace app

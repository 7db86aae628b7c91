// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recordings in one file, read by libraries that not every build has: videos (OpenCV's videoio) and ROS 1 bags
/// (rosbag_storage).
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <orbis/camera/settings.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

#include "source.hpp"

namespace app {

/// A list of frames that are read when asked for. Thread-safe; reading forwards costs least.
class file_recording {
 public:
  virtual ~file_recording() = default;
  [[nodiscard]] virtual std::size_t size() const = 0;
  /// Errors: unreadable, malformed. @pre i < size()
  [[nodiscard]] virtual orbis::result<source_frame> frame(std::size_t i) const = 0;
  /// The image of frame `i`, the left one of two. As above.
  [[nodiscard]] virtual orbis::result<orbis::image<orbis::rgb8>> color(std::size_t i) const = 0;

  orbis::slam::sensor_kind sensor = orbis::slam::sensor_kind::monocular;
  std::string kind;       ///< "video", "ROS bag"
  std::string images_of;  ///< what of the file they come from: the topics of a bag; empty: it holds nothing else
  orbis::camera::camera_settings camera;
  std::vector<std::string> notes;            ///< worth a warning
  std::vector<std::filesystem::path> files;  ///< that it is read from
};

struct file_recording_options {
  std::optional<orbis::slam::sensor_kind> sensor{};        ///< empty: as the file suggests
  std::optional<orbis::camera::camera_settings> camera{};  ///< instead of what the file says
  std::vector<std::string> topics{};                       ///< of a bag; empty: they are found
};

/// Whether this build reads them.
[[nodiscard]] bool has_videos();
[[nodiscard]] bool has_bags();

/// A video: images of one camera, or, with `sensor` stereo, the left and the right image of a rectified pair side by
/// side. Times are the container's. The camera is that of the options, or of `camera.toml` beside the file. Goes
/// through the file once. Errors: unsupported (this build reads no videos, or not this one), not_found, no_data,
/// malformed (images of another size than the camera's), invalid_argument (no camera, no baseline).
[[nodiscard]] orbis::result<std::unique_ptr<file_recording>> open_video(const std::filesystem::path& path,
                                                                        const file_recording_options& options);

/// A ROS 1 bag with `sensor_msgs/Image` or `sensor_msgs/CompressedImage`, and `sensor_msgs/CameraInfo`: colour and
/// depth that is registered to it (16UC1 in millimetres, 32FC1 in metres), the images of a stereo camera, or one
/// camera's. See ros_images.hpp for the encodings. Goes through the bag once, for the times in its messages. Errors: as
/// above, and invalid_argument (topics that are not there; the message names those that are).
[[nodiscard]] orbis::result<std::unique_ptr<file_recording>> open_bag(const std::filesystem::path& path,
                                                                      const file_recording_options& options);

/// The left and the right half of an image. @pre its width is even
[[nodiscard]] source_frame side_by_side(double timestamp, const orbis::image<orbis::rgb8>& both);

/// Whether a camera's settings do for a sensor; where not, why. `width`, `height`: of an image (both, if two stand side
/// by side).
[[nodiscard]] orbis::result<void> check_camera(const orbis::camera::camera_settings& camera,
                                               orbis::slam::sensor_kind sensor, int width, int height,
                                               const std::string& where);

}  // namespace app

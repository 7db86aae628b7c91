// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Videos (read with OpenCV's videoio, if this build includes it) and ROS bags.
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
#include <orbis/core/trajectory.hpp>

#include "source.hpp"

namespace app {

/// A list of frames that are read on request. Thread-safe; sequential reading is fastest.
class file_recording {
 public:
  virtual ~file_recording() = default;
  [[nodiscard]] virtual std::size_t size() const = 0;
  /// Reads frame `i`. Errors: unreadable, malformed. @pre i < size()
  [[nodiscard]] virtual orbis::result<source_frame> frame(std::size_t i) const = 0;
  /// The image of frame `i`; for a stereo pair, the left image. Errors: those of `frame`. @pre i < size()
  [[nodiscard]] virtual orbis::result<orbis::image<orbis::rgb8>> color(std::size_t i) const = 0;

  orbis::slam::sensor_kind sensor = orbis::slam::sensor_kind::monocular;
  std::string kind;       ///< "video", "ROS bag"
  std::string images_of;  ///< topics of a bag from which the images are read; empty for videos
  orbis::camera::camera_settings camera;
  orbis::trajectory ground_truth;            ///< empty if unknown
  std::string truth_of;                      ///< the topic and the frames of the ground truth
  std::vector<std::string> notes;            ///< warnings
  std::vector<std::filesystem::path> files;  ///< input files
};

struct file_recording_options {
  std::optional<orbis::slam::sensor_kind> sensor{};        ///< empty: determined by the file
  std::optional<orbis::camera::camera_settings> camera{};  ///< replaces the file's calibration
  std::vector<std::string> topics{};                       ///< image topics of a bag; empty: automatic
  std::string truth_topic{};                               ///< pose topic of a bag; empty: no ground truth
};

/// Returns true if this build can read videos.
[[nodiscard]] bool has_videos();

/// Opens a video: images of one camera or, if `sensor` is stereo, the left and the right image of a rectified pair side
/// by side. Times are those in the container. The camera is the one in the options or in `camera.toml` next to the
/// file. Reads the whole file once. Errors: unsupported (this build cannot read videos, or not this format), not_found,
/// no_data, malformed (image size different from the camera's), invalid_argument (no camera, no baseline).
[[nodiscard]] orbis::result<std::unique_ptr<file_recording>> open_video(const std::filesystem::path& path,
                                                                        const file_recording_options& options);

/// Opens a bag of ROS 1 or ROS 2 (see bag_file.hpp) with `sensor_msgs/Image` or `sensor_msgs/CompressedImage`, and
/// `sensor_msgs/CameraInfo`: colour and depth (16UC1 in millimetres, 32FC1 in metres), the images of a stereo camera,
/// or of one camera. See ros_images.hpp for the encodings. Depth in a coordinate frame other than that of colour is
/// registered by means of both cameras and the transform between them. The ground truth comes from poses
/// (`PoseStamped`, `PoseWithCovarianceStamped`, `Odometry`) or from `/tf`. Reads the whole bag once, for the times of
/// its messages. Errors: those of `open_video`, and invalid_argument (missing topics; the message lists the existing
/// ones).
[[nodiscard]] orbis::result<std::unique_ptr<file_recording>> open_bag(const std::filesystem::path& path,
                                                                      const file_recording_options& options);

/// Splits an image into its left and right halves. @pre its width is even
[[nodiscard]] source_frame side_by_side(double timestamp, const orbis::image<orbis::rgb8>& both);

/// Checks that a camera's settings match a sensor. `width`, `height`: size of an image, or of two images side by side.
[[nodiscard]] orbis::result<void> check_camera(const orbis::camera::camera_settings& camera,
                                               orbis::slam::sensor_kind sensor, int width, int height,
                                               const std::string& where);

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sources of frames: a recording on disk, a synthetic recording, or a live camera.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <future>
#include <string>
#include <vector>

#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/slam/frame.hpp>

#include "background.hpp"
#include "console.hpp"
#include "settings.hpp"

namespace app {

/// A frame of an RGB-D, stereo or monocular camera. For a stereo camera, `color` is the left image; `depth` is empty
/// and `depth_scale` is meaningless until `frame_source::complete` computes them. A monocular frame never has depth.
struct source_frame : orbis::camera::rgbd_frame {
  orbis::image<orbis::rgb8> right;  ///< empty unless the sensor is a stereo camera
};

struct frame_source {
  std::string title, kind;
  std::string images_of;  ///< topics of a bag, or folders, from which the images are read; empty for other sources
  orbis::camera::camera_settings camera;
  bool camera_is_refined = false;                 ///< the camera was calibrated with the recording
  double usual_max_depth = app::usual_max_depth;  ///< default maximum depth in a map, metres
  /// The maximum depth of the measurements in the map, metres.
  [[nodiscard]] double depth_limit(const settings& s) const { return s.depth_limit(usual_max_depth); }
  std::optional<double> median_depth;  ///< median depth in one of the first frames of a recording with depth, metres
  orbis::slam::sensor_kind sensor = orbis::slam::sensor_kind::rgbd;
  [[nodiscard]] bool is_stereo() const { return sensor == orbis::slam::sensor_kind::stereo; }
  /// Returns true for one camera without depth: lengths are then in arbitrary units, and there is no dense map.
  [[nodiscard]] bool is_monocular() const { return sensor == orbis::slam::sensor_kind::monocular; }
  bool is_live = false;    ///< a live camera: delivers each frame once, in order, regardless of the requested index
  std::size_t frames = 0;  ///< number of frames; for a live camera, the maximum number
  /// The number of frames of a live camera that were dropped because tracking was busy; empty for recordings.
  std::function<std::size_t()> dropped;
  /// Reads or renders a frame, given its index after applying `--stride`. May be called from several threads at once,
  /// except for a live camera.
  std::function<orbis::result<source_frame>(std::size_t)> frame;
  /// Computes the depth image of a stereo frame, which takes a long time. Has no effect on other frames.
  void complete(source_frame& f) const;
  /// Reads or renders only the colour image of a frame; otherwise like `frame`.
  std::function<orbis::result<orbis::image<orbis::rgb8>>(std::size_t)> color;
  bool made = false;  ///< frames are rendered or live: storing them is cheaper than requesting them again
  /// Frees memory that is used to produce frames; the next request allocates it again. May be empty.
  std::function<void()> rest;
  orbis::vec3 origin = orbis::vec3::Zero();  ///< subtracted from all positions, metres
  orbis::trajectory ground_truth;            ///< empty if unknown
  std::string truth_of;                      ///< topic and frames of a bag's ground truth; empty for other sources
  /// The ground truth has no orientations, so that it neither defines a world frame nor provides poses for depth
  /// images.
  bool truth_has_positions_only = false;
  std::vector<std::filesystem::path> files;  ///< input files
  std::vector<std::string> notes;            ///< warnings
  /// Distance (metres) of a point in the ground truth's world frame from the true surface; empty if unknown.
  std::function<double(const orbis::vec3&)> surface_distance;
};

/// The warning that an origin is subtracted.
[[nodiscard]] std::string origin_note(const orbis::vec3& origin);

/// Returns true if a file begins with text: printable characters without a zero byte.
[[nodiscard]] bool is_text(const std::filesystem::path& path);

/// Returns true if `open_source` recognises the layout of a folder or a bag. False for videos and for plain folders of
/// images.
[[nodiscard]] bool is_recording(const std::filesystem::path& path);

/// Opens the recording specified in the settings and prints a description.
[[nodiscard]] orbis::result<frame_source> open_source(const settings& s, console& console);

/// Reads the frames of a source in order, one frame in advance.
class read_ahead {
 public:
  read_ahead(const frame_source& source, bool in_background) : source_{source}, background_{in_background} {}
  /// The next frame. @pre has_next()
  [[nodiscard]] orbis::result<source_frame> next();
  [[nodiscard]] bool has_next() const { return at_ < source_.frames; }

 private:
  const frame_source& source_;
  bool background_;
  std::size_t at_ = 0;
  std::future<orbis::result<source_frame>> ahead_;
  background_thread thread_;  // uses the other members
};

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the frames come from: a recording on disk, a synthetic one, or a camera.
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

#include "console.hpp"
#include "settings.hpp"

namespace app {

/// A frame with depth, or the two images of a stereo camera: then `color` is the left one, and `depth` is empty, and
/// `depth_scale` of no meaning, until `frame_source::complete` makes it; or the image of one camera, which never has
/// depth.
struct source_frame : orbis::camera::rgbd_frame {
  orbis::image<orbis::rgb8> right;  ///< empty unless the sensor is a stereo camera
};

struct frame_source {
  std::string title, kind;
  std::string images_of;  ///< the topics of a bag; empty: there is nothing to choose from
  orbis::camera::camera_settings camera;
  bool camera_is_refined = false;                 ///< by the recording itself
  double usual_max_depth = app::usual_max_depth;  ///< of its depth that enters a map, metres
  /// Depth beyond this is left out of the map, metres.
  [[nodiscard]] double depth_limit(const settings& s) const { return s.depth_limit(usual_max_depth); }
  orbis::slam::sensor_kind sensor = orbis::slam::sensor_kind::rgbd;
  [[nodiscard]] bool is_stereo() const { return sensor == orbis::slam::sensor_kind::stereo; }
  /// One camera without depth: lengths are in a unit of their own, and there is no dense map.
  [[nodiscard]] bool is_monocular() const { return sensor == orbis::slam::sensor_kind::monocular; }
  bool is_live = false;    ///< a camera: frames come one after the other, whatever number is asked for, and only once
  std::size_t frames = 0;  ///< of a camera: at most so many
  /// Of a camera: how many frames were dropped so far, as nobody asked for them in time. Empty: none can be.
  std::function<std::size_t()> dropped;
  /// Reads or renders a frame; `--stride` is applied already. May be called from another thread.
  std::function<orbis::result<source_frame>(std::size_t)> frame;
  /// Makes the depth image of a frame that has none yet; costly for stereo, nothing otherwise.
  void complete(source_frame& f) const;
  /// Reads or renders the colour image of a frame alone. As above.
  std::function<orbis::result<orbis::image<orbis::rgb8>>(std::size_t)> color;
  bool made = false;  ///< frames are rendered or come from a camera: to keep them is cheaper than to ask once more
  /// Frees what the making of frames needs; it is there again when a frame is asked for. Empty: nothing is.
  std::function<void()> rest;
  orbis::vec3 origin = orbis::vec3::Zero();  ///< taken off all positions, metres
  orbis::trajectory ground_truth;            ///< empty if not known
  std::vector<std::filesystem::path> files;  ///< that it is read from
  std::vector<std::string> notes;            ///< worth a warning
  /// Metres from a point of the ground truth's world to the true surface; empty if not known.
  std::function<double(const orbis::vec3&)> surface_distance;
};

/// What a user is told about an origin that was taken off.
[[nodiscard]] std::string origin_note(const orbis::vec3& origin);

/// The recording that the settings name; says what it is.
[[nodiscard]] orbis::result<frame_source> open_source(const settings& s, console& console);

/// Reads the frames of a source in order, one ahead of who asks.
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
};

}  // namespace app

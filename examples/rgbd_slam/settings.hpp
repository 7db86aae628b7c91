// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the user asked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <orbis/core/types.hpp>

namespace app {

/// The documented exit codes, and the shell's own for a run that was interrupted.
enum exit_code : int {
  done = 0,
  bad_usage = 1,
  bad_input = 2,
  never_tracked = 3,
  no_path = 4,
  undetermined = 5,
  interrupted = 130
};

/// Of depth that enters a map, metres.
inline constexpr double usual_max_depth = 4.0;

enum class command { run, demo, eval, map, plan, calibrate, live };

struct settings {
  command what = command::run;

  std::filesystem::path input;      ///< recording, cloud, octree map (plan), estimated trajectory, or device (live)
  std::filesystem::path reference;  ///< ground truth (eval)
  std::filesystem::path out;        ///< where the files go
  std::filesystem::path config;     ///< file with options; empty: none
  std::string profile = "default";  ///< one of `profile_names`

  std::string sensor = "auto";  ///< "rgbd", "stereo" or "mono", or as the recording is
  std::string format = "auto";
  std::vector<std::string> topics;     ///< of a ROS bag: images, and their depth or the right ones; empty: found
  std::string camera;                  ///< file or preset; empty: as the recording says
  std::size_t frames = 0;              ///< at most so many; 0: all
  std::size_t stride = 1;              ///< every so many frames
  std::size_t width = 640;             ///< of the synthetic camera, pixels
  std::uint64_t seed = 1;              ///< of the synthetic recording
  bool plain = false;                  ///< of the synthetic recording: one round, no person, no stray depths
  bool person = false;                 ///< a person walks through the plain room, too
  std::optional<orbis::vec3> origin;   ///< of the rays to a cloud's points (map)
  std::optional<orbis::vec3> gravity;  ///< where it pulls, in the frame of the first camera

  std::optional<double> read_out_ms;     ///< of the camera's images, milliseconds; empty: as the camera's settings say,
                                         ///< or estimated
  bool refines_camera = true;            ///< where the recording does not fit it
  bool distortion = false;               ///< of the lens, is estimated where the camera has none (calibrate)
  double resolution = 0.05;              ///< octree, metres
  std::optional<double> max_depth;       ///< depth beyond this is left out of the map, metres; empty: as is usual
  std::string filter = "auto";           ///< one of `filter_names`
  std::optional<std::size_t> neighbors;  ///< empty: the filter's own number
  double sigma = 1.0;
  double radius = 0.05;  ///< of the radius filter, metres

  std::filesystem::path load_map;  ///< of landmarks, to begin with; empty: none
  std::filesystem::path save_map;  ///< of landmarks, in the end; empty: nowhere
  bool live_map = true;            ///< the octree grows while frames are tracked; otherwise it is made in the end
  std::size_t depth_memory = 16;   ///< for keyframes' depth images, MB; what is beyond goes to a file
  bool map_every_frame = false;    ///< into the live map, until it takes over the filter's verdict
  bool realtime = false;           ///< frames come at the pace of their time stamps
  bool localize_only = false;      ///< the loaded map stays as it is
  bool moving = true;              ///< what moves before the camera is looked for
  bool depth_term = true;          ///< depth joins in where poses are estimated

  double robot_radius = 0.2;         ///< metres
  double robot_height = 0.5;         ///< metres
  std::optional<double> robot_step;  ///< the highest that it drives up, metres (plan); empty: a voxel
  std::filesystem::path floor_map;   ///< .yaml for map servers; empty: nowhere
  bool on_floor = false;             ///< the robot drives (plan)
  bool stands = false;               ///< it is a cylinder of its height; otherwise a ball (plan)
  bool unknown_is_free = false;      ///< (plan)
  orbis::vec3 from = orbis::vec3::Zero(), to = orbis::vec3::Zero();  ///< metres (plan)
  std::filesystem::path picture;                                     ///< of the way (plan); empty: none

  std::string viewer;           ///< "window", "web"; empty: none
  unsigned viewer_port = 8090;  ///< of the page; 0: any that is free
  bool viewer_hold = false;     ///< stays open when all is written

  unsigned threads = 0;  ///< 0: all
  bool deterministic = false;
  bool quiet = false;
  bool json = false;
  bool with_scale = false;  ///< lengths of the estimate are in a unit of their own

  /// Depth beyond this is left out of the map, metres, if beyond `usual` is where nothing is asked for.
  [[nodiscard]] double depth_limit(double usual = usual_max_depth) const { return max_depth.value_or(usual); }
};

/// Whether a camera is named by its file rather than by its name.
[[nodiscard]] inline bool is_file_name(const std::string& camera) {
  return camera.find_first_of("./") != std::string::npos;
}

}  // namespace app

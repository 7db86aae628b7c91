// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The options of a run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>

namespace app {

/// The documented exit codes, and the shell's code for an interrupted run.
enum exit_code : int {
  done = 0,
  bad_usage = 1,
  run_failed = 1,  ///< at least one run of a benchmark failed
  bad_input = 2,
  never_tracked = 3,
  no_path = 4,
  undetermined = 5,
  interrupted = 130
};
/// The exit code of a command that fails because of an error.
[[nodiscard]] inline exit_code code_of(const orbis::error& e) {
  return e.code == orbis::errc::invalid_argument ? bad_usage : bad_input;
}

/// The default maximum depth of the measurements in a map, metres.
inline constexpr double usual_max_depth = 4.0;

enum class command { run, demo, eval, map, plan, calibrate, live, benchmark };

struct settings {
  command what = command::run;

  std::filesystem::path input;  ///< recording, cloud, octree map (plan), estimated trajectory, or device (live)
  std::vector<std::filesystem::path> inputs;  ///< recordings, or folders that contain recordings (benchmark)
  std::filesystem::path reference;            ///< ground truth (eval)
  std::filesystem::path out;                  ///< output folder or file
  std::filesystem::path config;               ///< file with options; empty: none
  std::filesystem::path run_config;           ///< file with options for the runs (benchmark); empty: none
  std::string profile = "default";            ///< one of `profile_names`

  std::string sensor = "auto";  ///< "rgbd", "stereo", "mono", or "auto": determined by the recording
  std::string format = "auto";
  std::vector<std::string>
      topics;               ///< image topics of a ROS bag: colour and depth, or left and right; empty: automatic
  std::string truth_topic;  ///< pose topic of a ROS bag; empty: no ground truth
  std::string camera;       ///< file or preset; empty: from the recording
  std::size_t frames = 0;   ///< maximum number of frames; 0: all
  std::size_t stride = 1;   ///< use every stride-th frame
  std::size_t width = 640;  ///< width of the synthetic images, pixels
  std::uint64_t seed = 1;   ///< seed of the synthetic recording
  bool plain = false;       ///< synthetic recording of one round, without a person and without stray depths
  bool person = false;      ///< adds a walking person to the plain room
  bool walk = false;        ///< the synthetic camera is on a walking robot in a dim room, and has a rolling shutter
  std::optional<orbis::vec3> origin;   ///< origin of the rays to a cloud's points, metres (map)
  std::optional<orbis::vec3> gravity;  ///< direction of gravity in the camera frame of the first image

  std::optional<double> read_out_ms;  ///< read-out time, milliseconds; empty: from the camera's settings, or estimated
  bool refines_camera = true;         ///< calibrate the camera if it contradicts the recording
  bool distortion = false;            ///< estimate lens distortion for a camera without distortion (calibrate)
  double resolution = 0.05;           ///< voxel size of the octree, metres
  std::optional<double> max_depth;    ///< maximum depth of measurements in the map, metres; empty: default
  std::string filter = "auto";        ///< one of `filter_names`
  std::optional<std::size_t> neighbors;  ///< number of neighbours; empty: the filter's default
  double sigma = 1.0;                    ///< limit of the statistical filter, standard deviations
  double radius = 0.05;                  ///< search radius of the radius filter, metres

  std::filesystem::path load_map;  ///< landmark map to start with; empty: none
  std::filesystem::path save_map;  ///< file for the landmark map; empty: none
  bool live_map = true;            ///< build the octree during tracking; otherwise at the end
  std::size_t depth_memory = 16;   ///< memory for depth images of keyframes, MB; images beyond it are written to a file
  bool map_every_frame = false;    ///< also insert frames between keyframes into the live map; the final map omits them
  bool realtime = false;           ///< play frames at the rate of their timestamps
  bool localize_only = false;      ///< do not change the loaded map
  bool moving = true;              ///< detect moving objects
  bool depth_term = true;          ///< use depth images for pose estimation

  double robot_radius = 0.2;         ///< metres
  double robot_height = 0.5;         ///< metres
  std::optional<double> robot_step;  ///< maximum height of a step, metres (plan); empty: voxel size
  std::filesystem::path floor_map;   ///< .yaml file of the floor map, for map servers; empty: none
  bool on_floor = false;             ///< the robot drives on the floor (plan)
  bool is_cylinder = false;          ///< the robot is an upright cylinder, otherwise a ball (plan)
  bool unknown_is_free = false;      ///< unknown space is free, otherwise an obstacle (plan)
  orbis::vec3 from = orbis::vec3::Zero(), to = orbis::vec3::Zero();  ///< start and goal, metres (plan)
  std::filesystem::path picture;                                     ///< picture of the path (plan); empty: none

  std::string viewer;           ///< "window", "web"; empty: none
  unsigned viewer_port = 8090;  ///< port of the page; 0: any free port
  bool viewer_hold = false;     ///< keep the viewer open after the run

  unsigned threads = 0;  ///< number of threads; 0: all cores
  bool deterministic = false;
  bool quiet = false;
  bool json = false;
  bool markdown = false;    ///< print tables as Markdown (benchmark)
  bool quick = false;       ///< deterministic runs only (benchmark)
  bool with_scale = false;  ///< also estimate the scale of the trajectory (eval)

  /// The maximum depth of the measurements in the map, metres; `usual` if the user specified none.
  [[nodiscard]] double depth_limit(double usual = usual_max_depth) const { return max_depth.value_or(usual); }
};

/// The error if `path` is a folder although a file is needed; names `usual` in it if there is such a file. Otherwise
/// empty.
[[nodiscard]] inline std::optional<orbis::error> needs_file(const std::filesystem::path& path, const char* usual) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return std::nullopt;
  const std::filesystem::path inside = path / usual;
  return orbis::error{
      orbis::errc::unreadable, path.string(),
      "is a directory" + (std::filesystem::exists(inside, ignored) ? "; did you mean " + inside.string() + "?" : "")};
}

/// Returns true if the name of a file is that of an octree map.
[[nodiscard]] inline bool is_octree_file(const std::filesystem::path& file) {
  return file.extension() == ".bt" || file.extension() == ".ot";
}

/// Returns true if a camera is given as a file, not as a preset.
[[nodiscard]] inline bool is_file_name(const std::string& camera) {
  return camera.find_first_of("./") != std::string::npos;
}

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include <orbis/camera/presets.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/io/toml.hpp>

#include "../common/program.hpp"
#include "../common/report_error.hpp"
#include "filters.hpp"
#include "inputs/camera_device.hpp"
#include "profiles.hpp"
#include "viewer/backend.hpp"

namespace app {
namespace {

exit_code report_error(const std::string& message, exit_code code) {
  examples::report_error("rgbd_slam", code, message);
  return code;
}

/// Accepts numbers within [low, high]; unlike CLI11's ranges, it rejects "nan".
template <class T>
CLI::Validator within(T low, T high, std::string unit = {}) {
  std::ostringstream text_of_range;
  text_of_range << low << " ... " << high << unit;
  return CLI::Validator(
      [low, high, range = text_of_range.str()](std::string& text) -> std::string {
        T value{};
        if (!CLI::detail::lexical_cast(text, value)) return orbis::in_quotes(text) + " is not a valid number";
        if (!(value >= low && value <= high)) return text + " is outside " + range;
        return {};
      },
      "");
}

CLI::Option* count(CLI::App& cmd, const std::string& name, std::size_t& value, const std::string& what,
                   std::size_t low = 1, std::size_t high = 100'000'000) {
  return cmd.add_option(name, value, what)->check(within<std::size_t>(low, high))->type_name("N");
}

/// A length within [low, high], in metres; `--help` shows its default.
CLI::Option* metres(CLI::App& cmd, const std::string& name, double& value, const std::string& what, double low,
                    double high) {
  return cmd.add_option(name, value, what)->check(within(low, high, " m"))->capture_default_str()->type_name("M");
}

std::string not_empty(const std::string& path) { return path.empty() ? "must not be empty" : ""; }

void add_map_options(CLI::App& cmd, settings& s) {
  cmd.add_option(
         "--profile", s.profile,
         "set of defaults; small: for boards with four small cores, such as the Raspberry Pi 4: fewer features, "
         "a smaller neighbourhood in mapping, --resolution 0.1, --depth-memory 8")
      ->check(CLI::IsMember(profile_names()))
      ->capture_default_str()
      ->type_name("P");
  cmd.add_option("--out", s.out, "output folder; created if missing")->required()->check(not_empty)->type_name("DIR");
  metres(cmd, "--resolution", s.resolution, "voxel size of the octree in metres", 0.001, 10.0);
  cmd.add_option(
         "--max-depth", s.max_depth,
         "maximum depth of measurements in the map, in metres (default: 4; for stereo cameras, 20 times the baseline "
         "if that is more)")
      ->check(within(0.1, 1000.0, " m"))
      ->type_name("M");
  cmd.add_option("--filter", s.filter, "outlier filter of the cloud; auto: chosen by an analysis of the cloud")
      ->check(CLI::IsMember(filter_names()))
      ->capture_default_str()
      ->type_name("MODE");
  cmd.add_option("--neighbors", s.neighbors, "number of neighbours for the filter (default: statistical 50, radius 5)")
      ->check(within<std::size_t>(1, 100'000))
      ->type_name("N");
  metres(cmd, "--radius", s.radius, "search radius of the radius filter in metres", 1e-6, 1000.0);
  cmd.add_option("--sigma", s.sigma, "statistical filter: limit in standard deviations above the mean")
      ->check(within(0.0, 1000.0))
      ->capture_default_str()
      ->type_name("A");
  count(cmd, "--depth-memory", s.depth_memory,
        "memory for the compressed depth images of keyframes, in MB, excluding the masks of removed pixels; images "
        "beyond it are written to an unnamed temporary file in the output folder",
        0, 1'000'000)
      ->capture_default_str();
  cmd.add_option("--threads", s.threads,
                 "number of threads for filter and octree (default: one per core); 1: a single thread for everything; "
                 "this implies --deterministic, and tracking waits for the live map")
      ->check(within(1U, 1024U))
      ->type_name("N");
  cmd.add_flag("--quiet", s.quiet, "print errors only");
}

void add_robot_options(CLI::App& cmd, settings& s) {
  metres(cmd, "--robot-radius", s.robot_radius, "radius of the robot for the floor map and the path, in metres", 0.001,
         10.0);
  metres(cmd, "--robot-height", s.robot_height, "height of the robot above the floor, in metres", 0.001, 10.0);
  cmd.add_option("--floor-map", s.floor_map,
                 "write the floor map for the map servers of ROS and Nav2: this .yaml file and a .pgm image next to it")
      ->check(CLI::Validator(
          [](const std::string& name) -> std::string {
            const std::string ending = std::filesystem::path{name}.extension().string();
            return ending == ".yaml" || ending == ".yml" ? "" : orbis::in_quotes(name) + " does not end in .yaml";
          },
          ""))
      ->type_name("FILE");
}

void add_plan_options(CLI::App& cmd, settings& s, std::string& from, std::string& to) {
  cmd.add_option("MAP", s.input, "octree map (.bt or .ot)")->required()->type_name("");
  cmd.add_option("--from", from, "start in metres")->required()->type_name("X,Y,Z");
  cmd.add_option("--to", to, "goal in metres")->required()->type_name("X,Y,Z");
  metres(cmd, "--robot-radius,--radius", s.robot_radius, "radius of the robot in metres", 0.001, 10.0);
  cmd.add_option_function<double>(
         "--robot-height,--height",
         [&s](double height) {
           s.robot_height = height;
           s.is_cylinder = true;
         },
         "height of the robot in metres: the robot is then an upright cylinder whose base is at the given point; by "
         "default, it is a ball around the point")
      ->check(within(0.001, 10.0, " m"))
      ->type_name("M");
  cmd.add_flag(
      "--ground", s.on_floor,
      "the robot drives on the floor: the heights of start and goal are ignored, and the default of --robot-height is "
      "0.5");
  cmd.add_option("--step", s.robot_step, "with --ground: maximum height of a step in metres (default: voxel size)")
      ->check(within(0.0, 10.0, " m"))
      ->type_name("M");
  cmd.add_option_function<std::string>(
         "--unknown", [&s](const std::string& what) { s.unknown_is_free = what == "free"; },
         "treat unknown space as an obstacle (default) or as free")
      ->check(CLI::IsMember({"obstacle", "free"}))
      ->type_name("WHAT");
  cmd.add_option("--out", s.out, "write the points of the path, one per line")->check(not_empty)->type_name("FILE");
  cmd.add_option("--picture", s.picture, "write a PNG picture of the map and the path from above")
      ->check(not_empty)
      ->type_name("FILE");
  cmd.add_flag("--quiet", s.quiet, "print errors only");
}

void add_sensor_option(CLI::App& cmd, settings& s, const std::vector<std::string>& sensors) {
  cmd.add_option("--sensor", s.sensor, "type of sensor: depth camera (rgbd), two cameras (stereo), one camera (mono)")
      ->check(CLI::IsMember(sensors))
      ->type_name("S");
}

void add_camera_option(CLI::App& cmd, settings& s) {
  cmd.add_option("--camera", s.camera,
                 "camera file (camera.toml, or JSON or YAML from Open3D, ROS, RealSense, ORB-SLAM) or preset: tum_fr1, "
                 "tum_fr2, tum_fr3, "
                 "icl, kinect")
      ->check(CLI::Validator(
          [](std::string& name) -> std::string {
            if (is_file_name(name)) return {};
            const auto known = orbis::camera::preset(name);
            return known ? std::string{} : known.error().message;
          },
          ""))
      ->type_name("FILE|NAME");
}

void add_recording_options(CLI::App& cmd, settings& s) {
  add_sensor_option(cmd, s, {"auto", "rgbd", "stereo", "mono"});
  cmd.add_option("--format", s.format, "layout of the recording")
      ->check(CLI::IsMember({"auto", "tum", "7scenes", "icl", "scannet", "folders", "kitti", "asl", "pairs", "images"}))
      ->capture_default_str()
      ->type_name("F");
  cmd.add_option("--topics", s.topics, "image topics of a ROS bag: COLOUR,DEPTH or LEFT,RIGHT (default: automatic)")
      ->delimiter(',')
      ->expected(1, 2)
      ->type_name("A,B");
  cmd.add_option("--truth-topic", s.truth_topic,
                 "ground truth of a ROS bag: topic of poses, odometry or transforms (/tf); default: none")
      ->type_name("NAME");
  add_camera_option(cmd, s);
}

void add_frame_options(CLI::App& cmd, settings& s) {
  count(cmd, "--frames", s.frames, "use at most N frames");
  count(cmd, "--stride", s.stride, "use every N-th frame")->capture_default_str();
}

void add_shutter_option(CLI::App& cmd, settings& s) {
  cmd.add_option_function<std::string>(
         "--read-out-ms",
         [&s](const std::string& value) {
           // The check ensures that it is a number; std::stod would throw for denormal values.
           if (value != "auto") s.read_out_ms = std::strtod(value.c_str(), nullptr);
         },
         "read-out time of the rolling shutter in milliseconds, top row first; 0: global shutter; auto (default): from "
         "the camera file, or else estimated during the run (beginning with typical values for TUM's freiburg1)")
      ->check(CLI::Validator(
          [check = within(0.0, 200.0, " ms")](std::string& text) {
            const std::string why = text == "auto" ? std::string{} : check(text);
            return why.empty() ? why : why + "; use a number or auto";
          },
          ""))
      ->type_name("MS");
}

/// An option with the values "on" and "off".
void add_switch(CLI::App& cmd, const std::string& name, bool& value, const std::string& what) {
  cmd.add_option_function<std::string>(
         name, [&value](const std::string& given) { value = given == "on"; }, what)
      ->check(CLI::IsMember({"on", "off"}))
      ->default_str(value ? "on" : "off")
      ->type_name("W");
}

void add_intrinsics_option(CLI::App& cmd, settings& s) {
  cmd.add_option_function<std::string>(
         "--intrinsics", [&s](const std::string& value) { s.refines_camera = value == "auto"; },
         "auto: if the images clearly contradict the focal length of the recording's camera, calibrate the camera with "
         "the recording and begin again; given: use the camera unchanged, as with --camera, --load-map and --save-map")
      ->check(CLI::IsMember({"auto", "given"}))
      ->default_str("auto")
      ->type_name("W");
}

void add_slam_options(CLI::App& cmd, settings& s) {
  add_shutter_option(cmd, s);
  if (cmd.get_name() == "run") add_intrinsics_option(cmd, s);
  add_switch(cmd, "--moving", s.moving, "detect moving objects and exclude them from tracking and mapping");
  add_switch(cmd, "--depth-term", s.depth_term,
             "use depth images in addition to features in pose estimation, and on their own where features fail");
  cmd.add_flag("--deterministic", s.deterministic,
               "byte-identical results in every run: mapping and loop closing run between frames, not in parallel");
  cmd.add_flag(
      "--live-map,!--batch-map", s.live_map,
      "build the octree while frames are tracked (default), or from all keyframes at the end; both give the same map");
  cmd.add_flag("--map-every-frame", s.map_every_frame,
               "insert every tracked frame into the live map, not only keyframes; output files contain keyframes only");
  if (cmd.get_name() != "live")
    cmd.add_flag("--realtime", s.realtime, "play frames at the rate of their timestamps, as a camera would");
  cmd.add_option("--save-map", s.save_map, "write the landmark map at the end")->check(not_empty)->type_name("FILE");
  cmd.add_option("--load-map", s.load_map, "start with a saved landmark map and continue in its world frame")
      ->check(not_empty)
      ->type_name("FILE");
  cmd.add_flag("--localize-only", s.localize_only,
               "only localise the camera in the loaded map, which stays unchanged: no keyframes, no cloud, no octree");
}

void add_viewer_options(CLI::App& cmd, settings& s) {
  cmd.add_option_function<std::string>(
         "--viewer", [&s](const std::string& name) { s.viewer = name.empty() ? "window" : name; },
         "show the run in a window or (--viewer web) in a browser on this machine")
      ->check(CLI::Validator(
          [](const std::string& name) {
            const bool is_known = name.empty() || name == "window" || name == "web";
            return is_known ? std::string{} : orbis::in_quotes(name) + " is neither window nor web";
          },
          ""))
      ->expected(0, 1)
      ->type_name("[window|web]");
  cmd.add_option("--viewer-port", s.viewer_port, "port of --viewer web on 127.0.0.1; 0: any free port")
      ->check(within(0U, 65535U))
      ->capture_default_str()
      ->type_name("N");
  cmd.add_flag("--viewer-hold", s.viewer_hold,
               "after the run, keep the viewer open until it is closed or Ctrl-C is pressed");
}

void add_calibration_options(CLI::App& cmd, settings& s) {
  cmd.add_option("DATASET", s.input, "folder of an RGB-D recording; its camera is the initial estimate")
      ->required()
      ->type_name("");
  cmd.add_option("--format", s.format, "layout of the recording")
      ->check(CLI::IsMember({"auto", "tum", "7scenes", "icl", "scannet", "folders"}))
      ->capture_default_str()
      ->type_name("F");
  add_camera_option(cmd, s);
  add_frame_options(cmd, s);
  add_shutter_option(cmd, s);
  cmd.add_flag("--distortion", s.distortion,
               "also estimate lens distortion (k1, k2, p1, p2) if the camera file has none");
  cmd.add_option("--out", s.out, "write the calibrated camera, for --camera or as camera.toml of a recording")
      ->check(not_empty)
      ->type_name("FILE");
  cmd.add_flag("--quiet", s.quiet, "print errors only");
}

void add_benchmark_options(CLI::App& cmd, settings& s) {
  cmd.add_option("FOLDER", s.inputs, "recordings, or folders that contain recordings at any depth")
      ->required()
      ->type_name("");
  cmd.add_flag(
      "--quick", s.quick,
      "run each recording only once, deterministically; by default, three runs with threads follow, in parallel with "
      "0, 1 and 2 busy loops");
  CLI::Option* json = cmd.add_flag("--json", s.json, "print JSON");
  cmd.add_flag("--markdown", s.markdown, "print tables as Markdown")->excludes(json);
  cmd.add_option("--out", s.out, "keep the results in this folder as RECORDING/RUN")
      ->check(not_empty)
      ->type_name("DIR");
  add_frame_options(cmd, s);
  cmd.add_option("--run-config", s.run_config, "file with options for the runs, like that of run --config")
      ->check(CLI::Validator{CLI::ExistingFile}.description(""))
      ->type_name("FILE");
  cmd.footer(
      "CPU time and peak memory are measured over whole runs, including map and report. Octree sizes are the sizes\n"
      "of the .bt files before and after the filter. If a run fails, the others continue and the exit code is 1.");
}

/// Describes the camera support of this program, and the libraries that were missing when it was built.
std::string build_features() {
  const auto support = [](bool has, const char* what, const char* package) {
    return std::string{what} + (has ? "" : std::string{": not in this build (needs "} + package + ")");
  };
  return support(has_openni(), "Depth cameras", "libopenni2-dev") + "\n" +
         support(has_video_cameras(), "Video cameras; --sensor stereo: left and right image side by side",
                 "libopencv-videoio-dev") +
         "\nFrames that arrive while another one is being tracked are dropped; summary.json counts them.";
}

/// The error if `--format` names a layout that does not exist for the sensor; otherwise empty.
std::string wrong_format(const settings& s) {
  using list = std::vector<std::string>;
  const list formats = s.sensor == "rgbd"     ? list{"tum", "7scenes", "icl", "scannet", "folders"}
                       : s.sensor == "stereo" ? list{"kitti", "asl", "pairs"}
                       : s.sensor == "mono"   ? list{"tum", "kitti", "asl", "images"}
                                              : list{s.format};
  if (s.format == "auto" || std::find(formats.begin(), formats.end(), s.format) != formats.end()) return {};
  return "--format " + s.format + " is not supported for --sensor " + s.sensor + "; use " +
         CLI::detail::join(formats, ", ");
}

/// The error if options contradict each other; otherwise empty.
std::string contradiction(const settings& s) {
  if (std::string wrong = wrong_format(s); !wrong.empty()) return wrong;
  if (s.localize_only && s.load_map.empty()) return "--localize-only needs a map: --load-map FILE";
  if (s.map_every_frame && (!s.live_map || s.localize_only))
    return "--map-every-frame needs a live map: remove --batch-map or --localize-only";
  if (s.localize_only && !s.save_map.empty()) return "--localize-only does not change the map: remove --save-map";
  if (s.robot_step && !s.on_floor) return "--step needs --ground";
  if (s.localize_only && !s.floor_map.empty()) return "--localize-only does not build a floor map: remove --floor-map";
  if (s.viewer.empty() && s.viewer_hold) return "--viewer-hold needs --viewer";
  if (!has_viewer(s.viewer)) return missing_viewer_message(s.viewer);
  return {};
}

/// Sets options that are not on the command line from a TOML file whose keys are the long names of the options.
std::optional<exit_code> read_config(CLI::App& cmd, const std::string& path) {
  const auto table = orbis::io::read_toml(path);
  if (!table) return report_error(examples::describe(table.error()), bad_input);
  for (const auto& [key, value] : *table) {
    const std::string name{key.str()};
    CLI::Option* option = cmd.get_option_no_throw("--" + name);
    if (option == nullptr || name == "config" || name == "help")
      return report_error(
          orbis::shortened_path(path) + ": " + orbis::in_quotes(name) + " is not an option of " + cmd.get_name(),
          bad_usage);
    if (value.is_table() || value.is_array())
      return report_error(orbis::shortened_path(path) + ": " + orbis::shortened(name, 60) + ": must be a single value",
                          bad_usage);
    if (option->count() != 0) continue;  // the command line takes precedence
    std::ostringstream as_text;
    if (value.is_string())
      as_text << value.as_string()->get();
    else
      value.visit([&](const auto& v) { as_text << v; });
    try {
      option->add_result(as_text.str());
      option->run_callback();
      examples::check_values(cmd);
    } catch (const CLI::ParseError& e) {
      return report_error(orbis::shortened_path(path) + ": " + orbis::shortened(e.what()), bad_usage);
    }
  }
  return std::nullopt;
}

/// Applies the profile to options that neither the command line nor the file sets.
void set_profile_defaults(const CLI::App& cmd, settings& s) {
  if (s.profile != "small") return;
  const auto is_open = [&](const char* name) { return cmd.get_option(name)->count() == 0; };
  if (is_open("--resolution")) s.resolution = small_settings::resolution;
  if (is_open("--depth-memory")) s.depth_memory = small_settings::depth_memory;
}

/// Parses "x,y,z"; empty if the text is not three finite numbers.
std::optional<orbis::vec3> parse_vector(const std::string& text) {
  orbis::vec3 p;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &p.x(), &p.y(), &p.z(), &rest) != 3 || !p.allFinite())
    return std::nullopt;
  return p;
}

/// Commands, options, and the settings that they set.
struct command_line {
  command_line();
  command_line(const command_line&) = delete;  // options refer to members
  command_line& operator=(const command_line&) = delete;
  ~command_line() = default;
  /// Like `read_command_line`; may be called any number of times.
  [[nodiscard]] std::variant<settings, exit_code> read(int argc, char** argv);

  settings s;
  std::string origin, gravity, from, to;
  CLI::App cli{"RGB-D SLAM and mapping: from a recording to a trajectory, a cloud and an octree map", "rgbd_slam"};
  CLI::App *run = nullptr, *demo = nullptr, *live = nullptr, *eval = nullptr, *map = nullptr, *way = nullptr,
           *trial = nullptr, *calibration = nullptr;
};

command_line::command_line() {
  cli.require_subcommand(1);
  cli.footer(
      "Exit codes: 0 success, 1 bad usage, or a failed run (benchmark), 2 unreadable or damaged input (or\n"
      "output that cannot be written), 3 tracking never started, or the camera was never found in the\n"
      "loaded map, 4 no path (plan), 5 the motion does not determine the camera (calibrate).\n"
      "An interrupted run keeps its results so far (130).");

  run = cli.add_subcommand(
      "run", "SLAM on a recording (TUM, 7-Scenes, ICL-NUIM, ScanNet; stereo or monocular: KITTI, ASL, images)");
  run->add_option("DATASET", s.input, "folder of the recording, ROS bag (.bag, .mcap, .db3 or folder), or video")
      ->required()
      ->check(not_empty)
      ->type_name("");
  add_recording_options(*run, s);
  add_frame_options(*run, s);
  add_map_options(*run, s);
  add_slam_options(*run, s);
  add_viewer_options(*run, s);

  demo = cli.add_subcommand("demo", "SLAM on a synthetic room rendered on the fly, with ground truth");
  add_sensor_option(*demo, s, {"auto", "rgbd", "stereo", "mono"});
  add_frame_options(*demo, s);
  count(*demo, "--width", s.width, "width of the images, pixels; the height is 3/4 of it", 160, 1920)
      ->capture_default_str();
  demo->add_option("--seed", s.seed, "seed of the room, the camera's path and the sensor noise")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  demo->add_flag("--plain", s.plain, "render a single round, without a person or stray depths");
  demo->add_flag("--person", s.person, "with --plain: a person walks through the room");
  demo->add_flag(
      "--walk", s.walk,
      "the camera is on a walking robot in a dim room: steps and vibrations, motion blur in colour and depth, "
      "rolling shutter");
  add_map_options(*demo, s);
  add_slam_options(*demo, s);
  add_viewer_options(*demo, s);

  live = cli.add_subcommand("live", "SLAM with a live camera, until Ctrl-C or until it is disconnected");
  live->add_option(
          "DEVICE", s.input,
          "URI of a depth camera (OpenNI2: Astra, Xtion, PrimeSense) or .oni file; /dev/video0 or 0 for a video "
          "camera; folder of a recording, played in real time (default: the first depth camera)")
      ->type_name("");
  add_sensor_option(*live, s, {"auto", "rgbd", "stereo", "mono"});
  add_camera_option(*live, s);
  count(*live, "--frames", s.frames, "stop after N frames");
  add_map_options(*live, s);
  add_slam_options(*live, s);
  add_viewer_options(*live, s);
  live->footer(build_features());

  eval = cli.add_subcommand("eval", "compare a trajectory with ground truth (TUM, EuRoC or KITTI format): ATE and RPE");
  eval->add_option("TRAJECTORY", s.input, "estimated trajectory")->required()->type_name("");
  eval->add_option("GROUNDTRUTH", s.reference, "reference trajectory")->required()->type_name("");
  eval->add_flag("--json", s.json, "print JSON");
  eval->add_flag("--scale", s.with_scale, "also estimate the scale, for monocular trajectories");

  map = cli.add_subcommand("map", "cloud -> filter -> octree, without SLAM");
  map->add_option("INPUT", s.input, "cloud (.ply, .pcd), or folder of a recording with ground-truth poses")
      ->required()
      ->type_name("");
  map->add_option(
         "--origin", origin,
         "position of the sensor in metres: rays from there mark free space; without it, the points are marked "
         "occupied and no space is marked free")
      ->check(not_empty)
      ->type_name("X,Y,Z");
  add_recording_options(*map, s);
  add_frame_options(*map, s);
  add_map_options(*map, s);

  way = cli.add_subcommand("plan", "find the shortest path for a robot in an octree map");
  add_plan_options(*way, s, from, to);

  trial = cli.add_subcommand("benchmark", "run all recordings in folders, and print a table of the results");
  add_benchmark_options(*trial, s);

  calibration = cli.add_subcommand("calibrate", "estimate the camera's intrinsics and depth scale from a recording");
  add_calibration_options(*calibration, s);

  for (CLI::App* cmd : {run, live, demo, map}) add_robot_options(*cmd, s);
  for (CLI::App* cmd : {run, live, demo, map})
    cmd->add_option(
           "--gravity", gravity,
           "direction of gravity at the first frame, in the camera frame (x right, y down, z forward); by default, "
           "it is estimated from the depth image")
        ->check(not_empty)
        ->type_name("X,Y,Z");
  for (CLI::App* cmd : {run, live, demo, map})
    cmd->add_option("--config", s.config, "read options from a TOML file, such as resolution = 0.02")
        ->check(not_empty)
        ->type_name("FILE");
  for (CLI::App* cmd : {run, live, demo, eval, map, way, calibration, trial}) cmd->get_formatter()->column_width(28);
}

std::variant<settings, exit_code> command_line::read(int argc, char** argv) {
  s = {};
  for (std::string* const text : {&origin, &gravity, &from, &to}) text->clear();
  const auto is_asked_for = [&](const CLI::App* command) { return command->get_name() == argv[1]; };
  if (argc < 2 || (argv[1][0] != '-' && cli.get_subcommands(is_asked_for).empty()))
    return report_error((argc < 2 ? std::string{"a command is missing"} : "no command " + orbis::in_quotes(argv[1])) +
                            "; use run, live, demo, eval, map, plan, calibrate or benchmark (--help shows the usage)",
                        bad_usage);
  try {
    cli.parse(argc, argv);
    examples::check_values(cli);
  } catch (const CLI::CallForHelp&) {
    std::fputs(cli.help().c_str(), stdout);
    return done;
  } catch (const CLI::ParseError& e) {
    return report_error(examples::describe_usage(cli, e), bad_usage);
  }

  CLI::App* chosen = cli.get_subcommands().front();
  s.what = chosen == run     ? command::run
           : chosen == demo  ? command::demo
           : chosen == eval  ? command::eval
           : chosen == map   ? command::map
           : chosen == way   ? command::plan
           : chosen == live  ? command::live
           : chosen == trial ? command::benchmark
                             : command::calibrate;
  if (!s.config.empty())
    if (const auto failed = read_config(*chosen, s.config.string())) return *failed;
  set_profile_defaults(*chosen, s);
  if (!origin.empty()) {
    s.origin = parse_vector(origin);
    if (!s.origin) return report_error("--origin: " + orbis::in_quotes(origin) + " is not x,y,z in metres", bad_usage);
  }
  for (const auto& [text, name, p] : {std::tuple{&from, "--from", &s.from}, {&to, "--to", &s.to}}) {
    if (chosen != way) break;
    const auto point = parse_vector(*text);
    if (!point || point->cwiseAbs().maxCoeff() > 1e7)
      return report_error(std::string{name} + ": " + orbis::in_quotes(*text) + " is not x,y,z in metres, up to 1e7",
                          bad_usage);
    *p = *point;
  }
  if (!gravity.empty()) {
    s.gravity = parse_vector(gravity);
    if (!s.gravity || s.gravity->isZero())
      return report_error("--gravity: " + orbis::in_quotes(gravity) + " is not a direction x,y,z", bad_usage);
  }
  if (const std::string what = contradiction(s); !what.empty()) return report_error(what, bad_usage);
  return s;
}

}  // namespace

std::variant<settings, exit_code> read_command_line(int argc, char** argv) { return command_line{}.read(argc, argv); }

}  // namespace app

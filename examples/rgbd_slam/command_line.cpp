// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include <orbis/camera/presets.hpp>
#include <orbis/io/toml.hpp>

#include "filters.hpp"
#include "inputs/camera_device.hpp"
#include "profiles.hpp"
#include "viewer/backend.hpp"

namespace app {
namespace {

exit_code complain(std::string what, exit_code code) {
  for (char& c : what)
    if (c == '\n' || c == '\r') c = ' ';
  std::fprintf(stderr, "rgbd_slam: %s\n", what.c_str());
  return code;
}

/// A number within [low, high]; unlike CLI11's own ranges it refuses "nan".
template <class T>
CLI::Validator within(T low, T high, std::string unit = {}) {
  std::ostringstream text_of_range;
  text_of_range << low << " ... " << high << unit;
  return CLI::Validator(
      [low, high, range = text_of_range.str()](std::string& text) -> std::string {
        T value{};
        if (!CLI::detail::lexical_cast(text, value)) return "\"" + text + "\" is not a number of the kind wanted";
        if (!(value >= low && value <= high)) return text + " is outside " + range;
        return {};
      },
      "");
}

CLI::Option* count(CLI::App& cmd, const std::string& name, std::size_t& value, const std::string& what,
                   std::size_t low = 1, std::size_t high = 100'000'000) {
  return cmd.add_option(name, value, what)->check(within<std::size_t>(low, high))->type_name("N");
}

/// A length within [low, high], whose default `--help` tells.
CLI::Option* metres(CLI::App& cmd, const std::string& name, double& value, const std::string& what, double low,
                    double high) {
  return cmd.add_option(name, value, what)->check(within(low, high, " m"))->capture_default_str()->type_name("M");
}

std::string not_empty(const std::string& path) { return path.empty() ? "must not be empty" : ""; }

void add_map_options(CLI::App& cmd, settings& s) {
  cmd.add_option("--profile", s.profile,
                 "small: for boards with four small cores, such as the Raspberry Pi 4. Fewer features, a smaller "
                 "neighbourhood in mapping, --resolution 0.1, --depth-memory 8; options that are given win")
      ->check(CLI::IsMember(profile_names()))
      ->capture_default_str()
      ->type_name("P");
  cmd.add_option("--out", s.out, "where the files go; made if it is not there")
      ->required()
      ->check(not_empty)
      ->type_name("DIR");
  metres(cmd, "--resolution", s.resolution, "edge of the octree's smallest voxels, metres", 0.001, 10.0);
  cmd.add_option("--max-depth", s.max_depth,
                 "farther measurements do not enter the map, metres; 4 if not given, or, of stereo cameras, 20 times "
                 "their baseline if that is more")
      ->check(within(0.1, 1000.0, " m"))
      ->type_name("M");
  cmd.add_option("--filter", s.filter, "how outliers are removed; auto: as the cloud suggests")
      ->check(CLI::IsMember(filter_names()))
      ->capture_default_str()
      ->type_name("MODE");
  cmd.add_option("--neighbors", s.neighbors, "neighbours of a point, e.g. 50 of the statistical filter, 5 of radius")
      ->check(within<std::size_t>(1, 100'000))
      ->type_name("N");
  metres(cmd, "--radius", s.radius, "radius filter: where so many neighbours must lie, metres", 1e-6, 1000.0);
  cmd.add_option("--sigma", s.sigma, "statistical filter: how many deviations above the mean a point may lie")
      ->check(within(0.0, 1000.0))
      ->capture_default_str()
      ->type_name("A");
  count(cmd, "--depth-memory", s.depth_memory,
        "memory for the depth images of keyframes, MB; what is beyond goes to a nameless file in the output folder", 0,
        1'000'000)
      ->capture_default_str();
  cmd.add_option(
         "--threads", s.threads,
         "threads for filter and octree; 1: for all, as --deterministic, and one thing after the other: tracking "
         "waits for the live map")
      ->check(within(1U, 1024U))
      ->type_name("N");
  cmd.add_flag("--quiet", s.quiet, "say nothing but errors");
}

void add_robot_options(CLI::App& cmd, settings& s) {
  metres(cmd, "--robot-radius", s.robot_radius, "of the robot that the floor map and the path are for, metres", 0.001,
         10.0);
  metres(cmd, "--robot-height", s.robot_height, "so much space it needs above the floor, metres", 0.001, 10.0);
  cmd.add_option("--floor-map", s.floor_map,
                 "write the floor map for the map servers of ROS and Nav2: this file and a .pgm beside it")
      ->check(CLI::Validator(
          [](const std::string& name) -> std::string {
            const std::string ending = std::filesystem::path{name}.extension().string();
            return ending == ".yaml" || ending == ".yml" ? "" : "\"" + name + "\" does not end in .yaml";
          },
          ""))
      ->type_name("FILE");
}

void add_plan_options(CLI::App& cmd, settings& s, std::string& from, std::string& to) {
  cmd.add_option("MAP", s.input, "an octree map: .bt or .ot")->required()->type_name("");
  cmd.add_option("--from", from, "where the robot is, metres")->required()->type_name("X,Y,Z");
  cmd.add_option("--to", to, "where it is to go")->required()->type_name("X,Y,Z");
  metres(cmd, "--robot-radius,--radius", s.robot_radius, "of the robot, metres", 0.001, 10.0);
  cmd.add_option_function<double>(
         "--robot-height,--height",
         [&s](double height) {
           s.robot_height = height;
           s.stands = true;
         },
         "the robot is an upright cylinder of this height on the point that is given; without it, a ball around it")
      ->check(within(0.001, 10.0, " m"))
      ->type_name("M");
  cmd.add_flag(
      "--ground", s.on_floor,
      "the robot drives on the floor: heights of the points do not count, and --robot-height is 0.5 if not given");
  cmd.add_option("--step", s.robot_step,
                 "--ground: the highest step that it drives up or down, metres; without it, a voxel")
      ->check(within(0.0, 10.0, " m"))
      ->type_name("M");
  cmd.add_option_function<std::string>(
         "--unknown", [&s](const std::string& what) { s.unknown_is_free = what == "free"; },
         "what space counts as of which nothing is known: obstacle (default) or free")
      ->check(CLI::IsMember({"obstacle", "free"}))
      ->type_name("WHAT");
  cmd.add_option("--out", s.out, "the path's points, a line each")->check(not_empty)->type_name("FILE");
  cmd.add_option("--picture", s.picture, "the map from above with the path, PNG")->check(not_empty)->type_name("FILE");
  cmd.add_flag("--quiet", s.quiet, "say nothing but errors");
}

void add_sensor_option(CLI::App& cmd, settings& s, const std::vector<std::string>& sensors) {
  cmd.add_option("--sensor", s.sensor, "what takes the images: depth by itself (rgbd), two cameras, or one")
      ->check(CLI::IsMember(sensors))
      ->type_name("S");
}

void add_camera_option(CLI::App& cmd, settings& s) {
  cmd.add_option("--camera", s.camera, "camera.toml, or tum_fr1, tum_fr2, tum_fr3, icl, kinect")
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
      ->check(CLI::IsMember({"auto", "tum", "7scenes", "icl", "scannet", "kitti", "asl", "pairs", "images"}))
      ->capture_default_str()
      ->type_name("F");
  cmd.add_option("--topics", s.topics, "of a ROS bag: COLOUR,DEPTH or LEFT,RIGHT; without it they are found")
      ->delimiter(',')
      ->expected(1, 2)
      ->type_name("A,B");
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
           // The check has seen that it is a number; std::stod throws at what is next to nothing.
           if (value != "auto") s.read_out_ms = std::strtod(value.c_str(), nullptr);
         },
         "in how many milliseconds the camera's rolling shutter reads an image, the top row first; 0: a global "
         "shutter; "
         "auto (default): as the camera file says, else estimated from the first ten seconds")
      ->check(CLI::IsMember({"auto"}) | within(0.0, 200.0, " ms"))
      ->type_name("MS");
}

/// An option that is "on" or "off".
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
         "auto: where the first ten seconds are looked at (see --read-out-ms) and clearly do not fit the focal length "
         "of the recording's camera, it is calibrated by the recording first; given: the camera is as it is said to "
         "be, as with --camera, --load-map and --save-map")
      ->check(CLI::IsMember({"auto", "given"}))
      ->default_str("auto")
      ->type_name("W");
}

void add_slam_options(CLI::App& cmd, settings& s) {
  add_shutter_option(cmd, s);
  if (cmd.get_name() == "run") add_intrinsics_option(cmd, s);
  add_switch(cmd, "--moving", s.moving,
             "tell who moves before the camera from the room, and leave them out of tracking and map");
  add_switch(cmd, "--depth-term", s.depth_term,
             "depth images join the features where poses are estimated, and hold the camera where these do not");
  cmd.add_flag("--deterministic", s.deterministic,
               "the same bytes on every run: mapping and loop closing take place between the frames, not beside them");
  cmd.add_flag(
      "--live-map,!--batch-map", s.live_map,
      "the octree grows while frames are tracked (default), or is made of all keyframes in the end: the same map");
  cmd.add_flag(
      "--map-every-frame", s.map_every_frame,
      "the live map takes every tracked frame, not keyframes alone; the files are made of keyframes all the same");
  if (cmd.get_name() != "live")
    cmd.add_flag("--realtime", s.realtime, "frames come at the pace of their time stamps, as from a camera");
  cmd.add_option("--save-map", s.save_map, "write the map of landmarks when all is tracked")
      ->check(not_empty)
      ->type_name("FILE");
  cmd.add_option("--load-map", s.load_map, "begin with a map of landmarks that was saved, and go on in its world")
      ->check(not_empty)
      ->type_name("FILE");
  cmd.add_flag("--localize-only", s.localize_only,
               "only find the camera in the loaded map, which stays as it is: no keyframes, no cloud, no octree");
}

void add_viewer_options(CLI::App& cmd, settings& s) {
  cmd.add_option_function<std::string>(
         "--viewer", [&s](const std::string& name) { s.viewer = name.empty() ? "window" : name; },
         "shows the run while it goes on: in a window, or (--viewer web) as a page for browsers of this machine")
      ->check(CLI::Validator(
          [](const std::string& name) {
            const bool is_known = name.empty() || name == "window" || name == "web";
            return is_known ? std::string{} : "\"" + name + "\" is neither window nor web";
          },
          ""))
      ->expected(0, 1)
      ->type_name("[window|web]");
  cmd.add_option("--viewer-port", s.viewer_port, "where --viewer web serves its page on 127.0.0.1; 0: any free port")
      ->check(within(0U, 65535U))
      ->capture_default_str()
      ->type_name("N");
  cmd.add_flag("--viewer-hold", s.viewer_hold, "the viewer stays after the run, until the window is closed or Ctrl-C");
}

void add_calibration_options(CLI::App& cmd, settings& s) {
  cmd.add_option("DATASET", s.input, "the folder of a recording with depth; its camera is where the search begins")
      ->required()
      ->type_name("");
  cmd.add_option("--format", s.format, "layout of the recording")
      ->check(CLI::IsMember({"auto", "tum", "7scenes", "icl", "scannet"}))
      ->capture_default_str()
      ->type_name("F");
  add_camera_option(cmd, s);
  add_frame_options(cmd, s);
  add_shutter_option(cmd, s);
  cmd.add_flag("--distortion", s.distortion,
               "estimate the lens's distortion (k1, k2, p1, p2) too, for a camera file that has none");
  cmd.add_option("--out", s.out, "write the camera that was found: a file for --camera, or camera.toml of a recording")
      ->check(not_empty)
      ->type_name("FILE");
  cmd.add_flag("--quiet", s.quiet, "say nothing but errors");
}

/// What of the libraries for cameras this program was built with.
std::string in_this_build() {
  const auto say = [](bool has, const char* what, const char* package) {
    return std::string{what} + (has ? "" : std::string{": not in this build ("} + package + ")");
  };
  return say(has_openni(), "Depth cameras", "libopenni2-dev") + "\n" +
         say(has_video_cameras(), "Video cameras; with --sensor stereo the left and the right image side by side",
             "libopencv-videoio-dev") +
         "\nFrames that come while the last one is tracked are dropped, and counted in summary.json.";
}

/// That a sensor's recordings do not come in a layout; empty if they do.
std::string wrong_format(const settings& s) {
  using list = std::vector<std::string>;
  const list formats = s.sensor == "rgbd"     ? list{"tum", "7scenes", "icl", "scannet"}
                       : s.sensor == "stereo" ? list{"kitti", "asl", "pairs"}
                       : s.sensor == "mono"   ? list{"tum", "kitti", "asl", "images"}
                                              : list{s.format};
  if (s.format == "auto" || std::find(formats.begin(), formats.end(), s.format) != formats.end()) return {};
  return "--format " + s.format + " is not for --sensor " + s.sensor + ", which has " +
         CLI::detail::join(formats, ", ");
}

/// What of the options does not go together; empty if all does.
std::string contradiction(const settings& s) {
  if (std::string wrong = wrong_format(s); !wrong.empty()) return wrong;
  if (s.localize_only && s.load_map.empty())
    return "--localize-only wants a map to find the camera in: --load-map FILE";
  if (s.map_every_frame && (!s.live_map || s.localize_only))
    return "--map-every-frame wants a live map: not with --batch-map or --localize-only";
  if (s.localize_only && !s.save_map.empty())
    return "--localize-only leaves the map as it is: there is nothing to save with --save-map";
  if (s.robot_step && !s.on_floor) return "--step is for robots that drive: with --ground";
  if (s.localize_only && !s.floor_map.empty()) return "--localize-only makes no map of the floor: not with --floor-map";
  if (s.viewer.empty() && s.viewer_hold) return "--viewer-hold wants a viewer: --viewer";
  if (!has_viewer(s.viewer)) return how_to_get_viewer(s.viewer);
  return {};
}

/// Fills what the command line left open from a TOML file whose keys are the options' long names.
std::optional<exit_code> read_config(CLI::App& cmd, const std::string& path) {
  const auto table = orbis::io::read_toml(path);
  if (!table) return complain(table.error().to_string(), bad_input);
  for (const auto& [key, value] : *table) {
    const std::string name{key.str()};
    CLI::Option* option = cmd.get_option_no_throw("--" + name);
    if (option == nullptr || name == "config" || name == "help")
      return complain(path + ": \"" + name + "\" is not an option of " + cmd.get_name(), bad_usage);
    if (value.is_table() || value.is_array()) return complain(path + ": " + name + ": one value is wanted", bad_usage);
    if (option->count() != 0) continue;  // the command line has the last word
    std::ostringstream as_text;
    if (value.is_string())
      as_text << value.as_string()->get();
    else
      value.visit([&](const auto& v) { as_text << v; });
    try {
      option->add_result(as_text.str());
      option->run_callback();
    } catch (const CLI::ParseError& e) {
      return complain(path + ": " + e.what(), bad_usage);
    }
  }
  return std::nullopt;
}

/// Sets what the profile says of options that neither the command line nor the file gives.
void set_profile_defaults(const CLI::App& cmd, settings& s) {
  if (s.profile != "small") return;
  const auto is_open = [&](const char* name) { return cmd.get_option(name)->count() == 0; };
  if (is_open("--resolution")) s.resolution = small_settings::resolution;
  if (is_open("--depth-memory")) s.depth_memory = small_settings::depth_memory;
}

/// "x,y,z"; nothing if it is not.
std::optional<orbis::vec3> vector_of(const std::string& text) {
  orbis::vec3 p;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &p.x(), &p.y(), &p.z(), &rest) != 3 || !p.allFinite())
    return std::nullopt;
  return p;
}

}  // namespace

std::variant<settings, exit_code> read_command_line(int argc, char** argv) {
  settings s;
  std::string origin, gravity, from, to;

  CLI::App cli{"RGB-D SLAM and mapping: from a recording to a trajectory, a cloud and an octree map", "rgbd_slam"};
  cli.require_subcommand(1);
  cli.footer(
      "Exit codes: 0 done, 1 bad usage, 2 unreadable or damaged input (or output that cannot be\n"
      "written), 3 tracking never started, or the camera was never found in the loaded map,\n"
      "4 there is no way (plan), 5 the motion does not determine the camera (calibrate).\n"
      "Interrupting a run keeps what it has reached (130).");

  CLI::App* run = cli.add_subcommand(
      "run", "SLAM on a recording (TUM, 7-Scenes, ICL-NUIM, ScanNet; stereo or one camera: KITTI, ASL, images)");
  run->add_option("DATASET", s.input, "the recording's folder; a ROS 1 bag (.bag), or a video")
      ->required()
      ->type_name("");
  add_recording_options(*run, s);
  add_frame_options(*run, s);
  add_map_options(*run, s);
  add_slam_options(*run, s);
  add_viewer_options(*run, s);

  CLI::App* demo = cli.add_subcommand("demo", "SLAM on a synthetic room made on the fly, with ground truth");
  add_sensor_option(*demo, s, {"auto", "rgbd", "stereo", "mono"});
  add_frame_options(*demo, s);
  count(*demo, "--width", s.width, "width of the images, pixels; the height is 3/4 of it", 160, 1920)
      ->capture_default_str();
  demo->add_option("--seed", s.seed, "of the room, the camera's path and the sensor's noise")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  demo->add_flag("--plain", s.plain, "one round only, without the person and the stray depths");
  demo->add_flag("--person", s.person, "with --plain: a person walks through the room");
  add_map_options(*demo, s);
  add_slam_options(*demo, s);
  add_viewer_options(*demo, s);

  CLI::App* live =
      cli.add_subcommand("live", "SLAM with a camera as it goes, until Ctrl-C or until it is disconnected");
  live->add_option("DEVICE", s.input,
                   "without it the first depth camera (OpenNI2: Astra, Xtion, PrimeSense). Its URI, or an .oni file; "
                   "/dev/video0 or 0 for a video camera; a recording's folder, which plays at its pace")
      ->type_name("");
  add_sensor_option(*live, s, {"auto", "rgbd", "stereo", "mono"});
  add_camera_option(*live, s);
  count(*live, "--frames", s.frames, "end after N frames");
  add_map_options(*live, s);
  add_slam_options(*live, s);
  add_viewer_options(*live, s);
  live->footer(in_this_build());

  CLI::App* eval = cli.add_subcommand("eval", "compare a trajectory with ground truth (TUM format): ATE and RPE");
  eval->add_option("TRAJECTORY", s.input, "the estimate")->required()->type_name("");
  eval->add_option("GROUNDTRUTH", s.reference, "the reference")->required()->type_name("");
  eval->add_flag("--json", s.json, "print JSON");
  eval->add_flag("--scale", s.with_scale, "the estimate has a unit of its own (one camera): find its scale as well");

  CLI::App* map = cli.add_subcommand("map", "cloud -> filter -> octree, without SLAM");
  map->add_option("INPUT", s.input,
                  "a cloud (.ply, .pcd), or the folder of a recording whose ground truth has the poses")
      ->required()
      ->type_name("");
  map->add_option("--origin", origin,
                  "sensor that saw the cloud, metres: rays from there clear free space. "
                  "Without it the points are marked occupied and nothing is marked free")
      ->type_name("X,Y,Z");
  add_recording_options(*map, s);
  add_frame_options(*map, s);
  add_map_options(*map, s);

  CLI::App* way = cli.add_subcommand("plan", "the shortest way of a robot through an octree map");
  add_plan_options(*way, s, from, to);

  CLI::App* calibration = cli.add_subcommand("calibrate", "the camera's intrinsics and depth scale from a recording");
  add_calibration_options(*calibration, s);

  for (CLI::App* cmd : {run, live, demo, map}) add_robot_options(*cmd, s);
  for (CLI::App* cmd : {run, live, demo, map})
    cmd->add_option("--gravity", gravity,
                    "where it pulls at the first frame, in the camera's frame: x right, y down, z forward. Without it "
                    "the depth image has to tell")
        ->type_name("X,Y,Z");
  for (CLI::App* cmd : {run, live, demo, map})
    cmd->add_option("--config", s.config, "options from a TOML file: resolution = 0.02")->type_name("FILE");
  for (CLI::App* cmd : {run, live, demo, eval, map, way, calibration}) cmd->get_formatter()->column_width(28);

  const auto is_asked_for = [&](const CLI::App* command) { return command->get_name() == argv[1]; };
  if (argc > 1 && argv[1][0] != '-' && cli.get_subcommands(is_asked_for).empty())
    return complain(
        "there is no command \"" + std::string{argv[1]} + "\", but run, live, demo, eval, map, plan and calibrate",
        bad_usage);
  try {
    cli.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::fputs(cli.help().c_str(), stdout);
    return done;
  } catch (const CLI::ParseError& e) {
    return complain(std::string{e.what()} + " (--help shows the usage)", bad_usage);
  }

  CLI::App* chosen = cli.get_subcommands().front();
  s.what = chosen == run    ? command::run
           : chosen == demo ? command::demo
           : chosen == eval ? command::eval
           : chosen == map  ? command::map
           : chosen == way  ? command::plan
           : chosen == live ? command::live
                            : command::calibrate;
  if (!s.config.empty())
    if (const auto failed = read_config(*chosen, s.config.string())) return *failed;
  set_profile_defaults(*chosen, s);
  if (!origin.empty()) {
    s.origin = vector_of(origin);
    if (!s.origin) return complain("--origin: \"" + origin + "\" is not x,y,z in metres", bad_usage);
  }
  for (const auto& [text, name, p] : {std::tuple{&from, "--from", &s.from}, {&to, "--to", &s.to}}) {
    if (chosen != way) break;
    const auto point = vector_of(*text);
    if (!point) return complain(std::string{name} + ": \"" + *text + "\" is not x,y,z in metres", bad_usage);
    *p = *point;
  }
  if (!gravity.empty()) {
    s.gravity = vector_of(gravity);
    if (!s.gravity || s.gravity->isZero())
      return complain("--gravity: \"" + gravity + "\" is not a direction x,y,z", bad_usage);
  }
  if (const std::string what = contradiction(s); !what.empty()) return complain(what, bad_usage);
  return s;
}

}  // namespace app

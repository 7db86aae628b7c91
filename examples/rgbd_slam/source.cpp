// SPDX-License-Identifier: BSD-3-Clause
#include "source.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <limits>
#include <memory>
#include <mutex>
#include <utility>

#include <orbis/camera/plausible.hpp>
#include <orbis/camera/stereo_frame.hpp>
#include <orbis/eval/orientations.hpp>
#include <orbis/io/image.hpp>
#include <orbis/io/mono_recording.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/stereo_recording.hpp>
#include <orbis/io/synthetic.hpp>

#include "../common/memory.hpp"
#include "../common/near_origin.hpp"
#include "../common/voxel_estimate.hpp"
#include "camera_files.hpp"
#include "formatted_text.hpp"
#include "inputs/bag_file.hpp"
#include "inputs/file_recording.hpp"
#include "inputs/live_source.hpp"
#include "interrupts.hpp"
#include "stereo_depth.hpp"

namespace app {
namespace {

using orbis::fail;
using orbis::result;
using orbis::slam::sensor_kind;

constexpr const char* camera_request = "specify a camera";

/// If `e` is a reader's request for a camera, or reports that depth.txt is missing, adds the command-line options that
/// help.
orbis::error with_option(orbis::error e) {
  if (e.message.ends_with(camera_request))
    e.message +=
        " with --camera, which takes a file (camera.toml; JSON or YAML from Open3D, ROS, RealSense, ORB-SLAM) or "
        "tum_fr1, tum_fr2, tum_fr3, icl, kinect";
  if (e.code == orbis::errc::not_found && e.where.ends_with("depth.txt"))
    e.message += ". --format folders pairs the images in rgb/ and depth/ by their names; --sensor mono needs no depth";
  return e;
}

/// The camera given by the option --camera; empty if the option is not used.
result<std::optional<orbis::camera::camera_settings>> camera_option(const settings& s) {
  if (s.camera.empty()) return std::nullopt;
  auto camera = named_camera(s.camera);
  if (!camera) return fail(camera.error());
  return std::optional{*std::move(camera)};
}

/// Opens a recording with `open(options)`. If it needs a camera and a file of another program in the folder describes
/// one, uses that camera and adds a note.
template <class Open, class Options>
auto open_with_camera(const settings& s, Options options, Open&& open, std::optional<camera_file>& found)
    -> decltype(open(options)) {
  auto camera = camera_option(s);
  if (!camera) return fail(camera.error());
  options.camera = *camera;
  auto opened = open(options);
  if (opened || *camera || opened.error().code != orbis::errc::invalid_argument) return opened;
  const auto path = find_camera_file(s.input);
  if (path.empty()) return opened;
  auto file = read_camera_file(path);
  if (!file) return fail(file.error());
  if (file->camera.model.width() == 0) {  // use the size of the first image
    const auto images = orbis::io::open_mono_recording(s.input, {.camera = file->camera});
    if (!images) return fail(images.error());
    const auto first = orbis::io::read_color(images->path(0));
    if (!first) return fail(first.error());
    orbis::camera::intrinsics k = file->camera.model.k();
    k.width = first->width();
    k.height = first->height();
    const auto checked = orbis::camera::plausible(k, path.string());
    if (!checked) return fail(checked.error());
    file->camera.model = orbis::camera::pinhole{*checked};
  }
  found = *std::move(file);
  options.camera = found->camera;
  return open(options);
}

void add_camera_file(const std::optional<camera_file>& file, frame_source& source) {
  if (!file) return;
  source.notes.push_back(file->describe());
  source.files.push_back(file->path);
}

std::size_t limited(std::size_t available, const settings& s) {
  const std::size_t every = (available + s.stride - 1) / s.stride;
  return s.frames == 0 ? every : std::min(every, s.frames);
}

source_frame with_depth(orbis::camera::rgbd_frame frame) { return {std::move(frame), {}}; }
source_frame without_depth(double timestamp, orbis::image<orbis::rgb8> color) {
  source_frame f;
  f.timestamp = timestamp;
  f.color = std::move(color);
  return f;
}
source_frame with_right(orbis::camera::stereo_frame pair) {
  source_frame f;
  f.timestamp = pair.timestamp;
  f.color = std::move(pair.left);
  f.right = std::move(pair.right);
  f.T_world_camera = pair.T_world_camera;
  return f;
}

/// Subtracts an origin from all positions of the ground truth, so that results are near zero; adds a note if the origin
/// is not zero. Does not change a ground truth that has positions only, and notes that results are in another frame.
void subtract_origin(frame_source& source) {
  if (source.ground_truth.empty()) return;
  source.truth_has_positions_only = orbis::eval::has_positions_only(source.ground_truth);
  if (source.truth_has_positions_only) {
    source.notes.push_back(
        "the ground truth has positions only (all orientations are 0 0 0 1): the world frames differ");
    return;
  }
  const orbis::vec3 origin = examples::nearby_origin(source.ground_truth.front().T_world_camera.translation());
  source.origin = origin;
  for (orbis::stamped_pose& p : source.ground_truth)
    p.T_world_camera = {p.T_world_camera.rotation(), p.T_world_camera.translation() - origin};
  if (!origin.isZero()) source.notes.push_back(origin_note(origin));
}

/// Creates a source and sets the members that do not depend on the sensor.
template <class Recording>
frame_source make_source(const Recording& recording, const char* kind, const settings& s) {
  frame_source source;
  source.title = std::filesystem::weakly_canonical(s.input).filename().string();
  source.kind = std::string{kind} + " (" + std::string{to_string(recording.format())} + ")";
  source.camera = recording.camera();
  source.frames = limited(recording.size(), s);
  source.ground_truth = recording.ground_truth();
  source.notes.assign(recording.notes().begin(), recording.notes().end());
  source.files = recording.files();
  return source;
}

template <class Frame>
result<Frame> moved(result<Frame> frame, const orbis::vec3& origin) {
  if (frame && frame->T_world_camera) {
    const orbis::se3& pose = *frame->T_world_camera;
    frame->T_world_camera = orbis::se3{pose.rotation(), pose.translation() - origin};
  }
  return frame;
}

result<frame_source> open_stereo_recording(const settings& s) {
  using orbis::io::stereo_format;
  orbis::io::stereo_recording_options options{.format = s.format == "kitti"   ? stereo_format::kitti
                                                        : s.format == "asl"   ? stereo_format::asl
                                                        : s.format == "pairs" ? stereo_format::pairs
                                                                              : stereo_format::automatic};
  const auto camera = camera_option(s);
  if (!camera) return fail(camera.error());
  options.camera = *camera;
  auto opened = orbis::io::open_stereo_recording(s.input, options);
  if (!opened) return fail(with_option(opened.error()));
  const auto recording = std::make_shared<const orbis::io::stereo_recording>(*std::move(opened));
  frame_source source = make_source(*recording, "stereo recording", s);
  source.sensor = sensor_kind::stereo;
  subtract_origin(source);
  source.frame = [recording, origin = source.origin, stride = s.stride](std::size_t i) -> result<source_frame> {
    auto pair = moved(recording->frame(i * stride), origin);
    if (!pair) return fail(pair.error());
    return with_right(*std::move(pair));
  };
  source.color = [recording, stride = s.stride](std::size_t i) { return recording->left(i * stride); };
  return source;
}

/// The name of a folder in `folder` that is a recording; empty if there is none.
std::string recording_in(const std::filesystem::path& folder) {
  std::string first;
  std::error_code failure;
  for (std::filesystem::directory_iterator it{folder, failure}, end; !failure && it != end; it.increment(failure)) {
    const std::string name = it->path().filename().string();
    if (is_recording(it->path()) && (first.empty() || name < first)) first = name;
  }
  return first;
}

/// A sentence about the recording that contains `folder`; empty if the parent folder is not a recording.
std::string recording_above(const std::filesystem::path& folder) {
  const auto above = std::filesystem::absolute(folder / "").lexically_normal().parent_path().parent_path();
  if (orbis::io::detect_format(above) == orbis::io::recording_format::automatic) return {};
  return "the parent folder " + above.string() + " is a recording with depth";
}

result<frame_source> open_recording(const settings& s) {
  using orbis::io::recording_format;
  orbis::io::recording_options options{.format = s.format == "tum"       ? recording_format::tum
                                                 : s.format == "7scenes" ? recording_format::seven_scenes
                                                 : s.format == "icl"     ? recording_format::icl_nuim
                                                 : s.format == "scannet" ? recording_format::scannet
                                                 : s.format == "folders" ? recording_format::folders
                                                                         : recording_format::automatic};
  std::optional<camera_file> file;
  auto opened = open_with_camera(
      s, options, [&](const auto& with) { return orbis::io::open_recording(s.input, with); }, file);
  if (!opened) {
    orbis::error e = with_option(opened.error());
    if (e.code == orbis::errc::unsupported && s.sensor == "auto" && s.format == "auto") {
      if (const std::string inner = recording_in(s.input); !inner.empty())
        return fail(e.code, e.where, "is not a recording, but contains one: open " + (s.input / inner).string());
      const auto add = [&](const char* sensor, const orbis::error& other) {
        constexpr std::string_view before = "known layouts: ";
        if (const std::size_t at = other.message.find(before); at != std::string::npos)
          e.message += sensor + other.message.substr(at + before.size());
      };
      if (const auto stereo = orbis::io::open_stereo_recording(s.input); !stereo)
        add(";\n  with two cameras ", stereo.error());
      if (const auto mono = orbis::io::open_mono_recording(s.input); !mono) add("; with one ", mono.error());
    }
    return fail(std::move(e));
  }

  const auto recording = std::make_shared<const orbis::io::recording>(*std::move(opened));
  frame_source source = make_source(*recording, "recording", s);
  if (recording->format() == recording_format::folders) {
    const auto folder = [](const std::filesystem::path& image) { return image.parent_path().filename().string(); };
    const auto& files = source.files;  // the images of the last frame are at the end
    source.images_of = folder(files[files.size() - 2]) + "/ and " + folder(files.back()) + "/";
  }
  add_camera_file(file, source);
  subtract_origin(source);
  source.frame = [recording, origin = source.origin, stride = s.stride](std::size_t i) -> result<source_frame> {
    auto frame = moved(recording->frame(i * stride), origin);
    if (!frame) return fail(frame.error());
    return with_depth(*std::move(frame));
  };
  source.color = [recording, stride = s.stride](std::size_t i) { return recording->color(i * stride); };
  return source;
}

/// Adds a note about folders whose names indicate depth images, which a recording of one camera does not use.
void note_depth_folders(const std::filesystem::path& folder, std::vector<std::string>& notes) {
  std::error_code failure;
  for (std::filesystem::directory_iterator it{folder, failure}, end; !failure && it != end; it.increment(failure)) {
    const std::string name = it->path().filename().string();
    std::error_code ignored;
    if (name.find("depth") != std::string::npos && it->is_directory(ignored))
      notes.push_back(
          "the folder " + name +
          "/ is not used: the recording is treated as one without depth. To use it, rename it to depth/ or list "
          "its images in depth.txt");
  }
}

result<frame_source> open_mono_recording(const settings& s) {
  using orbis::io::mono_format;
  orbis::io::mono_recording_options options{.format = s.format == "tum"      ? mono_format::tum
                                                      : s.format == "kitti"  ? mono_format::kitti
                                                      : s.format == "asl"    ? mono_format::asl
                                                      : s.format == "images" ? mono_format::images
                                                                             : mono_format::automatic};
  std::optional<camera_file> file;
  auto opened = open_with_camera(
      s, options, [&](const auto& with) { return orbis::io::open_mono_recording(s.input, with); }, file);
  if (!opened) {
    orbis::error e = with_option(opened.error());
    if (const std::string above = recording_above(s.input); s.sensor == "auto" && !above.empty())
      e.message = above + ": open that folder. Otherwise, " + e.message;
    return fail(std::move(e));
  }
  const auto recording = std::make_shared<const orbis::io::mono_recording>(*std::move(opened));
  frame_source source = make_source(*recording, "monocular recording", s);
  add_camera_file(file, source);
  if (s.sensor == "auto") {
    note_depth_folders(s.input, source.notes);
    if (const std::string above = recording_above(s.input); !above.empty()) source.notes.push_back(above);
  }
  source.sensor = sensor_kind::monocular;
  subtract_origin(source);
  source.color = [recording, stride = s.stride](std::size_t i) { return recording->color(i * stride); };
  source.frame = [recording, stride = s.stride](std::size_t i) -> result<source_frame> {
    auto frame = recording->frame(i * stride);
    if (!frame) return fail(frame.error());
    return without_depth(frame->timestamp, std::move(frame->color));
  };
  return source;
}

std::optional<sensor_kind> wanted_sensor(const settings& s) {
  if (s.sensor == "auto") return std::nullopt;
  return s.sensor == "stereo" ? sensor_kind::stereo : s.sensor == "mono" ? sensor_kind::monocular : sensor_kind::rgbd;
}

bool is_image(const std::filesystem::path& file) {
  const auto ending = file.extension();
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg";
}

/// The message for a file of results, which is not a recording; empty for other files.
std::string advice_on_results(const std::filesystem::path& file) {
  const auto ending = file.extension();
  if (ending == ".ply" || ending == ".pcd") return "is a point cloud, not a recording; use map";
  if (is_octree_file(file)) return "is an octree map, not a recording; use plan";
  return {};
}

result<frame_source> open_file(const settings& s) {
  if (std::string advice = advice_on_results(s.input); !advice.empty())
    return fail(orbis::errc::unsupported, s.input.string(), std::move(advice));
  if (is_image(s.input))
    return fail(orbis::errc::unsupported, s.input.string(),
                "is a single image; specify its folder, " + std::filesystem::absolute(s.input).parent_path().string());
  if (!is_bag(s.input) && is_text(s.input))
    return fail(
        orbis::errc::unsupported, s.input.string(),
        "is a text file, not a folder, a bag, or a video that OpenCV can read; for a recording with lists, specify its "
        "folder, " +
            std::filesystem::absolute(s.input).parent_path().string());
  const auto camera = camera_option(s);
  if (!camera) return fail(camera.error());
  const file_recording_options options{
      .sensor = wanted_sensor(s), .camera = *camera, .topics = s.topics, .truth_topic = s.truth_topic};
  auto opened = is_bag(s.input) ? open_bag(s.input, options) : open_video(s.input, options);
  if (!opened) return fail(with_option(opened.error()));
  const std::shared_ptr<const file_recording> recording = *std::move(opened);
  frame_source source;
  source.title = std::filesystem::weakly_canonical(s.input).filename().string();  // works for "folder/", too
  source.kind = recording->kind;
  source.images_of = recording->images_of;
  source.camera = recording->camera;
  source.sensor = recording->sensor;
  source.frames = limited(recording->size(), s);
  source.notes = recording->notes;
  source.files = recording->files;
  source.ground_truth = recording->ground_truth;
  source.truth_of = recording->truth_of;
  subtract_origin(source);
  source.frame = [recording, stride = s.stride](std::size_t i) { return recording->frame(i * stride); };
  source.color = [recording, stride = s.stride](std::size_t i) { return recording->color(i * stride); };
  return source;
}

/// The sensor in the settings, or else the sensor indicated by the files in the folder. A folder with depth and a
/// second camera counts as RGB-D.
sensor_kind choose_sensor(const settings& s) {
  if (const auto wanted = wanted_sensor(s)) return *wanted;
  if (s.format == "images") return sensor_kind::monocular;
  if (s.format == "kitti" || s.format == "asl" || s.format == "pairs") return sensor_kind::stereo;
  std::error_code ignored;
  for (const char* const depth : {"depth.txt", "depth"})
    if (std::filesystem::exists(s.input / depth, ignored)) return sensor_kind::rgbd;
  using orbis::io::recording_format;
  const auto with_depth = orbis::io::detect_format(s.input);
  const bool only_colour = with_depth == recording_format::tum && std::filesystem::exists(s.input / "rgb.txt", ignored);
  if (s.format != "auto" || (with_depth != recording_format::automatic && !only_colour)) return sensor_kind::rgbd;
  if (orbis::io::detect_stereo_format(s.input) != orbis::io::stereo_format::automatic) return sensor_kind::stereo;
  return orbis::io::detect_mono_format(s.input) != orbis::io::mono_format::automatic ? sensor_kind::monocular
                                                                                     : sensor_kind::rgbd;
}

/// Opens a camera: plays a folder as if it were a camera; opens a video camera if the device is a number or a file in
/// /dev, or if the sensor has no depth; otherwise opens an OpenNI2 device.
result<std::unique_ptr<camera_device>> open_device(const settings& s) {
  device_options options{.name = s.input.string(), .sensor = wanted_sensor(s)};
  const auto camera = camera_option(s);
  if (!camera) return fail(camera.error());
  options.camera = *camera;
  std::error_code ignored;
  if (std::filesystem::is_directory(s.input, ignored)) {
    options.sensor = choose_sensor(s);
    return open_playback(options);
  }
  const bool is_number = !options.name.empty() && options.name.find_first_not_of("0123456789") == std::string::npos;
  const bool wants_video = options.sensor && *options.sensor != sensor_kind::rgbd;
  if (is_number || wants_video || options.name.starts_with("/dev/")) return open_video_camera(options);
  return open_openni(options);
}

/// Returns true if most images in a folder have numbers in their names, as frames have and the pictures of a run do
/// not.
bool has_numbered_images(const std::filesystem::path& folder) {
  std::error_code ignored;
  std::size_t numbered = 0, others = 0;
  for (const auto& entry : std::filesystem::directory_iterator{folder, ignored}) {
    if (!is_image(entry.path())) continue;
    const std::string name = entry.path().stem().string();
    ++(name.find_first_of("0123456789") == std::string::npos ? others : numbered);
  }
  return numbered > others;
}

/// Returns true if a folder contains the results of a run and no recording.
bool is_result_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::exists(folder / "trajectory.txt", ignored) &&
         std::filesystem::exists(folder / "camera_used.toml", ignored) && !is_recording(folder) &&
         !has_numbered_images(folder);
}

/// A camera that starts at the first request for a frame.
struct lazy_live_source {
  std::unique_ptr<camera_device> device;
  std::optional<live_source> live;
};

result<frame_source> open_live(const settings& s) {
  auto opened = open_device(s);
  if (!opened) return fail(with_option(opened.error()));
  const auto feed = std::make_shared<lazy_live_source>();
  feed->device = *std::move(opened);
  frame_source source;
  source.title = feed->device->name;
  source.sensor = feed->device->sensor;
  source.kind = source.is_stereo() ? "stereo camera" : source.is_monocular() ? "camera" : "depth camera";
  source.camera = feed->device->camera;
  source.is_live = source.made = true;
  source.frames = s.frames == 0 ? std::numeric_limits<std::size_t>::max() : s.frames;
  source.notes = feed->device->notes;
  source.files = feed->device->files;
  source.frame = [feed](std::size_t) {
    if (!feed->live) feed->live.emplace(std::move(feed->device));
    return feed->live->next([] { return interrupts::stop_requested(); });
  };
  source.color = [name = source.title](std::size_t) -> result<orbis::image<orbis::rgb8>> {
    return fail(orbis::errc::unreadable, name, "a live frame cannot be read again");
  };
  source.dropped = [feed] { return feed->live ? feed->live->dropped() : std::size_t{0}; };
  return source;
}

/// A synthetic recording whose textures, which take most of its memory, can be released.
class renderer {
 public:
  explicit renderer(const orbis::io::synthetic_options& options) : options_{options} {}
  [[nodiscard]] std::shared_ptr<const orbis::io::synthetic_recording> get() {
    const std::lock_guard lock{mutex_};
    if (!recording_) recording_ = std::make_shared<const orbis::io::synthetic_recording>(options_);
    return recording_;
  }
  void drop() {
    const std::lock_guard lock{mutex_};
    recording_.reset();
  }

 private:
  orbis::io::synthetic_options options_;
  std::mutex mutex_;
  std::shared_ptr<const orbis::io::synthetic_recording> recording_;
};

/// Puts the camera on a robot that walks through a dim room.
void make_walk(orbis::io::synthetic_options& options) {
  options.scene.light = 0.6;
  options.path.jitter = 0.0;  // the camera is not hand-held
  options.path.gait.step_rate = 2.0;
  options.sensor.motion_blur = 6;
  options.sensor.depth_blur = 4;
  options.sensor.shutter = {.color_read_out = 0.02, .depth_read_out = 0.02};
}

frame_source make_synthetic(const settings& s) {
  constexpr std::size_t round = 360;  // one degree per frame
  const orbis::io::synthetic_path_options path{.sees_floor = !s.plain};
  const auto rounds = static_cast<std::size_t>(path.rounds());
  const std::size_t frames = s.frames == 0 ? rounds * round : std::min<std::size_t>(s.frames * s.stride, 1'000'000);
  const bool person = s.person || !s.plain;
  const auto width = static_cast<int>(s.width / 4 * 4);
  orbis::io::synthetic_options options{.frames = static_cast<int>(frames),
                                       .seed = s.seed,
                                       .width = width,
                                       .height = width / 4 * 3,
                                       .frames_around = static_cast<int>(std::max(frames / rounds, round)),
                                       .scene = {.person = person},
                                       .path = path,
                                       .sensor = {.stray_depths = s.plain ? 0.0 : 0.001}};
  if (s.walk) make_walk(options);
  const auto recording = std::make_shared<const orbis::io::synthetic_recording>(options);  // renders no images
  const auto frames_of = std::make_shared<renderer>(options);
  frame_source source;
  source.title = s.walk ? "synthetic room, walking robot" : "synthetic room";
  source.kind = "rendered on the fly, seed " + std::to_string(s.seed) + (person ? ", with a person" : "") +
                (s.sensor == "stereo" ? ", stereo"
                 : s.sensor == "mono" ? ", one camera"
                                      : "");
  source.sensor = s.sensor == "stereo" ? sensor_kind::stereo
                  : s.sensor == "mono" ? sensor_kind::monocular
                                       : sensor_kind::rgbd;
  source.camera = source.is_stereo() ? recording->stereo_camera() : recording->camera();
  source.frames = limited(recording->size(), s);
  source.frame = [frames_of, stride = s.stride, stereo = source.is_stereo(),
                  mono = source.is_monocular()](std::size_t i) -> result<source_frame> {
    if (stereo) {
      auto pair = frames_of->get()->stereo_frame(i * stride);
      if (!pair) return fail(pair.error());
      return with_right(*std::move(pair));
    }
    auto frame = frames_of->get()->frame(i * stride);
    if (!frame) return fail(frame.error());
    return mono ? without_depth(frame->timestamp, std::move(frame->color)) : with_depth(*std::move(frame));
  };
  source.made = true;
  source.rest = [frames_of] { frames_of->drop(); };
  source.color = [frame = source.frame](std::size_t i) -> result<orbis::image<orbis::rgb8>> {
    auto rendered = frame(i);
    if (!rendered) return fail(rendered.error());
    return std::move(rendered->color);
  };
  source.ground_truth = recording->ground_truth();
  source.surface_distance = [recording](const orbis::vec3& p) { return recording->surface_distance(p); };
  return source;
}

/// Adds a note if voxels are so small that inserting a frame takes seconds, and fails if one frame alone may exhaust
/// the memory. The estimate is the largest one among a few frames; if all frames together exhaust the memory, the run
/// abandons the map.
result<void> check_resolution(frame_source& source, const settings& s) {
  const orbis::camera::intrinsics& k = source.camera.model.k();
  if (source.frames == 0 || source.is_monocular() || source.is_live) return {};  // live frames cannot be read twice
  if (!examples::voxels_of_depth(k, [&](std::size_t) { return source.depth_limit(s); }).takes_long(s.resolution))
    return {};
  const std::size_t samples = std::min<std::size_t>(4, source.frames);
  std::string of_largest;
  double most = 0.0;
  for (std::size_t sample = 0; sample != samples; ++sample) {
    const std::size_t i = sample * source.frames / samples;
    auto frame = source.frame(i);
    if (!frame) break;  // tracking reports the error
    source.complete(*frame);
    const auto pixels = frame->depth.pixels();
    const auto voxels = examples::voxels_of_depth(k, [&](std::size_t p) {
      const double z = pixels[p] / frame->depth_scale;
      return z > source.depth_limit(s) ? 0.0 : z;
    });
    if (!voxels.takes_long(s.resolution) || voxels.voxels(s.resolution) <= most) continue;
    const std::string name = i == 0 ? "the first frame" : "frame " + std::to_string(i + 1);
    of_largest = voxels.describe(s.resolution, name + " alone");
    most = voxels.voxels(s.resolution);
    if (voxels.is_too_large(s.resolution, examples::free_memory()))
      return fail(orbis::errc::invalid_argument, "--resolution", of_largest + ", which is too many");
  }
  if (!of_largest.empty()) source.notes.push_back(of_largest + "; this takes a long time");
  return {};
}

/// Reads the first frame, so that images that do not match the camera are reported before tracking starts, and adds a
/// note if depths are so implausible that the depth scale must be wrong.
result<void> check_images(frame_source& source, const settings& s) {
  if (source.frames == 0 || source.is_live || source.made) return {};
  constexpr std::size_t samples = 4;
  for (std::size_t sample = 0; sample != samples; ++sample) {
    const std::size_t i = sample * source.frames / samples;
    const auto frame = source.frame(i);
    if (!frame && sample != 0) return {};  // tracking reports the error
    if (!frame) {
      orbis::error e = frame.error();
      if (e.message.find("pixels, but the camera has") != std::string::npos)
        e.message += "; use a camera of this size (--camera)";
      return fail(std::move(e));
    }
    if (source.sensor != sensor_kind::rgbd) return {};
    std::vector<std::uint16_t> depths;
    for (const std::uint16_t d : frame->depth.pixels())
      if (d != 0 && d != 65535) depths.push_back(d);
    if (depths.size() < frame->depth.pixels().size() / 100) continue;  // try a later frame
    const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
    std::nth_element(depths.begin(), middle, depths.end());
    constexpr double nearest = 0.2;
    const double farthest = std::min(20.0, source.depth_limit(s));
    const double metres = *middle / frame->depth_scale;
    source.median_depth = metres;
    if (metres >= nearest && metres <= farthest) return {};
    char text[400];
    int length = std::snprintf(text, sizeof text, "the median depth of frame %zu is %.*f m (%d / depth_scale %.6g)", i,
                               metres < 10.0 ? 2 : 0, metres, static_cast<int>(*middle), frame->depth_scale);
    for (const double scale : {1000.0, 5000.0, 10000.0, 100.0})
      if (*middle / scale >= nearest && *middle / scale <= farthest) {
        length += std::snprintf(text + length, sizeof text - static_cast<std::size_t>(length),
                                "; with depth_scale %.6g it would be %.2f m", scale, *middle / scale);
        break;
      }
    if (metres > farthest && metres <= 20.0)
      std::snprintf(text + length, sizeof text - static_cast<std::size_t>(length),
                    ". Depths above %.3g m are not used for the map (--max-depth)", farthest);
    source.notes.push_back(text +
                           std::string{". Check depth_scale of the camera: stored depth / depth_scale = metres"});
    return {};
  }
  if (source.sensor == sensor_kind::rgbd) source.notes.emplace_back("the depth images contain almost no measurements");
  return {};
}

std::string describe(const frame_source& source) {
  return source.title + ": " +
         (source.is_live ? "live camera"
                         : std::to_string(source.frames) + (source.frames == 1 ? " frame" : " frames")) +
         ", " + std::to_string(source.camera.model.width()) + " x " + std::to_string(source.camera.model.height()) +
         (source.images_of.empty() ? "" : ", images from " + source.images_of) +
         (source.ground_truth.empty() ? "" : ", with ground truth") +
         (source.truth_of.empty() ? "" : " from " + source.truth_of) +
         (source.median_depth ? ", median depth " + text("%.2f m", *source.median_depth) : "");
}

}  // namespace

std::string origin_note(const orbis::vec3& origin) {
  char text[1200];  // doubles may have 309 digits
  std::snprintf(text, sizeof text,
                "the coordinates are far from their origin: all results are relative to (%.0f, %.0f, %.0f)", origin.x(),
                origin.y(), origin.z());
  return text;
}

bool is_text(const std::filesystem::path& path) {
  std::ifstream in{path, std::ios::binary};
  std::string begin(1024, '\0');
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(in.gcount()));
  return !begin.empty() && std::none_of(begin.begin(), begin.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\r' && c != '\t' && c != '\f';
  });
}

bool is_recording(const std::filesystem::path& path) {
  using namespace orbis::io;
  const mono_format mono = detect_mono_format(path);
  return detect_format(path) != recording_format::automatic || detect_stereo_format(path) != stereo_format::automatic ||
         (mono != mono_format::automatic && mono != mono_format::images) || is_bag(path);
}

result<frame_source> open_source(const settings& s, console& console) {
  console.stage("opening");
  std::error_code ignored;
  const auto open = [&] {
    if (s.what == command::live) return open_live(s);
    const bool bag = is_bag(s.input);
    if ((!s.topics.empty() || !s.truth_topic.empty()) && !bag)
      return result<frame_source>{fail(orbis::errc::invalid_argument, s.topics.empty() ? "--truth-topic" : "--topics",
                                       "needs a ROS bag, but " + s.input.string() + " is not a bag")};
    if (bag || std::filesystem::is_regular_file(s.input, ignored)) return open_file(s);
    if (!std::filesystem::exists(s.input, ignored) && s.input.has_extension())
      return result<frame_source>{fail(orbis::errc::not_found, s.input.string(), "no such file or folder")};
    if (is_result_folder(s.input) && s.sensor == "auto" && s.format == "auto")
      return result<frame_source>{
          fail(orbis::errc::unsupported, s.input.string(), "contains the results of a run, not a recording")};
    switch (choose_sensor(s)) {
      case sensor_kind::stereo: return open_stereo_recording(s);
      case sensor_kind::monocular: return open_mono_recording(s);
      default: return open_recording(s);
    }
  };
  auto source = s.what == command::demo ? result<frame_source>{make_synthetic(s)} : open();
  if (!source) return source;
  if (auto fits = check_images(*source, s); !fits) return fail(fits.error());
  if (source->is_stereo()) {
    // Up to this depth, a quarter of a pixel of disparity corresponds to about 1 % of the depth.
    constexpr double baselines = 20.0;
    source->usual_max_depth = std::max(source->usual_max_depth, baselines * source->camera.baseline.value_or(0.0));
    // The depth image is in millimetres, or in coarser steps if 16 bits of millimetres do not cover the range.
    source->camera.depth_scale = std::min(1000.0, 65000.0 / source->depth_limit(s));
  }
  if (source->is_monocular()) {
    const bool rolls =
        s.read_out_ms ? *s.read_out_ms != 0.0 : !source->camera.shutter.value_or(orbis::camera::shutter{}).is_global();
    if (rolls) source->notes.emplace_back("the rolling shutter of a monocular camera is not corrected");
  }
  if (!s.localize_only)
    if (auto fine = check_resolution(*source, s); !fine) return fail(fine.error());
  console.finish(describe(*source));
  for (const std::string& note : source->notes) console.warn(note);
  return source;
}

void frame_source::complete(source_frame& f) const {
  if (!is_stereo() || !f.depth.empty()) return;
  f.depth = stereo_depth(f.color.view(), f.right.view(), camera);
  f.depth_scale = camera.depth_scale;
}

result<source_frame> read_ahead::next() {
  auto frame = ahead_.valid() ? ahead_.get() : source_.frame(at_);
  ++at_;
  if (background_ && has_next()) ahead_ = thread_.start([this, i = at_] { return source_.frame(i); });
  return frame;
}

}  // namespace app

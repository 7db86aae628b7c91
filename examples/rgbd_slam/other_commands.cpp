// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <orbis/camera/depth_clock.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/eval/ate.hpp>
#include <orbis/eval/orientations.hpp>
#include <orbis/io/cloud_fields.hpp>
#include <orbis/io/trajectory_file.hpp>

#include "../common/memory.hpp"
#include "../common/near_origin.hpp"
#include "../common/voxel_estimate.hpp"
#include "accuracy.hpp"
#include "commands.hpp"
#include "corrected_frame.hpp"
#include "filters.hpp"
#include "formatted_text.hpp"
#include "map_stage.hpp"
#include "navigation.hpp"
#include "output.hpp"
#include "result_files.hpp"
#include "smooth_frame.hpp"
#include "source.hpp"
#include "summary.hpp"
#include "tracking_stage.hpp"
#include "upright_world.hpp"

namespace app {
namespace {

/// The camera's twist at a given time, computed from the ground truth; zero if no poses around that time are known.
orbis::vec6 twist_at(const orbis::trajectory& truth, double time) {
  constexpr double around = 0.02, longest_gap = 0.2;  // seconds
  const auto before = orbis::interpolate(truth, time - around, longest_gap, 0.0);
  const auto after = orbis::interpolate(truth, time + around, longest_gap, 0.0);
  if (!before || !after) return orbis::vec6::Zero();
  return (before->inverse() * *after).log() / (2.0 * around);
}

/// All frames with a ground-truth pose.
orbis::result<posed_frames> frames_with_poses(const frame_source& source, const settings& s,
                                              const std::filesystem::path& spill_file,
                                              std::optional<world_results>& world, console& console) {
  if (source.truth_has_positions_only)
    return orbis::fail(
        orbis::errc::unsupported, s.input.string(),
        "all orientations in the ground truth are equal (0 0 0 1), as in files with positions only, which "
        "cannot place depth images; use run");
  console.stage("reading");
  const auto shutter = source.camera.shutter.value_or(orbis::camera::shutter{});
  posed_frames posed{source, s, spill_file};
  frame_correction correct{source.camera.model};
  frame_smoother smooth{source};
  orbis::camera::depth_clock clock;
  orbis::se3 T_world_truth;
  read_ahead frames{source, s.threads != 1};
  for (std::size_t i = 0; frames.has_next(); ++i) {
    auto frame = frames.next();
    if (!frame) return orbis::fail(frame.error());
    const double depth_delay = clock.update(frame->timestamp, frame->depth_timestamp);
    if (frame->T_world_camera) {
      source.complete(*frame);
      if (posed.size() == 0) {
        upright_worlds worlds{source, s};
        T_world_truth = worlds.start_world(*frame, true) * frame->T_world_camera->inverse();
        world = worlds.world_starting_at(frame->timestamp);
        if (world->up_from == "ground truth") T_world_truth = {};
      }
      orbis::slam::frame_motion motion{shutter, twist_at(source.ground_truth, frame->timestamp)};
      motion.shutter.depth_delay += depth_delay;
      const orbis::camera::rgbd_frame& at_once = correct(*frame, motion);
      posed.add(i, T_world_truth * *frame->T_world_camera, &at_once == &*frame ? orbis::slam::frame_motion{} : motion,
                smooth(at_once.depth, motion), at_once.color);
    }
    console.advance(i + 1, source.frames);
  }
  if (posed.size() == 0)
    return orbis::fail(orbis::errc::no_data, s.input.string(),
                       source.ground_truth.empty() ? "has no ground truth, and map needs poses; run estimates them"
                                                   : "no frame has a pose in the ground truth");
  console.finish(std::to_string(posed.size()) + " of " + std::to_string(source.frames) + " frames have a pose");
  return posed;
}

struct mapped {
  results r;
  built_map map;
  orbis::trajectory cameras;
};

orbis::result<mapped> map_recording(const frame_source& source, const settings& s, const std::filesystem::path& folder,
                                    console& console) {
  std::optional<world_results> world;
  const auto posed = frames_with_poses(source, s, folder / spill_name, world, console);
  if (!posed) return orbis::fail(posed.error());
  auto map = map_frames(*posed, source, nullptr, s, console);
  if (!map) return orbis::fail(map.error());
  results r = begin_results(s, source.title, &source, folder);
  r.world = world;
  if (orbis::eval::has_equal_orientations(source.ground_truth))
    console.warn(r.warnings.emplace_back(
        "all orientations in the ground truth are equal: if the camera turned, the map is wrong; use run"));
  for (const std::string& note : mapping_notes(*posed, world)) console.warn(r.warnings.emplace_back(note));
  r.truth_note = "Mapped with the ground-truth poses.";
  return mapped{std::move(r), *std::move(map), posed->trajectory()};
}

/// Removes NaN points, which organised clouds have at pixels without measurement.
void keep_finite(orbis::point_cloud& cloud) {
  std::vector<std::uint32_t> finite;
  for (std::size_t i = 0; i != cloud.size(); ++i)
    if (orbis::is_finite(cloud.points[i])) finite.push_back(static_cast<std::uint32_t>(i));
  if (finite.size() != cloud.size()) cloud = orbis::cloud::extract(cloud, finite);
}

/// Warns if voxels are so small that the rays to the points take a long time, and fails if the map may fill the memory.
orbis::result<void> check_resolution(const std::vector<orbis::vec3f>& points, const orbis::vec3& origin,
                                     const settings& s, results& r, console& console) {
  examples::voxel_estimate rays;
  double longest = 0.0;
  for (const orbis::vec3f& p : points) {
    const double length = std::min((p.cast<double>() - origin).norm(), s.depth_limit());
    rays.add(length, 0.0);
    longest = std::max(longest, length);
  }
  rays.add(0.0, 4.0 / 3.0 * std::numbers::pi * longest * longest * longest);  // all rays are within a ball
  if (!rays.takes_long(s.resolution)) return {};
  const std::string text = rays.describe(s.resolution, "the space between origin and points");
  if (rays.is_too_large(s.resolution, examples::free_memory()))
    return orbis::fail(orbis::errc::invalid_argument, "--resolution", text + ", which is too many");
  console.warn(r.warnings.emplace_back(text + "; this takes a long time"));
  return {};
}

/// The first option in the settings that concerns recordings only; empty if there is none.
std::string option_of_recordings(const settings& s) {
  return s.sensor != "auto"       ? "--sensor"
         : s.format != "auto"     ? "--format"
         : !s.topics.empty()      ? "--topics"
         : !s.truth_topic.empty() ? "--truth-topic"
         : !s.camera.empty()      ? "--camera"
         : s.frames != 0          ? "--frames"
         : s.stride != 1          ? "--stride"
         : s.gravity.has_value()  ? "--gravity"
                                  : "";
}

orbis::result<mapped> map_cloud_file(const settings& s, const std::filesystem::path& folder, console& console) {
  if (filter_options(s).kind == orbis::mapping::filter_kind::ray_evidence)
    return orbis::fail(orbis::errc::invalid_argument, s.input.string(),
                       "the ray-evidence filter needs a recording: a cloud has no depth images");
  console.stage("reading");
  auto found = examples::read_near_origin(s.input);
  if (!found) return orbis::fail(found.error());
  auto& [read, origin] = *found;
  if (!read.fields.empty()) read.notes.push_back("not used: " + orbis::io::field_names(read.fields));
  read.fields.clear();
  orbis::point_cloud& cloud = read.cloud;
  const std::size_t in_file = cloud.size();
  keep_finite(cloud);
  if (cloud.empty()) return orbis::fail(orbis::errc::no_data, s.input.string(), "the cloud has no finite points");
  const std::string name = s.input.filename().string();
  const std::string left_out =
      in_file == cloud.size() ? "" : ", " + count_text(in_file - cloud.size()) + " without coordinates omitted";
  console.finish(name + ": " + count_text(cloud.size()) + " points" + left_out);
  results r = begin_results(s, name, nullptr, folder);
  r.setup.emplace_back("points", count_text(cloud.size()) + left_out);
  r.truth_note = "A cloud, without SLAM.";
  for (const std::string& note : read.notes) console.warn(r.warnings.emplace_back(s.input.string() + ": " + note));
  settings moved = s;
  r.origin = origin;
  if (!origin.isZero()) console.warn(r.warnings.emplace_back(origin_note(origin)));
  if (moved.origin) {
    *moved.origin -= origin;
    if (auto fine = check_resolution(cloud.points, *moved.origin, s, r, console); !fine)
      return orbis::fail(fine.error());
  }
  return mapped{std::move(r), map_cloud(std::move(cloud), moved, console), {}};
}

/// Sets the times of poses in KITTI's layout to those in `times.txt`. If both trajectories are in this layout, the line
/// numbers remain their times.
orbis::result<void> complete_times(const settings& s, orbis::io::trajectory_reading& estimate,
                                   orbis::io::trajectory_reading& truth, std::vector<std::string>& warnings) {
  const auto has_times = [](const auto& read) { return read.layout != orbis::io::trajectory_layout::kitti; };
  const auto lines = [](const auto& read) { return read.poses.size() + read.lost; };
  if (!has_times(estimate) && !has_times(truth)) {
    warnings.push_back("poses are compared line by line");
    if (lines(estimate) != lines(truth))
      warnings.push_back(s.input.string() + " has " + std::to_string(lines(estimate)) + " poses, " +
                         s.reference.string() + " " + std::to_string(lines(truth)));
    return {};
  }
  for (const auto& [read, path] : {std::pair{&estimate, &s.input}, std::pair{&truth, &s.reference}}) {
    if (has_times(*read)) continue;
    std::error_code ignored;
    auto times = path->parent_path() / "times.txt";
    if (const auto benchmark = path->parent_path() / ".." / "sequences" / path->stem() / "times.txt";
        !std::filesystem::exists(times, ignored) && std::filesystem::exists(benchmark, ignored))
      times = benchmark;
    if (!std::filesystem::exists(times, ignored))
      return orbis::fail(
          orbis::errc::no_data, path->string(),
          "the poses have no times (KITTI's layout); put times.txt, one time per line, next to the file");
    if (auto set = orbis::io::set_times(*read, times); !set) return set;
    warnings.push_back(path->string() + ": the times are those in " + times.lexically_normal().string());
  }
  return {};
}

}  // namespace

exit_code evaluate(const settings& s, console& console) {
  const auto give_up = [&](const orbis::error& e) { return console.error(e), bad_input; };
  for (const std::filesystem::path& path : {s.input, s.reference}) {
    if (const auto folder = needs_file(path, "trajectory.txt")) return give_up(*folder);
    std::ifstream file;  // reading only from files that can be read twice
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored)) file.open(path);
    if (file.is_open() && file.peek() != EOF && !is_text(path))
      return give_up({orbis::errc::unsupported, path.string(), "is not a trajectory: trajectories are text files"});
  }
  auto estimate = orbis::io::read_trajectory_file(s.input);
  if (!estimate) return give_up(estimate.error());
  auto truth = orbis::io::read_trajectory_file(s.reference);
  if (!truth) return give_up(truth.error());
  for (const auto& [read, path] : {std::pair{&estimate, &s.input}, std::pair{&truth, &s.reference}})
    if ((*read)->poses.empty()) return give_up({orbis::errc::no_data, path->string(), "contains no poses"});
  std::vector<std::string> warnings = std::move(estimate->notes);
  warnings.insert(warnings.end(), truth->notes.begin(), truth->notes.end());
  if (auto timed = complete_times(s, *estimate, *truth, warnings); !timed) return give_up(timed.error());
  const auto compared = compare(estimate->poses, truth->poses, s.with_scale);
  if (compared && s.json && !compared->no_rpe.empty()) warnings.push_back("no RPE: " + compared->no_rpe);
  const std::string units = orbis::io::describe_units(estimate->poses, truth->poses);
  if (compared && !units.empty())
    warnings.push_back("only " + std::to_string(compared->poses.size()) + " poses have a reference pose; " + units);
  if (compared && !s.with_scale) {
    constexpr double clear = 1.1;  // ratio of lengths that a trajectory with depth does not have
    const auto scaled = orbis::eval::ate(estimate->poses, truth->poses, {.with_scale = true});
    const double scale = scaled ? scaled->aligned.scale : 1.0;
    if ((scale > clear || scale < 1.0 / clear) && 2.0 * scaled->translation.rmse < compared->ate_rmse_m)
      warnings.push_back(text("%s: scaled by %.4g, its ATE would be %.4f m; use --scale if its unit is arbitrary",
                              s.input.string().c_str(), scale, scaled->translation.rmse));
  }
  for (const std::string& warning : warnings) console.warn(warning);
  if (!compared) {
    orbis::error e{compared.error().code, s.input.string() + " and " + s.reference.string(), compared.error().message};
    if (e.code == orbis::errc::no_data)
      e.message += "; the times are " + orbis::io::describe_spans(estimate->poses, truth->poses);
    return give_up(e);
  }
  std::string lines = s.json ? accuracy_json(*compared, warnings) : accuracy_lines(*compared) + "\n";
  lines.pop_back();
  if (!console.print(lines)) return give_up({orbis::errc::write_failed, "standard output", "cannot be written"});
  return done;
}

exit_code map_without_slam(const settings& s, console& console) {
  const auto give_up = [&](const orbis::error& e) { return console.error(e), bad_input; };
  std::error_code ignored;
  std::optional<frame_source> recording;
  if (std::filesystem::is_directory(s.input, ignored)) {
    auto source = open_source(s, console);
    if (!source) return give_up(source.error());
    if (source->is_monocular())
      return give_up({orbis::errc::unsupported, s.input.string(), "a monocular recording cannot produce a map"});
    recording = *std::move(source);
  } else if (const std::string option = option_of_recordings(s);
             !option.empty() && std::filesystem::exists(s.input, ignored)) {
    return console.error(
               {orbis::errc::invalid_argument, option, "needs a recording; " + s.input.string() + " is none"}),
           bad_usage;
  } else if (is_octree_file(s.input)) {
    return give_up({orbis::errc::unsupported, s.input.string(), "is an octree map already; plan finds paths in it"});
  }
  const auto inputs = input_files(s, recording ? recording->files : std::vector<std::filesystem::path>{});
  if (const auto conflict = find_overwritten(s, inputs)) return console.error(*conflict), bad_usage;
  auto files = result_files::begin(s);
  if (!files) return console.error(files.error()), code_of(files.error());

  const auto give_up_with = [&](const orbis::error& e) { return give_up(files->with_final_path(e)); };
  auto found =
      recording ? map_recording(*recording, s, files->folder(), console) : map_cloud_file(s, files->folder(), console);
  if (!found) return give_up(found.error());
  auto navigation = navigate(found->map.octree, found->cameras, s, files->folder(), files->floor_map(), console);
  if (!navigation) return give_up_with(navigation.error());
  const auto& unsaved = found->r.navigation.emplace(*std::move(navigation)).unsaved;
  if (unsaved) found->r.warnings.push_back(unsaved->to_string());
  auto written = write_map(std::move(found->map), s, files->folder(), console);
  if (!written) return give_up_with(written.error());
  found->r.map = *std::move(written);
  if (auto done = write_report_files(found->r, found->cameras, files->lists(), console); !done)
    return give_up_with(done.error());
  if (auto done = files->put_in_place(); !done) return give_up(done.error());
  print_results(found->r, console);
  return unsaved ? give_up(*unsaved) : done;
}

}  // namespace app

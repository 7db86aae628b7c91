// SPDX-License-Identifier: BSD-3-Clause
#include "output.hpp"

#include <cstdio>
#include <utility>

#include <orbis/io/camera_file.hpp>
#include <orbis/io/trajectory_file.hpp>

#include "filters.hpp"
#include "plots.hpp"
#include "report.hpp"
#include "result_files.hpp"
#include "shutter_stage.hpp"
#include "summary.hpp"
#include "view_frame.hpp"

namespace app {

using orbis::result;

namespace {

/// Lists the files of this run and the remaining files of earlier runs. `coming`: files that are not written yet.
void list_files(results& r, const file_lists& files, file_names coming, console& console) {
  std::error_code ignored;
  for (std::filesystem::directory_iterator it{r.folder, ignored}, end; !ignored && it != end; it.increment(ignored))
    coming.push_back(it->path().filename().string());
  r.files = files.made(coming);
  const auto known = std::exchange(r.files_of_earlier_runs, files.of_earlier_runs(r.files));
  if (r.files_of_earlier_runs == known) return;
  std::string names;
  for (const std::string& name : r.files_of_earlier_runs) names += (names.empty() ? "" : ", ") + name;
  console.warn(r.warnings.emplace_back("unchanged files from an earlier run: " + names));
}

}  // namespace

results begin_results(const settings& s, const std::string& title, const frame_source* source,
                      const std::filesystem::path& folder) {
  constexpr const char* names[] = {"run", "demo", "eval", "map", "plan", "calibrate", "live", "benchmark"};
  results r;
  r.command = names[static_cast<int>(s.what)];
  r.title = title;
  r.profile = s.profile;
  r.folder = folder;
  r.out = s.out;
  const auto number = [](const char* format, double v) {
    char buffer[64];
    std::snprintf(buffer, sizeof buffer, format, v);
    return std::string{buffer};
  };
  if (source != nullptr) {
    r.origin = source->origin;
    const auto& camera = source->camera;
    const auto& k = camera.model.k();
    r.setup.emplace_back("input", source->kind);
    r.images_of = source->images_of;
    if (!source->images_of.empty()) r.setup.emplace_back("images from", source->images_of);
    r.setup.emplace_back("camera",
                         std::string{camera.model.model_name()} + ", " + std::to_string(k.width) + " x " +
                             std::to_string(k.height) + number(", fx %.1f", k.fx) + number(", fy %.1f", k.fy) +
                             number(", cx %.1f", k.cx) + number(", cy %.1f", k.cy) +
                             (source->camera_is_refined ? " (calibrated with the recording)" : "") +
                             (source->is_monocular() ? "" : number(", depth / %g = metres", camera.depth_scale)));
    r.setup.emplace_back("frames", source->is_live ? "live"
                                                   : std::to_string(source->frames) +
                                                         (s.stride > 1 ? ", stride " + std::to_string(s.stride) : ""));
    if (s.what != command::map) {
      if (!s.load_map.empty())
        r.setup.emplace_back("landmark map",
                             "loaded from " + s.load_map.filename().string() + (s.localize_only ? ", unchanged" : ""));
      r.setup.emplace_back("landmark mapping", s.localize_only                     ? "none"
                                               : s.deterministic || s.threads == 1 ? "between frames"
                                                                                   : "in parallel with tracking");
    }
    r.warnings = source->notes;
  } else {
    r.setup.emplace_back("input", s.input.filename().string());
    r.setup.emplace_back("rays", s.origin ? number("from %g, ", s.origin->x()) + number("%g, ", s.origin->y()) +
                                                number("%g", s.origin->z())
                                          : "none: points are marked occupied, no space is marked free");
  }
  if (s.profile != "default") r.setup.emplace_back("profile", s.profile);
  if (s.localize_only || (source != nullptr && source->is_monocular())) return r;
  r.setup.emplace_back(
      "octree", number("%g cm voxels", 100 * s.resolution) +
                    number(", measurements up to %g m", source != nullptr ? source->depth_limit(s) : s.depth_limit()));
  r.setup.emplace_back("requested filter", describe_filter(s));
  return r;
}

result<void> write_trajectories(const slam_results& slam, const std::filesystem::path& folder) {
  if (auto done = orbis::io::write_trajectory(folder / "trajectory.txt", slam.trajectory); !done) return done;
  for (std::size_t i = 0; i != slam.other_maps.size() && i + 2 <= most_maps; ++i)
    if (auto done = orbis::io::write_trajectory(folder / trajectory_name(i + 2), slam.other_maps[i]); !done)
      return done;
  return orbis::io::write_trajectory(folder / "keyframes.txt", slam.keyframes);
}

result<void> write_camera_used(const frame_source& source, const shutter_results& shutter,
                               const std::filesystem::path& folder) {
  return orbis::io::write_camera(folder / "camera_used.toml", with_shutter(source.camera, shutter));
}

result<void> write_report_files(results& r, const orbis::trajectory& cameras, const file_lists& files,
                                console& console) {
  console.stage("report");
  if (r.map && r.map->kept.empty() && !r.map->cloud.empty())
    console.warn(r.warnings.emplace_back("the filter removed all points; the map is empty"));
  std::vector<orbis::vec3f> points;
  if (r.map) {
    for (const voxel& v : r.map->voxels) points.push_back(v.center);
  } else if (r.slam) {
    for (const auto& p : r.slam->trajectory) points.push_back(p.T_world_camera.translation().cast<float>());
  }
  const view_frame frame = find_view_frame(points, cameras, height_of_floor(r));
  if (auto done = write_pictures(r, frame); !done) return done;
  list_files(r, files, {"summary.json", "report.html"}, console);
  r.wall_s = console.total();
  if (auto done = write_report(r, frame); !done) return done;
  r.wall_s = console.total();
  if (auto done = write_summary(r); !done) return done;
  console.finish("pictures, report.html, summary.json");
  return {};
}

result<void> write_summary_only(results& r, const file_lists& files, console& console) {
  list_files(r, files, {"summary.json"}, console);
  r.wall_s = console.total();
  return write_summary(r);
}

orbis::error explain_no_start(const results& r, const settings& s) {
  const std::string frames = "the " + std::to_string(r.slam->frames) + " frames ";
  return {orbis::errc::no_data, s.what == command::run ? s.input.string() : r.title,
          r.slam->sensor == orbis::slam::sensor_kind::monocular
              ? "tracking never started: no two of " + frames + "have enough matching features and parallax"
              : "tracking never started: none of " + frames + "has enough features with depth"};
}

exit_code report_no_start(results& r, const orbis::error& why, exit_code code, result_files& files, console& console) {
  auto done = write_summary_only(r, files.lists(), console);
  if (done) done = files.put_in_place();
  if (!done) return console.error(done.error()), bad_input;
  console.error(why);
  return code;
}

void print_results(const results& r, console& console) {
  std::string text;
  if (r.map) text.append("\n").append(size_table(*r.map)).append("\n\n").append(filter_lines(*r.map)).append("\n");
  if (r.world) text.append("\n  World  ").append(world_text(*r.world)).append("\n");
  if (r.against_truth) text.append("\n").append(accuracy_lines(*r.against_truth)).append("\n");
  if (r.navigation) text.append("\n").append(navigation_lines(*r.navigation)).append("\n");
  if (r.map && r.map->error_m) {
    char buffer[96];
    std::snprintf(buffer, sizeof buffer, "  Map  RMS %.4f m to the true surface\n", *r.map->error_m);
    text.append(buffer);
  }
  text.append("\n  Report  ").append((r.out / "report.html").string());
  console.print(text);
}

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
//
// The commands run, demo and live. `run_slam` is the pipeline; the other files of this folder contain one step each.
#include <optional>
#include <string>
#include <utility>

#include "accuracy.hpp"
#include "camera_stage.hpp"
#include "commands.hpp"
#include "interrupts.hpp"
#include "map_stage.hpp"
#include "navigation.hpp"
#include "output.hpp"
#include "result_files.hpp"
#include "tracking_stage.hpp"
#include "viewer/viewer.hpp"

namespace app {
namespace {

/// Ends the run if it would overwrite a file that it must not replace, or cannot write its results.
std::optional<exit_code> check_outputs(const frame_source& source, const settings& s, console& console) {
  if (const auto conflict = find_overwritten(s, inputs_of(s, source.files))) return console.error(*conflict), bad_usage;
  if (const auto unwritable = find_unwritable(s)) return console.error(*unwritable), bad_input;
  return std::nullopt;
}

/// Copies the results of tracking and their warnings to `r`.
void add_tracking(results& r, const tracked_frames& tracked, const frame_source& source, const settings& s,
                  console& console) {
  const auto warn = [&](std::string note) { console.warn(r.warnings.emplace_back(std::move(note))); };
  if (tracked.live) {
    r.live = tracked.live->measured();
    for (std::string& note : live_notes(*r.live)) warn(std::move(note));
  }
  if (tracked.stopped) r.warnings.push_back(explain_stop(tracked, source).to_string());
  if (interrupts::stop_requested()) warn("interrupted by the user; the results so far are kept");
  for (std::string& note : tracking_notes(tracked, s)) warn(std::move(note));
  if (tracked.missed_map) r.warnings.push_back(explain_miss(tracked, s).to_string());
  r.slam = tracked.slam;
  r.world = tracked.world;
}

/// Ends a run in which no frame was tracked. It writes summary.json, and nothing if the user interrupted it.
exit_code end_untracked(results& r, const tracked_frames& tracked, const frame_source& source, const settings& s,
                        result_files& files, console& console) {
  if (interrupts::stop_requested()) {
    console.error(
        {orbis::errc::cancelled, s.out.string(), "interrupted before any frame was tracked; nothing was written"});
    return interrupted;
  }
  if (tracked.stopped) return report_no_start(r, explain_stop(tracked, source), bad_input, files, console);
  return report_no_start(r, tracked.missed_map ? explain_miss(tracked, s) : explain_no_start(r, s), never_tracked,
                         files, console);
}

/// Builds cloud, octree, floor map and path from the keyframes, and writes them.
orbis::result<void> build_map(results& r, const tracked_frames& tracked, const frame_source& source, const settings& s,
                              const result_files& files, viewer& viewer, console& console) {
  live_octree* const live = tracked.live ? tracked.live->map() : nullptr;
  auto map = map_frames(tracked.keyframes, source, live, s, console);
  if (!map) return orbis::fail(map.error());
  auto navigation = navigate(map->octree, r.slam->keyframes, s, files.folder(), files.floor_map(), console);
  if (!navigation) return orbis::fail(navigation.error());
  r.navigation = *std::move(navigation);
  if (r.navigation->unsaved) r.warnings.push_back(r.navigation->unsaved->to_string());
  auto written = write_map(*std::move(map), s, files.folder(), console);
  if (!written) return orbis::fail(written.error());
  r.map = *std::move(written);
  if (live != nullptr) r.map->insert_ms = r.live->insert_ms;  // measured during tracking, not in the final pass
  viewer.show_map(r.map->voxels);
  return {};
}

/// The exit code of a run that wrote its results; reports the error that limits them, if there is one.
exit_code end_tracked(const results& r, const tracked_frames& tracked, const frame_source& source, const settings& s,
                      bool was_interrupted, console& console) {
  if (tracked.stopped) return console.error(explain_stop(tracked, source)), bad_input;
  if (tracked.unsaved) return console.error(*tracked.unsaved), bad_input;
  if (r.navigation && r.navigation->unsaved) return console.error(*r.navigation->unsaved), bad_input;
  if (was_interrupted) return interrupted;
  if (tracked.missed_map) return console.error(explain_miss(tracked, s)), never_tracked;
  return done;
}

}  // namespace

exit_code run_slam(const settings& s, console& console) {
  const auto give_up = [&](const orbis::error& e) { return console.error(e), bad_input; };

  // Open the input.
  finish_earlier_run(s);
  auto source = open_source(s, console);
  if (!source) return give_up(source.error());
  if (const auto code = check_outputs(*source, s, console)) return *code;

  // Estimate the camera's shutter and, if necessary, its intrinsics.
  const shutter_results shutter = prepare_camera(*source, s, console);

  // Open the viewer and the output folder.
  auto shown = viewer::open(s, *source, console);
  if (!shown) return console.error(shown.error()), bad_usage;
  auto files = result_files::begin(s);
  if (!files) return give_up(files.error());
  results r = begin_results(s, source->title, &*source, files->folder());

  // Track all frames.
  const auto tracked = track(*source, shutter, s, files->landmark_map(), files->folder() / spill_name, *shown, console);
  if (!tracked) return give_up(tracked.error());
  if (source->rest) source->rest();
  if (tracked->stopped && tracked->slam.frames == 0) return give_up(*tracked->stopped);
  add_tracking(r, *tracked, *source, s, console);
  if (r.slam->tracked == 0) return end_untracked(r, *tracked, *source, s, *files, console);
  if (auto done = write_trajectories(*r.slam, files->folder()); !done) return give_up(done.error());
  if (auto done = write_camera_used(*source, shutter, files->folder()); !done) return give_up(done.error());

  // Build the map from the keyframes.
  if (tracked->keyframes.size() != 0)
    if (auto done = build_map(r, *tracked, *source, s, *files, *shown, console); !done) return give_up(done.error());

  // Evaluate, and write the report.
  compare_with_truth(r, *source, console);
  if (auto done = write_report_files(r, r.slam->keyframes, *files, console); !done) return give_up(done.error());
  print_results(r, console);
  const bool was_interrupted = interrupts::stop_requested();
  shown->finish(s, console);
  return end_tracked(r, *tracked, *source, s, was_interrupted, console);
}

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
//
// The commands run, demo and live. `run_slam` is the pipeline; the other files in this folder contain one step each.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "../common/memory.hpp"
#include "accuracy.hpp"
#include "camera_stage.hpp"
#include "commands.hpp"
#include "dispensable.hpp"
#include "interrupts.hpp"
#include "map_stage.hpp"
#include "navigation.hpp"
#include "output.hpp"
#include "result_files.hpp"
#include "shutter_stage.hpp"
#include "tracking_stage.hpp"
#include "viewer/viewer.hpp"

namespace app {
namespace {

/// Checks the files before the run starts. Prints the error and returns the exit code if the map to load is missing, or
/// if the run would overwrite a file that it must not replace or cannot write its results.
std::optional<exit_code> check_files(const frame_source& source, const settings& s, console& console) {
  std::error_code ignored;
  if (!s.load_map.empty() && !std::filesystem::exists(s.load_map, ignored))
    return console.error({orbis::errc::not_found, s.load_map.string(), "no such file"}), bad_input;
  if (std::filesystem::is_directory(s.load_map, ignored))
    return console.error({orbis::errc::unreadable, s.load_map.string(), "is a directory"}), bad_input;
  if (const auto conflict = find_overwritten(s, input_files(s, source.files)))
    return console.error(*conflict), bad_usage;
  if (const auto unwritable = find_unwritable(s)) return console.error(*unwritable), bad_input;
  return std::nullopt;
}

/// Tracks all frames. If the recording contradicts its camera, replaces the camera and tracks them again.
orbis::result<tracked_frames> track_all(frame_source& source, const shutter_results& shutter, const settings& s,
                                        const result_files& files, viewer& viewer, console& console) {
  if (auto tracked = track(source, shutter, s, files, viewer, console); !tracked || !tracked->better_camera)
    return tracked;
  else
    console.warn(replace_camera(source, *tracked->better_camera));
  viewer.set_camera(source);
  return track(source, shutter, s, files, viewer, console);
}

/// Copies the tracking results and their warnings to `r`.
void add_tracking(results& r, const tracked_frames& tracked, const frame_source& source, const settings& s,
                  console& console) {
  const auto warn = [&](std::string note) { console.warn(r.warnings.emplace_back(std::move(note))); };
  if (tracked.live) {
    r.live = tracked.live->so_far();
    for (std::string& note : live_notes(*r.live)) warn(std::move(note));
  }
  if (tracked.stopped) r.warnings.push_back(explain_stop(tracked, source).to_string());
  if (interrupts::stop_requested()) warn("interrupted by the user; the results so far are kept");
  for (std::string& note : tracking_notes(tracked, s)) warn(std::move(note));
  if (tracked.missed_map) r.warnings.push_back(explain_miss(tracked, s).to_string());
  r.slam = tracked.slam;
  r.world = tracked.world;
}

/// Ends a run in which no frame was tracked. Writes summary.json unless the user interrupted the run.
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

/// Builds cloud, octree, floor map and path from the keyframes, and writes them into `r.folder`.
orbis::result<void> build_map(results& r, const tracked_frames& tracked, const frame_source& source, const settings& s,
                              const std::filesystem::path& floor_map, console& console) {
  live_octree* live = nullptr;
  if (tracked.live) {
    live = tracked.live->stop();
    const auto known = live_notes(*std::exchange(r.live, tracked.live->so_far()));
    for (std::string& note : live_notes(*r.live))  // includes results of the map's last step
      if (std::find(known.begin(), known.end(), note) == known.end())
        console.warn(r.warnings.emplace_back(std::move(note)));
  }
  auto map = map_frames(tracked.keyframes, source, live, s, console);
  if (!map) return orbis::fail(map.error());
  auto navigation = navigate(map->octree, r.slam->keyframes, s, r.folder, floor_map, console);
  if (!navigation) return orbis::fail(navigation.error());
  r.navigation = *std::move(navigation);
  if (r.navigation->unsaved) r.warnings.push_back(r.navigation->unsaved->to_string());
  auto written = write_map(*std::move(map), s, r.folder, console);
  if (!written) return orbis::fail(written.error());
  r.map = *std::move(written);
  if (live != nullptr) r.map->insert_ms = r.live->insert_ms;  // measured during tracking, not in the final pass
  return {};
}

/// Completes the results: the map (if there are keyframes), the evaluation and the report. Creates files in `r.folder`
/// and at `floor_map`.
orbis::result<void> complete(results& r, const tracked_frames& tracked, const frame_source& source, const settings& s,
                             const file_lists& files, const std::filesystem::path& floor_map, viewer& viewer,
                             console& console) {
  if (tracked.keyframes.size() != 0) {
    if (auto done = build_map(r, tracked, source, s, floor_map, console); !done) return done;
    if (!interrupts::is_given_up()) viewer.show_map(r.map->voxels);
  }
  compare_with_truth(r, source, console);
  return write_report_files(r, r.slam->keyframes, files, console);
}

/// The outcome of `complete_or_give_up`.
struct completion {
  bool was_interrupted;                ///< true if the user interrupted the run, during tracking or later
  std::optional<orbis::error> no_map;  ///< the reason why there is no map, for example cancelled by the user
  bool is_running = false;             ///< a thread is still working on the map
};

/// Completes the results and adds their files to the other result files. If the user abandons the map, or it cannot be
/// made or written, leaves the results as they are.
completion complete_or_give_up(results& r, const tracked_frames& tracked, const frame_source& source, const settings& s,
                               result_files& files, viewer& viewer, console& console) {
  using orbis::errc;
  if (auto begun = files.begin_optional(); !begun)
    return {.was_interrupted = interrupts::end_dispensable(), .no_map = begun.error()};
  interrupts::begin_dispensable(
      s.quiet ? ""
              : "\nrgbd_slam: stopping; the map is abandoned, the other results are written. Interrupt again to stop "
                "immediately and leave the folder unchanged\n");
  // The other thread owns all data that it changes, so that it can be left running.
  results whole = r;
  whole.folder = files.optional_folder();
  auto done = run_dispensable([&tracked, &source, &s, &viewer, whole = std::move(whole), lists = files.lists(),
                               floor_map = files.optional_floor_map(),
                               console = console.for_dispensable()]() mutable -> orbis::result<results> {
    try {
      if (auto made = complete(whole, tracked, source, s, lists, floor_map, viewer, console); !made)
        return orbis::fail(made.error());
      return std::move(whole);
    } catch (const std::bad_alloc&) {
      return orbis::fail(errc::exception, {}, "out of memory");
    } catch (const std::exception& e) {
      return orbis::fail(errc::exception, {}, examples::describe_exception(e));
    }
  });
  completion end{.was_interrupted = interrupts::end_dispensable(), .no_map = {}};
  if (!done) {  // this block must not throw
    end.no_map = orbis::error{errc::cancelled, {}, {}};
    end.is_running = true;
    return end;
  }
  if (!*done) {
    files.drop_optional();  // makes room on the disk for the report
    end.no_map = done->error();
    return end;
  }
  if (auto moved = files.take_optional(); !moved) {
    files.drop_optional();
    end.no_map = moved.error();
    return end;
  }
  r = **std::move(done);
  r.folder = files.folder();
  return end;
}

/// Evaluates a run without a map and writes its report. If that fails, writes only the summary, if possible, so that
/// the other files are described. Errors: write_failed; out of memory.
orbis::result<void> report_without_map(results& r, const frame_source& source, const file_lists& files,
                                       console& console) {
  const auto guarded = [&](const auto& work) -> orbis::result<void> {
    try {
      return work();
    } catch (const std::exception& e) {
      return orbis::fail(orbis::errc::exception, r.out.string(), examples::describe_exception(e));
    }
  };
  auto written = guarded([&] {
    compare_with_truth(r, source, console);
    return write_report_files(r, r.slam->keyframes, files, console);
  });
  if (written) return written;
  static_cast<void>(guarded([&] {
    for (const char* name : {"report.html", "trajectory.png"}) {  // makes room on the disk
      std::error_code ignored;
      std::filesystem::remove(r.folder / name, ignored);
    }
    return write_summary_only(r, files, console);
  }));
  return written;
}

/// Returns the exit code of a run that wrote its results. If an error made the results incomplete, prints it.
exit_code end_tracked(const results& r, const tracked_frames& tracked, const completion& end,
                      const frame_source& source, const settings& s, console& console) {
  if (tracked.stopped) return console.error(explain_stop(tracked, source)), bad_input;
  if (tracked.unsaved) return console.error(*tracked.unsaved), bad_input;
  if (r.navigation && r.navigation->unsaved) return console.error(*r.navigation->unsaved), bad_input;
  if (end.was_interrupted && (!end.no_map || end.no_map->code == orbis::errc::cancelled)) return interrupted;
  if (end.no_map) return console.error(*end.no_map), bad_input;
  if (tracked.missed_map) return console.error(explain_miss(tracked, s)), never_tracked;
  return done;
}

/// Writes the report if the map is missing, moves all files into place, and prints the results. Returns the exit code.
exit_code finish_run(results& r, const tracked_frames& tracked, completion& end, const frame_source& source,
                     const settings& s, result_files& files, viewer& viewer, console& console) {
  orbis::result<void> reported;
  if (end.no_map) {
    end.no_map = files.with_final_path(*end.no_map);
    end.no_map->message =
        (end.no_map->code == orbis::errc::cancelled ? "interrupted by the user" : end.no_map->message) +
        "; the map is missing, the other results were written";
    console.warn(r.warnings.emplace_back(end.no_map->message));
    reported = report_without_map(r, source, files.lists(), console);
    if (!reported) reported = orbis::fail(files.with_final_path(reported.error()));
  }
  if (auto done = files.put_in_place(); !done) return console.error(done.error()), bad_input;
  if (!reported) {
    if (tracked.unsaved) console.error(*tracked.unsaved);
    return console.error(reported.error()), bad_input;
  }
  print_results(r, console);
  if (!end.is_running) viewer.finish(s, console);
  return end_tracked(r, tracked, end, source, s, console);
}

}  // namespace

exit_code run_slam(const settings& s, console& console) {
  const auto give_up = [&](const orbis::error& e) { return console.error(e), bad_input; };

  auto source = open_source(s, console);
  if (!source) return give_up(source.error());
  if (const auto code = check_files(*source, s, console)) return *code;

  // Estimate the camera's shutter; tracking refines the estimate.
  constexpr double first_seconds = 5.0;
  const shutter_results shutter = find_shutter(*source, s, first_seconds, console);

  // Open the viewer and the output folder.
  auto shown = viewer::open(s, *source, console);
  if (!shown) return console.error(shown.error()), bad_usage;
  auto files = result_files::begin(s);
  if (!files) return console.error(files.error()), code_of(files.error());

  auto tracked = track_all(*source, shutter, s, *files, *shown, console);
  if (!tracked) return give_up(tracked.error());
  if (source->rest) source->rest();
  results r = begin_results(s, source->title, &*source, files->folder());
  if (tracked->stopped && tracked->slam.frames == 0) return give_up(*tracked->stopped);
  add_tracking(r, *tracked, *source, s, console);
  if (r.slam->tracked == 0) return end_untracked(r, *tracked, *source, s, *files, console);
  const auto write_poses = [&]() -> orbis::result<void> {
    auto written = write_trajectories(*r.slam, files->folder());
    if (written) written = write_camera_used(*source, r.slam->shutter, files->folder());
    return written;
  };
  auto written = write_poses();
  if (!written && files->drop_landmark_map()) {  // makes room on the disk
    tracked->unsaved = {written.error().code, s.save_map.string(), written.error().message};
    written = write_poses();
  }
  if (!written) return give_up(files->with_final_path(written.error()));

  // Build the map from the keyframes, evaluate, and write the report.
  completion end = complete_or_give_up(r, *tracked, *source, s, *files, *shown, console);
  if (!end.is_running) {
    if (end.no_map) tracked->live.reset();  // frees memory
    return finish_run(r, *tracked, end, *source, s, *files, *shown, console);
  }
  // The thread uses objects of this function, which therefore must not return.
  exit_code code = bad_input;
  try {
    code = finish_run(r, *tracked, end, *source, s, *files, *shown, console);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "rgbd_slam: %s\n", e.what());  // allocates no memory
  } catch (...) {
  }
  interrupts::end_program(code);
}

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
//
// The whole program in one screen; each call stands in a small file beside this one.
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

exit_code run_slam(const settings& s, console& console) {
  const auto give_up = [&](const orbis::error& e) { return console.error(e), bad_input; };

  // Read.
  auto source = open_source(s, console);
  if (!source) return give_up(source.error());
  if (const auto lost = find_overwritten(s, inputs_of(s, source->files))) return console.error(*lost), bad_usage;
  if (const auto locked = find_unwritable(s)) return give_up(*locked);
  const shutter_results shutter = get_to_know_camera(*source, s, console);
  auto shown = viewer::open(s, *source, console);
  if (!shown) return console.error(shown.error()), bad_usage;
  auto files = result_files::begin(s);
  if (!files) return give_up(files.error());
  results r = begin_results(s, source->title, &*source, files->folder());

  // Track; some frames become keyframes.
  const auto attempt = track(*source, shutter, s, files->landmark_map(), files->folder() / spill_name, *shown, console);
  if (!attempt) return give_up(attempt.error());
  const tracked_frames& tracked = *attempt;
  if (source->rest) source->rest();
  live_octree* const live = tracked.live ? tracked.live->map() : nullptr;
  if (tracked.live) r.live = tracked.live->measured();
  if (r.live)
    for (const std::string& note : live_notes(*r.live)) console.warn(r.warnings.emplace_back(note));
  if (tracked.stopped && tracked.slam.frames == 0) return give_up(*tracked.stopped);
  if (tracked.stopped) r.warnings.push_back(explain_stop(tracked, *source).to_string());
  if (interrupts::requested())
    console.warn(r.warnings.emplace_back("interrupted by the user; what was reached is kept"));
  for (const std::string& note : tracking_notes(tracked, s)) console.warn(r.warnings.emplace_back(note));
  if (tracked.missed_map) r.warnings.push_back(explain_miss(tracked, s).to_string());
  r.slam = tracked.slam;
  r.world = tracked.world;
  if (r.slam->tracked == 0 && interrupts::requested())
    return give_up({orbis::errc::cancelled, s.out.string(), "interrupted before a frame was tracked: left as it was"}),
           interrupted;
  if (r.slam->tracked == 0)
    return report_no_start(r,
                           tracked.stopped      ? explain_stop(tracked, *source)
                           : tracked.missed_map ? explain_miss(tracked, s)
                                                : explain_no_start(r, s),
                           tracked.stopped ? bad_input : never_tracked, *files, console);
  if (auto done = write_trajectories(*r.slam, files->folder()); !done) return give_up(done.error());
  if (auto done = write_camera_used(*source, shutter, files->folder()); !done) return give_up(done.error());

  // Keyframes -> dense cloud -> filter -> octree -> floor map, path -> files.
  if (tracked.keyframes.size() != 0) {
    auto map = map_frames(tracked.keyframes, *source, live, s, console);
    if (!map) return give_up(map.error());
    auto usable = navigate(map->octree, r.slam->keyframes, s, files->folder(), files->floor_map(), console);
    if (!usable) return give_up(usable.error());
    r.navigation = *std::move(usable);
    if (r.navigation->unsaved) r.warnings.push_back(r.navigation->unsaved->to_string());
    auto written = write_map(*std::move(map), s, files->folder(), console);
    if (!written) return give_up(written.error());
    r.map = *std::move(written);
    shown->show_map(r.map->voxels);
    if (live != nullptr)
      r.map->insert_ms = r.live->insert_ms;  // when they were made, not when the filter's verdict came
  }

  // Evaluation and report; then all files are put in place.
  compare_with_truth(r, *source, console);
  if (auto done = write_report_files(r, r.slam->keyframes, *files, console); !done) return give_up(done.error());
  print_results(r, console);
  const bool was_interrupted = interrupts::requested();
  shown->finish(s, console);

  if (tracked.stopped) return give_up(explain_stop(tracked, *source));
  if (tracked.unsaved) return give_up(*tracked.unsaved);
  if (r.navigation && r.navigation->unsaved) return give_up(*r.navigation->unsaved);
  if (was_interrupted) return interrupted;
  return tracked.missed_map ? (console.error(explain_miss(tracked, s)), never_tracked) : done;
}

}  // namespace app

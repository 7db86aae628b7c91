// SPDX-License-Identifier: BSD-3-Clause
//
// The whole program in one screen; each call stands in a small file beside this one.
#include "accuracy.hpp"
#include "commands.hpp"
#include "map_stage.hpp"
#include "output.hpp"
#include "tracking_stage.hpp"

namespace app {

exit_code run_slam(const settings& s, console& say) {
  const auto give_up = [&](const orbis::error& e) { return say.error(e), bad_input; };

  // Read.
  const auto source = open_source(s, say);
  if (!source) return give_up(source.error());
  if (auto ready = prepare_output(s); !ready) return give_up(ready.error());
  results r = begin_results(s, source->title, &*source);

  // Track; some frames become keyframes.
  const auto attempt = track(*source, s, say);
  if (!attempt) return give_up(attempt.error());
  const tracked_frames& tracked = *attempt;
  if (tracked.stopped && tracked.slam.frames == 0) return give_up(*tracked.stopped);
  if (tracked.stopped) r.warnings.push_back(explain_stop(tracked, *source).to_string());
  if (console::interrupted()) say.warn(r.warnings.emplace_back("interrupted by the user; what was reached is kept"));
  for (const std::string& note : tracking_notes(tracked, s)) say.warn(r.warnings.emplace_back(note));
  if (tracked.missed_map) r.warnings.push_back(explain_miss(tracked, s).to_string());
  r.slam = tracked.slam;
  remove_old_results(s.out);
  if (r.slam->tracked == 0)
    return report_no_start(r, tracked.missed_map ? explain_miss(tracked, s) : explain_no_start(r, s), say);
  if (auto done = write_trajectories(*r.slam, s.out); !done) return give_up(done.error());

  // Keyframes -> dense cloud -> filter -> octree -> files.
  if (tracked.keyframes.size() != 0) {
    auto map = map_frames(tracked.keyframes, *source, s, say);
    if (!map) return give_up(map.error());
    auto written = write_map(*std::move(map), s, say);
    if (!written) return give_up(written.error());
    r.map = *std::move(written);
  }

  // Evaluation and report.
  compare_with_truth(r, *source, say);
  if (auto done = write_report_files(r, r.slam->keyframes, say); !done) return give_up(done.error());
  print_results(r, say);

  if (tracked.stopped) return give_up(explain_stop(tracked, *source));
  if (tracked.unsaved) return give_up(*tracked.unsaved);
  if (console::interrupted()) return interrupted;
  return tracked.missed_map ? (say.error(explain_miss(tracked, s)), never_tracked) : done;
}

}  // namespace app

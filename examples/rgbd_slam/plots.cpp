// SPDX-License-Identifier: BSD-3-Clause
#include "plots.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include <opencv2/core/utility.hpp>

#include "map_picture.hpp"
#include "sheet.hpp"
#include "summary.hpp"

namespace app {
namespace {

using orbis::vec2;
using orbis::vec3;

/// Writes a note below a picture if its coordinate frame differs from that of the files.
void add_frame_note(sheet& s, const results& r, const view_frame& frame) {
  const std::string note = view_frame_note(frame, r.slam ? r.slam->unit() : "metres");
  if (!note.empty()) s.text(note, {60, 806}, faint, 11);
}

orbis::result<void> write_trajectory_picture(const results& r, const view_frame& frame) {
  if (!r.slam || r.slam->trajectory.empty()) return {};
  const orbis::trajectory& poses = r.slam->trajectory;
  const double start = poses.front().timestamp;
  const bool compared = r.against_truth.has_value();

  std::vector<vec2> above, height, true_above, true_height, error;
  axes::range x, y, z, t, e;
  const auto take = [&](const vec3& p, double when, std::vector<vec2>& plan, std::vector<vec2>& profile) {
    const vec3 v = frame.T_view_world * p;
    plan.emplace_back(v.x(), v.y());
    profile.emplace_back(when - start, v.z());
    x.take(v.x());
    y.take(v.y());
    z.take(v.z());
    t.take(when - start);
  };
  for (const orbis::stamped_pose& p : poses) take(p.T_world_camera.translation(), p.timestamp, above, height);
  e.take(0.0);
  if (compared)
    for (const compared_pose& p : r.against_truth->poses) {
      take(p.truth, p.timestamp, true_above, true_height);
      error.emplace_back(p.timestamp - start, 100 * p.error_m);
      e.take(100 * p.error_m);
    }

  sheet s{1500, 820};
  s.text(r.title, {60, 44}, ink, 19, 0.0, true);
  std::string headline = std::to_string(r.slam->tracked) + " of " + std::to_string(r.slam->frames) + " frames tracked";
  if (compared) {
    char buffer[96];
    std::snprintf(buffer, sizeof buffer, ", ATE RMSE %.1f mm", 1000 * r.against_truth->ate_rmse_m);
    headline += buffer;
  }
  s.text(headline, {60, 70}, faint, 13);
  s.line({1240, 40}, {1275, 40}, estimate_color, 2.2);
  s.text("estimate", {1285, 45}, ink, 13);
  if (compared) {
    s.line({1240, 64}, {1275, 64}, truth_color, 2.2);
    s.text("ground truth", {1285, 69}, ink, 13);
  }
  s.dot({1257.5, compared ? 88.0 : 64.0}, estimate_color, 2.6);
  s.text("keyframe", {1285, compared ? 93.0 : 69.0}, ink, 13);

  axes plan{s, 80, 125, 640, 630, x.padded(0.06, 0.2), y.padded(0.06, 0.2), true};
  add_frame_note(s, r, frame);
  const std::string unit = r.slam->unit();
  plan.frame("from above", "x, " + unit, "y, " + unit);
  plan.curve(true_above, truth_color, 2.6);
  plan.curve(above, estimate_color, 1.5);
  for (const orbis::stamped_pose& k : r.slam->keyframes) {
    const vec3 v = frame.T_view_world * k.T_world_camera.translation();
    s.dot(plan.place(v.x(), v.y()), estimate_color, 2.6);
  }
  s.dot(plan.place(above.front().x(), above.front().y()), start_color, 5.5);
  s.text("start", plan.place(above.front().x(), above.front().y()) + vec2(9, -7), start_color, 12);

  const axes::range time = t.padded(0.0, 0.1);
  axes profile{s, 830, 125, 610, compared ? 260.0 : 630.0, time, z.padded(0.1, 0.1), false};
  profile.frame("height", "time, s", unit);
  profile.curve(true_height, truth_color, 2.6);
  profile.curve(height, estimate_color, 1.5);
  if (compared) {
    axes off{s, 830, 475, 610, 280, time, {0.0, std::max(1.1 * e.high, 0.1)}, false};
    off.frame("distance to ground truth after alignment", "time, s", "cm");
    off.curve(error, error_color, 1.6);
    const double rmse = 100 * r.against_truth->ate_rmse_m;
    off.curve({{time.low, rmse}, {time.high, rmse}}, faint, 1.0);
    s.text("RMSE", off.place(time.high, rmse) + vec2(5, 4), faint, 11);
  }
  return s.write(r.folder / "trajectory.png");
}

orbis::result<void> write_map_picture(const std::string& name, const std::string& title, const tree_numbers& numbers,
                                      const orbis::image<orbis::rgb8>& aslant, const orbis::image<orbis::rgb8>& above,
                                      double pixels_per_metre, const results& r, const view_frame& frame) {
  sheet s{1500, 820};
  s.paste(aslant, 20, 100);
  s.paste(above, 920, 130);
  s.text(title, {60, 44}, ink, 19, 0.0, true);
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, "%s occupied of %s known leaves, finest voxel %g cm, %s as .bt",
                count_text(numbers.occupied).c_str(), count_text(numbers.leaves).c_str(), 100 * r.map->resolution,
                bytes_text(numbers.bt_bytes).c_str());
  s.text(buffer, {60, 70}, faint, 13);
  std::snprintf(buffer, sizeof buffer, "up to a height of %.1f m; blank: nothing was measured", frame.cut);
  s.text(buffer, {60, 90}, faint, 13);
  s.text("from above, by height", {1200, 118}, faint, 12, 0.5);
  std::snprintf(buffer, sizeof buffer, "%.1f m", frame.cut);
  orbis::image<orbis::rgb8> scale(200, 9);
  for (int y = 0; y != scale.height(); ++y)
    for (int x = 0; x != scale.width(); ++x) scale(x, y) = height_color(x / 199.0);
  s.paste(scale, 1180, 785);
  add_frame_note(s, r, frame);
  s.text("height 0", {1172, 794}, faint, 11, 1.0);
  s.text(buffer, {1388, 794}, faint, 11);
  // A scale bar of 1, 2 or 5 times a power of ten, at most about 120 pixels long.
  const double length = nice_step(80.0 / pixels_per_metre, 1), end = 940 + length * pixels_per_metre;
  s.line({940, 789}, {end, 789}, ink, 1.5);
  for (const double x : {940.0, end}) s.line({x, 785}, {x, 793}, ink, 1.5);
  s.text(tick_text(length, length) + " m", {end + 8, 794}, faint, 11);
  return s.write(r.folder / name);
}

/// The octree before and after the filter, side by side in the same view, with the sizes below.
orbis::result<void> write_filter_picture(const results& r, const view_frame& frame,
                                         const orbis::image<orbis::rgb8>& before,
                                         const orbis::image<orbis::rgb8>& after) {
  const map_results& m = *r.map;
  sheet s{1500, 820};
  s.text(r.title + ": the octree before and after the filter", {60, 44}, ink, 19, 0.0, true);
  s.text("filter: " + m.filter_mode + ", removed " + removed_text(m), {60, 70}, faint, 13);
  if (m.moving_pixels != 0)
    s.text("people and other moving objects, " + count_text(m.moving_pixels) + " pixels of " +
               count_text(m.moving_keyframes) + " keyframes, were removed beforehand",
           {60, 88}, faint, 13);
  const auto panel = [&](int x, const std::string& name, const orbis::image<orbis::rgb8>& aslant,
                         const tree_numbers& numbers, std::size_t points, std::uintmax_t bytes) {
    s.paste(aslant, x, 136, 720);
    s.text(name, {x + 360.0, 116}, ink, 14, 0.5, true);
    s.text("cloud: " + count_text(points) + " points, " + bytes_text(bytes), {x + 360.0, 746}, ink, 13, 0.5);
    s.text("octree: " + count_text(numbers.leaves) + " leaves, " + count_text(numbers.occupied) + " occupied, " +
               bytes_text(numbers.bt_bytes) + " as .bt",
           {x + 360.0, 770}, ink, 13, 0.5);
  };
  panel(20, "before", before, m.unfiltered, m.cloud.size(), m.cloud_bytes);
  panel(760, "after", after, m.filtered, m.kept.size(), m.filtered_bytes);
  add_frame_note(s, r, frame);
  return s.write(r.folder / "filter.png");
}

}  // namespace

orbis::result<void> write_pictures(const results& r, const view_frame& frame) {
  cv::setNumThreads(0);  // there is little work, and a run must not fail here if no thread can be created
  if (auto done = write_trajectory_picture(r, frame); !done) return done;
  if (!r.map) return {};
  const map_results& m = *r.map;
  map_painter painter{m.voxels, frame};
  const coloring how = m.cloud.has_colors() ? coloring::camera : coloring::height;
  const auto before = painter.draw_aslant(m.voxels_unfiltered, how), after = painter.draw_aslant(m.voxels, how);
  if (auto done = write_map_picture("map_unfiltered.png", r.title + ": the map before the filter", m.unfiltered, before,
                                    painter.draw_from_above(m.voxels_unfiltered, coloring::height),
                                    painter.pixels_per_metre(), r, frame);
      !done)
    return done;
  if (auto done = write_filter_picture(r, frame, before, after); !done) return done;
  return write_map_picture("map.png", r.title + ": the map", m.filtered, after,
                           painter.draw_from_above(m.voxels, coloring::height), painter.pixels_per_metre(), r, frame);
}

}  // namespace app

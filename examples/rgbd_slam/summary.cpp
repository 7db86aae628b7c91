// SPDX-License-Identifier: BSD-3-Clause
#include "summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include <orbis/core/file.hpp>

#include "formatted_text.hpp"
#include "result_files.hpp"

namespace app {
namespace {

using json = nlohmann::ordered_json;

double peak_rss_mb() {
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) != 0) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

template <class T>
json or_null(const std::optional<T>& value) {
  return value ? json(*value) : json(nullptr);
}

}  // namespace

spread measure_spread(std::vector<double> values) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  if (values.empty()) return {nan, nan, nan};
  std::sort(values.begin(), values.end());
  const auto quantile = [&](double q) {
    const double at = q * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(at);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
  };
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return {quantile(0.5), quantile(0.95), sum / static_cast<double>(values.size())};
}

std::string summary_json(const results& r) {
  json j;  // NaN (unknown) is written as null
  const json null = nullptr;
  const auto& s = r.slam;
  const auto& m = r.map;
  const auto& a = r.against_truth;
  j["profile"] = r.profile;
  j["images_of"] = r.images_of.empty() ? null : json(r.images_of);
  j["sensor"] = s ? json(to_string(s->sensor)) : null;
  j["frames"] = s ? json(s->frames) : null;
  j["tracked"] = s ? json(s->tracked) : null;
  j["dropped"] = s && s->dropped ? json(*s->dropped) : null;
  j["lost"] = s ? json(s->lost) : null;
  j["relocalized"] = s ? json(s->relocalized) : null;
  j["keyframes"] = s ? json(s->keyframes.size()) : null;
  j["landmarks"] = s ? json(s->landmarks) : null;
  j["loops_closed"] = s ? json(s->loops_closed) : null;
  j["maps_merged"] = s ? json(s->maps_merged) : null;
  j["keyframes_culled"] = s ? json(s->keyframes_culled) : null;
  const spread tracking = measure_spread(s ? s->tracking_ms : std::vector<double>{});
  const spread in_slam = measure_spread(s ? s->slam_ms : std::vector<double>{});
  j["tracking_ms"] = {
      {"median", tracking.median}, {"p95", tracking.p95}, {"mean", tracking.mean}, {"p95_in_slam", in_slam.p95}};
  j["wall_s"] = r.wall_s;
  j["fps"] = s && s->seconds > 0 ? json(static_cast<double>(s->frames) / s->seconds) : null;
  j["peak_rss_mb"] = peak_rss_mb();
  const auto milliseconds = [&](double seconds) { return std::isfinite(seconds) ? json(1000.0 * seconds) : null; };
  j["shutter"] = {{"from", s ? json(s->shutter.from) : null},
                  {"read_out_ms", s ? milliseconds(s->shutter.shutter.color_read_out) : null},
                  {"read_out_deviation_ms", s ? milliseconds(s->shutter.estimate.read_out_deviation) : null},
                  {"depth_read_out_ms", s ? milliseconds(s->shutter.shutter.depth_read_out) : null},
                  {"depth_delay_ms", s ? milliseconds(s->shutter.shutter.depth_delay) : null},
                  {"depth_delay_deviation_ms", s ? milliseconds(s->shutter.estimate.delay_deviation) : null},
                  {"exposure_ms", s ? milliseconds(s->exposure) : null}};
  j["intrinsics"] = {{"from", s ? json(s->intrinsics.from) : null},
                     {"fx", s ? json(s->intrinsics.fx) : null},
                     {"fy", s ? json(s->intrinsics.fy) : null},
                     {"cx", s ? json(s->intrinsics.cx) : null},
                     {"cy", s ? json(s->intrinsics.cy) : null}};
  j["other_maps"] = json::array();
  for (std::size_t i = 0; s && i != s->other_maps.size(); ++i) {
    const auto& poses = s->other_maps[i];
    j["other_maps"].push_back({{"file", i + 2 <= most_maps ? json(trajectory_name(i + 2)) : null},
                               {"frames", poses.size()},
                               {"first_timestamp", poses.front().timestamp},
                               {"last_timestamp", poses.back().timestamp}});
  }
  const auto& w = r.world;
  j["world"] = {{"up_from", w ? json(w->up_from) : null},
                {"confidence", w ? or_null(w->confidence) : null},
                {"origin_m", {r.origin.x(), r.origin.y(), r.origin.z()}}};
  j["scale"] = a ? json(a->scale) : null;
  j["ate_rmse_m"] = a ? json(a->ate_rmse_m) : null;
  j["rpe_trans_rmse_m"] = a ? or_null(a->rpe_trans_rmse_m) : null;
  j["rpe_rot_rmse_deg"] = a ? or_null(a->rpe_rot_rmse_deg) : null;

  j["filter"] = {{"mode", m ? json(m->filter_mode) : null},
                 {"reason", m ? json(m->filter_reason) : null},
                 {"removed", m ? json(m->cloud.size() - m->kept.size()) : null}};
  j["cloud"] = {{"points", m ? json(m->cloud.size()) : null},
                {"points_filtered", m ? json(m->kept.size()) : null},
                {"bytes", m ? json(m->cloud_bytes) : null},
                {"bytes_filtered", m ? json(m->filtered_bytes) : null}};
  const spread insertion = measure_spread(m ? m->insert_ms : std::vector<double>{});
  j["octree"] = {{"resolution_m", m ? json(m->resolution) : null},
                 {"leaves_unfiltered", m ? json(m->unfiltered.leaves) : null},
                 {"leaves", m ? json(m->filtered.leaves) : null},
                 {"occupied", m ? json(m->filtered.occupied) : null},
                 {"free", m ? json(m->filtered.free) : null},
                 {"bt_bytes_unfiltered", m ? json(m->unfiltered.bt_bytes) : null},
                 {"bt_bytes", m ? json(m->filtered.bt_bytes) : null},
                 {"ot_bytes", m ? json(m->ot_bytes) : null},
                 {"insert_ms_per_frame", {{"median", insertion.median}, {"p95", insertion.p95}}}};
  const auto& l = r.live;
  const spread live_insertion = measure_spread(l ? l->insert_ms : std::vector<double>{});
  const spread delay = measure_spread(l ? l->delay_ms : std::vector<double>{});
  const spread frame_delay = measure_spread(l ? l->frame_delay_ms : std::vector<double>{});
  const spread correction = measure_spread(l ? l->correction_ms : std::vector<double>{});
  const auto largest = [&](const std::vector<double>& ms) {
    return ms.empty() ? null : json(*std::max_element(ms.begin(), ms.end()));
  };
  j["live_map"] = null;
  if (l)
    j["live_map"] = {
        {"insert_ms", {{"median", live_insertion.median}, {"p95", live_insertion.p95}, {"max", largest(l->insert_ms)}}},
        {"delay_ms", {{"median", delay.median}, {"p95", delay.p95}, {"max", largest(l->delay_ms)}}},
        {"behind_frames_max", l->behind_frames_max},
        {"dropped_keyframes", l->dropped},
        {"frames",
         {{"inserted", l->frames},
          {"dropped", l->dropped_frames},
          {"refused", l->refused_frames},
          {"delay_ms",
           {{"median", frame_delay.median}, {"p95", frame_delay.p95}, {"max", largest(l->frame_delay_ms)}}}}},
        {"corrections", l->correction_ms.size()},
        {"correction_ms", {{"median", correction.median}, {"max", largest(l->correction_ms)}}}};
  const auto& n = r.navigation;
  const bool has_path = n && !n->path.empty();
  j["navigation"] = {{"floor_m", n ? or_null(n->floor_m) : null},
                     {"free_m2", n && n->floor_m ? json(n->free_m2) : null},
                     {"path",
                      {{"status", n ? json(n->path_status) : null},
                       {"length_m", has_path ? json(n->path_m) : null},
                       {"straight_m", has_path ? json(n->straight_m) : null},
                       {"planning_ms", has_path ? json(n->planning_ms) : null}}}};
  j["map_error_m"] = m ? or_null(m->error_m) : null;
  j["files"] = r.files;
  j["files_of_earlier_runs"] = r.files_of_earlier_runs;
  return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

std::string accuracy_json(const accuracy& a, const std::vector<std::string>& warnings) {
  const json j = {{"pairs", a.poses.size()},
                  {"scale", a.scale},
                  {"ate_rmse_m", a.ate_rmse_m},
                  {"ate_mean_m", a.ate_mean_m},
                  {"ate_median_m", a.ate_median_m},
                  {"ate_max_m", a.ate_max_m},
                  {"rpe_trans_rmse_m", or_null(a.rpe_trans_rmse_m)},
                  {"rpe_rot_rmse_deg", or_null(a.rpe_rot_rmse_deg)},
                  {"warnings", warnings}};
  return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

orbis::result<void> write_summary(const results& r) {
  return orbis::write_file_atomically(r.folder / "summary.json", [&](std::ostream& out) { out << summary_json(r); });
}

std::string bytes_text(std::uintmax_t bytes) {
  const auto b = static_cast<double>(bytes);
  if (bytes < 1000) return text("%.0f B", b);
  if (bytes < 1'000'000) return text("%.1f kB", b / 1e3);
  return text("%.2f MB", b / 1e6);
}

std::string size_table(const map_results& m) {
  const std::string octree = text("octree, %g cm", m.resolution * 100);
  const auto row = [](const std::string& name, const std::string& count, const char* unit, const std::string& bytes) {
    return text("  %-34s %12s %-8s %12s\n", name.c_str(), count.c_str(), unit, bytes.c_str());
  };
  std::string table = row("", "size", "", "on disk");
  table += row("point cloud", count_text(m.cloud.size()), "points", bytes_text(m.cloud_bytes));
  table += row("point cloud, filtered", count_text(m.kept.size()), "points", bytes_text(m.filtered_bytes));
  table +=
      row(octree + ", before the filter", count_text(m.unfiltered.leaves), "leaves", bytes_text(m.unfiltered.bt_bytes));
  table += row(octree + ", after the filter", count_text(m.filtered.leaves), "leaves", bytes_text(m.filtered.bt_bytes));
  table.pop_back();
  return table;
}

std::string world_text(const world_results& w) {
  if (w.up_from == "loaded map") return "that of the loaded map";
  if (w.up_from == "ground truth") return "that of the ground truth, with z up";
  if (w.up_from == "gravity") return "z up, from --gravity";
  if (w.up_from == "assumed") return "z up, assuming a level camera at the first frame";
  return "z up, from the " + w.up_from + " in the first depth image" +
         (w.confidence ? text(" (%.0f %% of its blocks)", 100.0 * *w.confidence) : "");
}

std::string removed_text(const map_results& m) {
  const std::size_t removed = m.cloud.size() - m.kept.size();
  const double share =
      m.cloud.empty() ? 0.0 : 100.0 * static_cast<double>(removed) / static_cast<double>(m.cloud.size());
  return count_text(removed) + " of " + count_text(m.cloud.size()) + text(" points (%.2f %%)", share);
}

std::string filter_lines(const map_results& m) {
  std::string lines = "  Filter  " + m.filter_mode + ", removed " + removed_text(m) + "\n          ";
  for (std::size_t i = 0; i != m.filter_reason.size(); ++i) {  // one line per step
    lines += m.filter_reason[i];
    if (m.filter_reason.compare(i, 2, "; ") == 0) lines += "\n         ";
  }
  return lines;
}

std::string floor_text(const navigation_results& n) {
  if (!n.floor_m) return "not found";
  return text("at a height of %.2f m, %.1f square metres free", *n.floor_m, n.free_m2);
}

std::string robot_text(const navigation_results& n) {
  return text("%s of %g m", n.drives ? "driving robot with a radius" : "ball", n.robot_radius);
}

std::string path_text(const navigation_results& n) {
  if (n.path.empty()) return n.path_status;
  return text("%.2f m for a %s, straight line %.2f m (%.2f times), found in %.1f ms", n.path_m, robot_text(n).c_str(),
              n.straight_m, n.path_m / n.straight_m, n.planning_ms);
}

std::string navigation_lines(const navigation_results& n) {
  return "  Floor  " + floor_text(n) + "\n  Path   " + path_text(n);
}

std::string accuracy_lines(const accuracy& a) {
  std::string lines = text("  ATE  RMSE %.4f m, mean %.4f, median %.4f, max %.4f, over %zu poses", a.ate_rmse_m,
                           a.ate_mean_m, a.ate_median_m, a.ate_max_m, a.poses.size());
  if (a.rpe_trans_rmse_m && a.rpe_rot_rmse_deg)
    lines +=
        text("\n  RPE  RMSE %.4f m, %.3f deg, between consecutive poses", *a.rpe_trans_rmse_m, *a.rpe_rot_rmse_deg);
  if (!a.no_rpe.empty()) lines += "\n  RPE  none: " + a.no_rpe;
  if (a.scale != 1.0) lines += text("\n       after scaling by %.4g", a.scale);
  return lines;
}

}  // namespace app

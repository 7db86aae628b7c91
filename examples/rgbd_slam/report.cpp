// SPDX-License-Identifier: BSD-3-Clause
#include "report.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>
#include <unordered_map>

#include <nlohmann/json.hpp>

#include <orbis/core/file.hpp>
#include <orbis/core/quote.hpp>

#include "formatted_text.hpp"
#include "shutter_stage.hpp"
#include "summary.hpp"

namespace app {
namespace {

using json = nlohmann::ordered_json;
using orbis::vec3;

// -- text ------------------------------------------------------------------------------------------

/// Text for the page. Replaces control characters and bytes that are not UTF-8; file names may contain both.
std::string escaped(std::string_view text) {
  const std::string quoted = json(text).dump(-1, ' ', false, json::error_handler_t::replace);
  const std::string valid = json::parse(quoted).get<std::string>();
  std::string out;
  for (std::size_t i = 0; i != valid.size();) {
    if (const std::size_t control = orbis::control_bytes(std::string_view{valid}.substr(i)); control != 0) {
      out += valid[i] == '\n' ? '\n' : '?';
      i += control;
      continue;
    }
    switch (const char c = valid[i++]) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      case '\'': out += "&#39;"; break;
      default: out += c;
    }
  }
  return out;
}

/// JSON for a script element; it cannot contain "</script>".
std::string for_script(const json& j) {
  std::string out;
  for (const char c : j.dump(-1, ' ', true, json::error_handler_t::replace))
    out += c == '<' ? "\\u003c" : std::string(1, c);
  return out;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve(bytes.size() / 3 * 4 + 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k != 3; ++k) group = group << 8U | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k != 4; ++k) out += k <= n ? digits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

/// The stride that selects at most `most` of `size` elements.
std::size_t thinning(std::size_t size, std::size_t most) { return std::max<std::size_t>(1, (size + most - 1) / most); }

double rounded(double v, double step) { return std::round(v / step) * step; }

// -- three-dimensional data -------------------------------------------------------------------------

/// Packs points: coordinates as 16-bit fractions of the bounds, colours, and one extra byte each.
class packer {
 public:
  void add(const vec3& p, orbis::rgb8 color, std::uint8_t extra) {
    points_.push_back(p);
    colors_.push_back(color);
    extras_.push_back(extra);
  }
  [[nodiscard]] json pack() const {
    vec3 low = vec3::Zero(), high = vec3::Zero();
    if (!points_.empty()) low = high = points_.front();
    for (const vec3& p : points_) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const vec3 span = (high - low).cwiseMax(1e-6);
    std::string bytes;
    for (const vec3& p : points_)
      for (int i = 0; i != 3; ++i) {
        const auto q = static_cast<std::uint16_t>(std::lround((p[i] - low[i]) / span[i] * 65535.0));
        bytes += static_cast<char>(q & 0xffU);
        bytes += static_cast<char>(q >> 8U);
      }
    for (const orbis::rgb8 c : colors_) {
      bytes += static_cast<char>(c.r);
      bytes += static_cast<char>(c.g);
      bytes += static_cast<char>(c.b);
    }
    for (const std::uint8_t e : extras_) bytes += static_cast<char>(e);
    return {{"count", points_.size()},
            {"low", {low.x(), low.y(), low.z()}},
            {"span", {span.x(), span.y(), span.z()}},
            {"packed", base64(bytes)}};
  }

 private:
  std::vector<vec3> points_;
  std::vector<orbis::rgb8> colors_;
  std::vector<std::uint8_t> extras_;
};

json packed_points(const map_results& m, const view_frame& frame) {
  // There are few removed points, and seeing them is useful: thin them less.
  const std::size_t every_kept = thinning(m.kept.size(), 80'000);
  const std::size_t every_removed = thinning(m.cloud.size() - m.kept.size(), 20'000);
  packer out;
  auto kept = m.kept.begin();
  std::size_t seen_kept = 0, seen_removed = 0;
  for (std::size_t i = 0; i < m.cloud.size(); ++i) {
    const bool is_kept = kept != m.kept.end() && *kept == i;
    if (is_kept) ++kept;
    if ((is_kept ? seen_kept++ % every_kept : seen_removed++ % every_removed) != 0) continue;
    const vec3 p = frame.T_view_world * m.cloud.points[i].cast<double>();
    if (!p.allFinite()) continue;
    out.add(p, m.cloud.has_colors() ? m.cloud.colors[i] : orbis::rgb8{150, 160, 175}, is_kept ? 1 : 0);
  }
  json j = out.pack();
  j["total"] = m.cloud.size();
  j["kept"] = m.kept.size();
  return j;
}

/// Merges voxels into voxels of twice the size until their number is below the limit.
json packed_voxels(std::vector<voxel> voxels, double resolution, const view_frame& frame) {
  constexpr std::size_t most = 45'000;
  const std::size_t total = voxels.size();
  double size = resolution;
  while (voxels.size() > most) {
    size *= 2;
    struct sum {
      std::size_t r = 0, g = 0, b = 0, n = 0;
      orbis::vec3f center;
      float size = 0;
    };
    std::map<std::array<long, 3>, sum> merged;  // ordered, so that the result is the same on all machines
    const auto fsize = static_cast<float>(size);
    for (const voxel& v : voxels) {
      const orbis::vec3f cell = (v.center / fsize).array().floor();
      sum& s = merged[{std::lround(cell.x()), std::lround(cell.y()), std::lround(cell.z())}];
      s.r += v.color.r;
      s.g += v.color.g;
      s.b += v.color.b;
      ++s.n;
      s.size = std::max(v.size, fsize);
      s.center = v.size > fsize ? v.center : orbis::vec3f((cell.array() + 0.5F) * fsize);
    }
    voxels.clear();
    for (const auto& [cell, s] : merged)
      voxels.push_back({s.center,
                        s.size,
                        {static_cast<std::uint8_t>(s.r / s.n), static_cast<std::uint8_t>(s.g / s.n),
                         static_cast<std::uint8_t>(s.b / s.n)}});
  }
  packer out;
  for (const voxel& v : voxels)
    out.add(frame.T_view_world * v.center.cast<double>(), v.color,
            static_cast<std::uint8_t>(std::clamp(std::lround(std::log2(v.size / size)), 0L, 16L)));
  json j = out.pack();
  j["total"] = total;
  j["resolution"] = size;
  return j;
}

// -- the script's data -------------------------------------------------------------------------------

void append(json& flat, const vec3& p) {
  for (int i = 0; i != 3; ++i) flat.push_back(rounded(p[i], 1e-4));
}

json script_data(const results& r, const view_frame& frame) {
  json j;
  if (r.slam && !r.slam->trajectory.empty()) {
    const auto& poses = r.slam->trajectory;
    const double start = poses.front().timestamp;
    json t = json::array(), estimate = json::array(), keyframes = json::array();
    for (std::size_t i = 0; i < poses.size(); i += thinning(poses.size(), 6000)) {
      t.push_back(rounded(poses[i].timestamp - start, 1e-3));
      append(estimate, frame.T_view_world * poses[i].T_world_camera.translation());
    }
    for (const auto& k : r.slam->keyframes) append(keyframes, frame.T_view_world * k.T_world_camera.translation());
    j["path"] = {{"t", t}, {"estimate", estimate}, {"keyframes", keyframes}};
    if (r.against_truth) {
      json when = json::array(), at = json::array(), error = json::array();
      const auto& pairs = r.against_truth->poses;
      for (std::size_t i = 0; i < pairs.size(); i += thinning(pairs.size(), 6000)) {
        when.push_back(rounded(pairs[i].timestamp - start, 1e-3));
        append(at, frame.T_view_world * pairs[i].truth);
        error.push_back(rounded(100 * pairs[i].error_m, 1e-3));
      }
      j["truth"] = {{"t", when}, {"at", at}, {"error", error}};
    }
    json ms = json::array();
    for (std::size_t i = 0; i < r.slam->tracking_ms.size(); i += thinning(r.slam->tracking_ms.size(), 20'000))
      ms.push_back(rounded(r.slam->tracking_ms[i], 0.01));
    j["tracking_ms"] = ms;
  }
  if (r.map) {
    const map_results& m = *r.map;
    json ms = json::array();
    for (const double v : m.insert_ms) ms.push_back(rounded(v, 0.01));
    j["insert_ms"] = ms;
    j["colors"] = m.cloud.has_colors();
    const orbis::mat3 axes = frame.T_view_world.rotation_matrix();
    j["axes"] = std::vector<double>(axes.data(), axes.data() + 9);  // column-major, as in WebGL
    double top = frame.high.z();
    for (const voxel& v : m.voxels_unfiltered) top = std::max(top, (frame.T_view_world * v.center.cast<double>()).z());
    top = std::min(top, frame.high.z() + 2.0);
    j["points"] = packed_points(m, frame);
    // The size at which neighbouring points on a surface touch.
    const vec3 size = frame.high - frame.low;
    const double area = 2 * (size.x() * size.y() + size.x() * size.z() + size.y() * size.z());
    const double shown = std::max(1.0, j["points"]["count"].get<double>());
    j["view"] = {{"low", {frame.low.x(), frame.low.y(), frame.low.z()}},
                 {"high", {frame.high.x(), frame.high.y(), frame.high.z()}},
                 {"cut", frame.cut},
                 {"top", top},
                 {"spacing", std::clamp(0.8 * std::sqrt(area / shown), 0.004, 0.1)}};
    j["voxels"] = {{"before", packed_voxels(m.voxels_unfiltered, m.resolution, frame)},
                   {"after", packed_voxels(m.voxels, m.resolution, frame)}};
  }
  return j;
}

// -- the page's static parts -------------------------------------------------------------------------

/// The unit of lengths.
std::string length_unit(const results& r) { return r.slam ? r.slam->unit() : "metres"; }

std::string card(const std::string& value, const std::string& what) {
  return "<div class=\"card\"><b>" + escaped(value) + "</b><span>" + escaped(what) + "</span></div>\n";
}

std::string header(const results& r) {
  std::string h = "<h1>" + escaped(r.title) + "</h1>\n<p class=\"lead\">";
  h += escaped(r.truth_note.empty() ? std::string{"RGB-D SLAM and mapping"} : r.truth_note) +
       "</p>\n<div class=\"cards\">\n";
  if (r.slam) {
    h += card(std::to_string(r.slam->tracked) + " / " + std::to_string(r.slam->frames), "frames tracked");
    h += card(std::to_string(r.slam->keyframes.size()), "keyframes");
  }
  if (r.against_truth) h += card(text("%.1f mm", 1e3 * r.against_truth->ate_rmse_m), "trajectory error (ATE RMSE)");
  if (r.map && r.map->error_m) h += card(text("%.1f mm", 1e3 * *r.map->error_m), "map error (RMS to the surface)");
  if (r.slam) h += card(text("%.1f ms", measure_spread(r.slam->tracking_ms).median), "median time to track a frame");
  if (r.map) {
    h += card(count_text(r.map->filtered.leaves), "leaves in the octree");
    h += card(bytes_text(r.map->filtered.bt_bytes), "map on disk");
  }
  h += "</div>\n";
  if (!r.warnings.empty()) {
    h += "<ul class=\"warnings\">";
    for (const std::string& w : r.warnings) h += "<li>" + escaped(w) + "</li>";
    h += "</ul>\n";
  }
  return h;
}

std::string text_table(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::string t = "<div class=\"panel\"><table class=\"words\">";
  for (const auto& [what, value] : rows) t += "<tr><td>" + escaped(what) + "</td><td>" + escaped(value) + "</td></tr>";
  return t + "</table></div>\n";
}

/// Formats the first ranges, and the number of omitted ones: "4, 100 ... 120".
std::string list_ranges(std::span<const frame_range> ranges) {
  constexpr std::size_t most = 12;
  std::string list;
  for (std::size_t i = 0; i != std::min(ranges.size(), most); ++i) {
    const frame_range& f = ranges[i];
    list += (i == 0 ? "" : ", ") + std::to_string(f.first);
    if (f.count > 1) list += " ... " + std::to_string(f.first + f.count - 1);
  }
  if (ranges.size() > most) list += " and " + std::to_string(ranges.size() - most) + " more ranges";
  return list;
}

std::string tracking_table(const slam_results& s) {
  std::vector<std::pair<std::string, std::string>> rows;
  if (!s.shutter.from.empty()) rows.emplace_back("shutter", describe(s.shutter) + " (" + s.shutter.from + ")");
  rows.emplace_back("landmark map",
                    count_text(s.landmarks) + " landmarks, " + count_text(s.keyframes.size()) + " keyframes");
  if (s.keyframes_culled != 0)
    rows.emplace_back("keyframes culled", count_text(s.keyframes_culled) + " redundant ones");
  rows.emplace_back("loops closed", count_text(s.loops_closed));
  if (s.maps_merged != 0) rows.emplace_back("maps merged", count_text(s.maps_merged));
  if (s.dropped) rows.emplace_back("dropped", count_text(*s.dropped) + " frames, which arrived during tracking");
  rows.emplace_back("lost", s.lost == 0 ? std::string{"never"}
                                        : count_text(s.lost) + " frames (" + list_ranges(s.lost_frames.ranges()) + ")");
  if (s.relocalized != 0) rows.emplace_back("relocalised", count_text(s.relocalized) + " frames");
  return "<h2>Tracking</h2>\n" + text_table(rows);
}

std::string tables(const results& r, const view_frame& frame) {
  std::string t;
  if (r.slam) t += tracking_table(*r.slam);
  if (r.map) {
    const map_results& m = *r.map;
    const auto row = [](const std::string& what, std::uintmax_t count, const char* unit, std::uintmax_t occupied,
                        std::uintmax_t bytes) {
      return "<tr><td>" + escaped(what) + "</td><td>" + count_text(count) + " " + unit + "</td><td>" +
             (occupied != 0 ? count_text(occupied) : "") + "</td><td>" + bytes_text(bytes) + "</td></tr>";
    };
    const std::string octree = text("octree, %g cm, ", 100 * m.resolution);
    t += "<h2>Sizes</h2>\n<div class=\"panel\"><table><tr><th></th><th>size</th><th>occupied</th><th>on "
         "disk</th></tr>";
    t += row("point cloud", m.cloud.size(), "points", 0, m.cloud_bytes);
    t += row("point cloud, filtered", m.kept.size(), "points", 0, m.filtered_bytes);
    t += row(octree + "before the filter", m.unfiltered.leaves, "leaves", m.unfiltered.occupied, m.unfiltered.bt_bytes);
    t += row(octree + "after the filter", m.filtered.leaves, "leaves", m.filtered.occupied, m.filtered.bt_bytes);
    t += "</table></div>\n<h2>Filter</h2>\n";
    t += text_table({{"mode", m.filter_mode}, {"removed", removed_text(m)}, {"reason", m.filter_reason}});
    if (const auto picture = orbis::read_file(r.folder / "filter.png"))
      t += "<figure class=\"panel\"><img alt=\"Octree before and after the filter, in the same view\" "
           "src=\"data:image/png;base64," +
           base64(*picture) + "\"></figure>\n";
  }
  if (r.navigation) {
    t += "<h2>Navigation</h2>\n" +
         text_table({{"floor", floor_text(*r.navigation)}, {"path", path_text(*r.navigation)}});
    if (const auto picture = orbis::read_file(r.folder / "navigation.png"))
      t += "<figure class=\"panel\"><img alt=\"Floor map with costs, and distances to obstacles, from above, "
           "with a path\" src=\"data:image/png;base64," +
           base64(*picture) + "\"></figure>\n";
  }
  if (r.against_truth) {
    const accuracy& a = *r.against_truth;
    t += "<h2>Against ground truth</h2>\n<div "
         "class=\"panel\"><table><tr><th></th><th>RMSE</th><th>mean</th><th>median</th><th>max</th></tr>";
    t +=
        text("<tr><td>absolute (ATE), mm, over %zu poses</td><td>%.2f</td><td>%.2f</td><td>%.2f</td><td>%.2f</td></tr>",
             a.poses.size(), 1e3 * a.ate_rmse_m, 1e3 * a.ate_mean_m, 1e3 * a.ate_median_m, 1e3 * a.ate_max_m);
    if (a.rpe_trans_rmse_m && a.rpe_rot_rmse_deg) {
      t += text(
          "<tr><td>relative (RPE), mm, between consecutive poses</td><td>%.2f</td><td></td><td></td><td></td></tr>",
          1e3 * *a.rpe_trans_rmse_m);
      t += text("<tr><td>relative (RPE), degrees</td><td>%.3f</td><td></td><td></td><td></td></tr>",
                *a.rpe_rot_rmse_deg);
    }
    t += "</table></div>\n";
  }
  auto setup = r.setup;
  if (r.world) setup.emplace_back("world", world_text(*r.world));
  const std::string note = view_frame_note(frame, length_unit(r));
  setup.emplace_back("pictures", (note.empty() ? "in the world frame of the files" : note) + "; T_view_world " +
                                     view_frame_text(frame));
  return t + "<h2>Input and settings</h2>\n" + text_table(setup);
}

std::string time_table(const std::vector<double>& values) {
  if (values.empty()) return "<p class=\"soft\">Not measured: no scans were inserted.</p>";
  const spread s = measure_spread(values);
  return text(
      "<table><tr><th></th><th>median</th><th>95 %%</th><th>mean</th><th>max</th></tr>"
      "<tr><td>ms</td><td>%.2f</td><td>%.2f</td><td>%.2f</td><td>%.2f</td></tr></table>",
      s.median, s.p95, s.mean, *std::max_element(values.begin(), values.end()));
}

std::string footer(const results& r) {
  return "<footer>Written by <code>rgbd_slam " + escaped(r.command) + "</code> of orbis, " +
         text("in %.1f s.", r.wall_s) + " The figures are in <a href=\"summary.json\">summary.json</a>.</footer>\n";
}

// -- filling in ---------------------------------------------------------------------------------------

/// Keeps or drops the parts between {{#name}} and {{/name}}.
void choose(std::string& page, const std::string& name, bool keep) {
  const std::string begin = "{{#" + name + "}}", end = "{{/" + name + "}}";
  for (std::size_t at; (at = page.find(begin)) != std::string::npos;) {
    const std::size_t stop = page.find(end, at);
    if (keep) {
      page.erase(stop, end.size());
      page.erase(at, begin.size());
    } else {
      page.erase(at, stop + end.size() - at);
    }
  }
}

/// Replaces all {{name}} in one pass, so that inserted values are not searched for placeholders.
std::string filled(std::string_view page, const std::map<std::string, std::string>& values) {
  std::string out;
  for (std::size_t at = 0;;) {
    const std::size_t begin = page.find("{{", at);
    out += page.substr(at, begin == std::string_view::npos ? begin : begin - at);
    if (begin == std::string_view::npos) return out;
    const std::size_t end = page.find("}}", begin);
    out += values.at(std::string{page.substr(begin + 2, end - begin - 2)});
    at = end + 2;
  }
}

}  // namespace

orbis::result<void> write_report(const results& r, const view_frame& frame) {
  std::string page = report_page;
  const bool path = r.slam && !r.slam->trajectory.empty();
  choose(page, "map", r.map.has_value());
  choose(page, "slam", path);
  choose(page, "truth", r.against_truth.has_value());
  const std::string note = view_frame_note(frame, length_unit(r));
  const auto picture = orbis::read_file(r.folder / "map.png");
  const std::string html =
      filled(page, {{"title", escaped(r.title)},
                    {"header", header(r)},
                    {"frame_note", note.empty() ? "" : "The view is " + note + "."},
                    {"picture", picture ? "data:image/png;base64," + base64(*picture) : "data:,"},
                    {"unit", length_unit(r)},
                    {"profile_height", r.against_truth ? "185" : "420"},
                    {"tables", tables(r, frame)},
                    {"tracking_table", r.slam ? time_table(r.slam->tracking_ms) : ""},
                    {"insert_title", r.live ? "time to insert a keyframe into the live map, on a separate thread"
                                            : "time to insert a depth image into the octree"},
                    {"insert_table", r.map ? time_table(r.map->insert_ms) : ""},
                    {"footer", footer(r)},
                    {"data", for_script(script_data(r, frame))}});
  return orbis::write_file_atomically(r.folder / "report.html", [&](std::ostream& out) { out << html; });
}

}  // namespace app

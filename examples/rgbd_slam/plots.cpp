// SPDX-License-Identifier: BSD-3-Clause
#include "plots.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <orbis/io/png.hpp>

#include "map_picture.hpp"
#include "summary.hpp"

namespace app {
namespace {

using orbis::vec2;
using orbis::vec3;

constexpr int zoom = 2;  // everything is drawn at twice the size and shrunk

const cv::Scalar ink{28, 32, 40}, faint{150, 155, 163}, grid{228, 230, 234}, truth_color{150, 155, 163},
    estimate_color{37, 99, 235}, error_color{200, 60, 50};

/// A sheet to draw on, in pixels of the finished picture.
class sheet {
 public:
  sheet(int width, int height) : pixels_(height * zoom, width * zoom, CV_8UC3, cv::Scalar(250, 250, 249)) {}

  void line(const vec2& a, const vec2& b, const cv::Scalar& color, double width = 1.0) {
    cv::line(pixels_, at(a), at(b), color, std::max(1, static_cast<int>(width * zoom)), cv::LINE_AA, 4);
  }
  void dot(const vec2& p, const cv::Scalar& color, double radius) {
    cv::circle(pixels_, at(p), static_cast<int>(radius * zoom * 16), color, cv::FILLED, cv::LINE_AA, 4);
  }
  /// `align`: 0 the text begins at `p`, 0.5 it is centred there, 1 it ends there.
  void text(const std::string& what, const vec2& p, const cv::Scalar& color = ink, double size = 13.0,
            double align = 0.0, bool bold = false) {
    const double scale = size * zoom / 30.0;
    const int thickness = bold ? 3 : 2;
    int below = 0;
    const cv::Size extent = cv::getTextSize(what, cv::FONT_HERSHEY_SIMPLEX, scale, thickness, &below);
    const cv::Point from(static_cast<int>(p.x() * zoom - align * extent.width), static_cast<int>(p.y() * zoom));
    cv::putText(pixels_, what, from, cv::FONT_HERSHEY_SIMPLEX, scale, color, thickness, cv::LINE_AA);
  }
  void paste(const orbis::image<orbis::rgb8>& picture, int x, int y) {
    const cv::Mat from(picture.height(), picture.width(), CV_8UC3,
                       const_cast<orbis::rgb8*>(picture.data()));  // only read
    cv::Mat to = pixels_(cv::Rect(x * zoom, y * zoom, picture.width() * zoom, picture.height() * zoom));
    cv::resize(from, to, to.size(), 0, 0, cv::INTER_NEAREST);
  }
  [[nodiscard]] orbis::result<void> write(const std::filesystem::path& path) const {
    orbis::image<orbis::rgb8> out(pixels_.cols / zoom, pixels_.rows / zoom);
    cv::Mat small(out.height(), out.width(), CV_8UC3, out.data());
    cv::resize(pixels_, small, small.size(), 0, 0, cv::INTER_AREA);
    return orbis::io::write_png(path, out.view());
  }

 private:
  static cv::Point at(const vec2& p) {  // with four fractional bits
    return {static_cast<int>(std::lround(p.x() * zoom * 16)), static_cast<int>(std::lround(p.y() * zoom * 16))};
  }
  cv::Mat pixels_;
};

/// A step of 1, 2 or 5 times a power of ten that divides `range` into about `parts`.
double nice_step(double range, int parts) {
  const double raw = std::max(range, 1e-9) / parts;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double digit = raw / power;
  return power * (digit < 1.5 ? 1 : digit < 3.5 ? 2 : digit < 7.5 ? 5 : 10);
}

std::string tick_text(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6);
  char buffer[48];
  std::snprintf(buffer, sizeof buffer, "%.*f", decimals, std::abs(value) < step * 1e-6 ? 0.0 : value);
  return buffer;
}

/// Axes on a part of a sheet.
class axes {
 public:
  struct range {
    double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
    void take(double v) {
      low = std::min(low, v);
      high = std::max(high, v);
    }
    [[nodiscard]] double length() const { return high - low; }
    [[nodiscard]] range padded(double share, double least) const {
      const double pad = std::max(share * length(), 0.5 * (least - length()));
      return {low - std::max(pad, 0.0), high + std::max(pad, 0.0)};
    }
  };

  axes(sheet& s, double left, double top, double width, double height, range x, range y, bool same_scale)
      : sheet_{s}, left_{left}, top_{top}, width_{width}, height_{height}, x_{x}, y_{y} {
    if (same_scale) {
      const double metres_per_pixel = std::max(x_.length() / width_, y_.length() / height_);
      const double more_x = 0.5 * (metres_per_pixel * width_ - x_.length());
      const double more_y = 0.5 * (metres_per_pixel * height_ - y_.length());
      x_ = {x_.low - more_x, x_.high + more_x};
      y_ = {y_.low - more_y, y_.high + more_y};
    }
  }

  void frame(const std::string& title, const std::string& x_label, const std::string& y_label) {
    const double step_x = nice_step(x_.length(), static_cast<int>(width_ / 110));
    const double step_y = nice_step(y_.length(), std::max(3, static_cast<int>(height_ / 70)));
    for (double v = std::ceil(x_.low / step_x) * step_x; v <= x_.high; v += step_x) {
      sheet_.line(place(v, y_.low), place(v, y_.high), grid);
      sheet_.text(tick_text(v, step_x), place(v, y_.low) + vec2(0, 18), faint, 11, 0.5);
    }
    for (double v = std::ceil(y_.low / step_y) * step_y; v <= y_.high; v += step_y) {
      sheet_.line(place(x_.low, v), place(x_.high, v), grid);
      sheet_.text(tick_text(v, step_y), place(x_.low, v) + vec2(-8, 4), faint, 11, 1.0);
    }
    sheet_.text(title, {left_, top_ - 12}, ink, 14.5);
    sheet_.text(x_label, {left_ + width_, top_ + height_ + 36}, faint, 11.5, 1.0);
    sheet_.text(y_label, {left_ + width_, top_ - 12}, faint, 11.5, 1.0);
  }
  [[nodiscard]] vec2 place(double x, double y) const {
    return {left_ + (x - x_.low) / x_.length() * width_, top_ + (y_.high - y) / y_.length() * height_};
  }
  void curve(const std::vector<vec2>& points, const cv::Scalar& color, double width) {
    for (std::size_t i = 1; i < points.size(); ++i)
      sheet_.line(place(points[i - 1].x(), points[i - 1].y()), place(points[i].x(), points[i].y()), color, width);
  }

 private:
  sheet& sheet_;
  double left_, top_, width_, height_;
  range x_, y_;
};

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

  axes plan{s, 80, 125, 640, 630, x.padded(0.06, 0.2), y.padded(0.06, 0.2), true};
  s.text(view_frame_note, {60, 806}, faint, 11);
  plan.frame("from above", "x, m", "y, m");
  plan.curve(true_above, truth_color, 2.6);
  plan.curve(above, estimate_color, 1.5);
  for (const orbis::stamped_pose& k : r.slam->keyframes) {
    const vec3 v = frame.T_view_world * k.T_world_camera.translation();
    s.dot(plan.place(v.x(), v.y()), estimate_color, 2.6);
  }
  s.dot(plan.place(above.front().x(), above.front().y()), {22, 140, 80}, 5.5);
  s.text("start", plan.place(above.front().x(), above.front().y()) + vec2(9, -7), {22, 140, 80}, 12);

  const axes::range time = t.padded(0.0, 0.1);
  axes profile{s, 830, 125, 610, compared ? 260.0 : 630.0, time, z.padded(0.1, 0.1), false};
  profile.frame("height", "time, s", "m");
  profile.curve(true_height, truth_color, 2.6);
  profile.curve(height, estimate_color, 1.5);
  if (compared) {
    axes off{s, 830, 475, 610, 280, time, {0.0, std::max(1.1 * e.high, 0.1)}, false};
    off.frame("distance to ground truth, after alignment", "time, s", "cm");
    off.curve(error, error_color, 1.6);
    const double rmse = 100 * r.against_truth->ate_rmse_m;
    off.curve({{time.low, rmse}, {time.high, rmse}}, faint, 1.0);
    s.text("RMSE", off.place(time.low, rmse) + vec2(6, -5), faint, 11);
  }
  return s.write(r.folder / "trajectory.png");
}

orbis::result<void> write_map_picture(const std::string& name, const std::string& title, const tree_numbers& numbers,
                                      const std::vector<voxel>& voxels, bool colors, const results& r,
                                      const view_frame& frame) {
  sheet s{1500, 820};
  s.paste(draw_aslant(voxels, r.map->voxels, frame, colors ? coloring::camera : coloring::height, 880, 700), 20, 100);
  s.paste(draw_from_above(voxels, r.map->voxels, frame, coloring::height, 560, 620), 920, 130);
  s.text(title, {60, 44}, ink, 19, 0.0, true);
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, "%s occupied of %s known leaves, finest voxel %g cm, %s as .bt",
                count_text(numbers.occupied).c_str(), count_text(numbers.leaves).c_str(), 100 * r.map->resolution,
                bytes_text(numbers.bt_bytes).c_str());
  s.text(buffer, {60, 70}, faint, 13);
  s.text("from above, by height", {1200, 118}, faint, 12, 0.5);
  std::snprintf(buffer, sizeof buffer, "%.1f m", frame.cut);
  for (int i = 0; i != 200; ++i) {
    const orbis::rgb8 c = height_color(i / 199.0);
    s.line({1100.0 + i, 785}, {1100.0 + i, 793}, cv::Scalar(c.r, c.g, c.b), 1.0);
  }
  s.text(view_frame_note, {60, 806}, faint, 11);
  s.text("0", {1092, 794}, faint, 11, 1.0);
  s.text(buffer, {1308, 794}, faint, 11);
  return s.write(r.folder / name);
}

/// The octree before the filter and after it, side by side in the same view, with the sizes below.
orbis::result<void> write_filter_picture(const results& r, const view_frame& frame) {
  const map_results& m = *r.map;
  const coloring how = m.cloud.has_colors() ? coloring::camera : coloring::height;
  sheet s{1500, 820};
  s.text(r.title + ": the octree before and after the filter", {60, 44}, ink, 19, 0.0, true);
  s.text("filter: " + m.filter_mode + ", removed " + removed_text(m), {60, 70}, faint, 13);
  const auto panel = [&](int x, const std::string& name, const std::vector<voxel>& voxels, const tree_numbers& numbers,
                         std::size_t points, std::uintmax_t bytes) {
    s.paste(draw_aslant(voxels, m.voxels, frame, how, 720, 600), x, 112);
    s.text(name, {x + 360.0, 106}, ink, 14, 0.5, true);
    s.text("cloud: " + count_text(points) + " points, " + bytes_text(bytes), {x + 360.0, 738}, ink, 13, 0.5);
    s.text("octree: " + count_text(numbers.leaves) + " leaves, " + count_text(numbers.occupied) + " occupied, " +
               bytes_text(numbers.bt_bytes) + " as .bt",
           {x + 360.0, 762}, ink, 13, 0.5);
  };
  panel(20, "before", m.voxels_unfiltered, m.unfiltered, m.cloud.size(), m.cloud_bytes);
  panel(760, "after", m.voxels, m.filtered, m.kept.size(), m.filtered_bytes);
  s.text(view_frame_note, {60, 806}, faint, 11);
  return s.write(r.folder / "filter.png");
}

}  // namespace

orbis::result<void> write_pictures(const results& r, const view_frame& frame) {
  cv::setNumThreads(0);  // little work, for which a run must not end where there are no threads to be had
  if (auto done = write_trajectory_picture(r, frame); !done) return done;
  if (!r.map) return {};
  const map_results& m = *r.map;
  const bool colors = m.cloud.has_colors();
  if (auto done = write_map_picture("map_unfiltered.png", r.title + ": the map before the filter", m.unfiltered,
                                    m.voxels_unfiltered, colors, r, frame);
      !done)
    return done;
  if (auto done = write_filter_picture(r, frame); !done) return done;
  return write_map_picture("map.png", r.title + ": the map", m.filtered, m.voxels, colors, r, frame);
}

}  // namespace app

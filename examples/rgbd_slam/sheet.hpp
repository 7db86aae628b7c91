// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A drawing surface for plots, and axes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/png.hpp>

namespace app {

inline constexpr int zoom = 2;  // everything is drawn at twice the size and scaled down

inline const cv::Scalar ink{28, 32, 40}, faint{150, 155, 163}, grid{228, 230, 234}, truth_color{150, 155, 163},
    estimate_color{37, 99, 235}, error_color{200, 60, 50};

/// A drawing surface; coordinates are pixels of the final picture.
class sheet {
 public:
  sheet(int width, int height) : pixels_(height * zoom, width * zoom, CV_8UC3, cv::Scalar(250, 250, 249)) {}

  void line(const orbis::vec2& a, const orbis::vec2& b, const cv::Scalar& color, double width = 1.0) {
    cv::line(pixels_, at(a), at(b), color, std::max(1, static_cast<int>(width * zoom)), cv::LINE_AA, 4);
  }
  void dot(const orbis::vec2& p, const cv::Scalar& color, double radius) {
    cv::circle(pixels_, at(p), static_cast<int>(radius * zoom * 16), color, cv::FILLED, cv::LINE_AA, 4);
  }
  /// `align`: 0: the text begins at `p`; 0.5: it is centred at `p`; 1: it ends at `p`.
  void text(const std::string& what, const orbis::vec2& p, const cv::Scalar& color = ink, double size = 13.0,
            double align = 0.0, bool bold = false) {
    const cv::Point from(static_cast<int>((p.x() - align * text_width(what, size, bold)) * zoom),
                         static_cast<int>(p.y() * zoom));
    cv::putText(pixels_, what, from, cv::FONT_HERSHEY_SIMPLEX, font_scale(size), color, font_thickness(bold),
                cv::LINE_AA);
  }
  /// Draws a legend entry that begins at `p`; returns the start of the next entry.
  orbis::vec2 legend(const orbis::vec2& p, const cv::Scalar& color, const std::string& meaning) {
    constexpr double radius = 5.0, size = 11.5, to_text = 16.0, apart = 20.0;
    const orbis::vec2 middle = p + orbis::vec2(radius, -4.0);
    dot(middle, faint, radius + 0.5);  // a rim makes almost white colours visible
    dot(middle, color, radius);
    text(meaning, p + orbis::vec2(to_text, 0.0), ink, size);
    return p + orbis::vec2(to_text + text_width(meaning, size) + apart, 0.0);
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
  static double font_scale(double size) { return size * zoom / 30.0; }
  static int font_thickness(bool bold) { return bold ? 3 : 2; }
  static double text_width(const std::string& what, double size, bool bold = false) {
    int below = 0;
    const cv::Size extent =
        cv::getTextSize(what, cv::FONT_HERSHEY_SIMPLEX, font_scale(size), font_thickness(bold), &below);
    return static_cast<double>(extent.width) / zoom;
  }
  static cv::Point at(const orbis::vec2& p) {  // with four fractional bits
    return {static_cast<int>(std::lround(p.x() * zoom * 16)), static_cast<int>(std::lround(p.y() * zoom * 16))};
  }
  cv::Mat pixels_;
};

/// A step size of 1, 2 or 5 times a power of ten that divides `range` into about `parts` parts.
inline double nice_step(double range, int parts) {
  const double raw = std::max(range, 1e-9) / parts;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double digit = raw / power;
  return power * (digit < 1.5 ? 1 : digit < 3.5 ? 2 : digit < 7.5 ? 5 : 10);
}

inline std::string tick_text(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6);
  char buffer[48];
  std::snprintf(buffer, sizeof buffer, "%.*f", decimals, std::abs(value) < step * 1e-6 ? 0.0 : value);
  return buffer;
}

/// The axes of a plot in a part of a sheet.
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
    for (const double v : ticks(x_, step_x)) {
      sheet_.line(place(v, y_.low), place(v, y_.high), grid);
      sheet_.text(tick_text(v, step_x), place(v, y_.low) + orbis::vec2(0, 18), faint, 11, 0.5);
    }
    for (const double v : ticks(y_, step_y)) {
      sheet_.line(place(x_.low, v), place(x_.high, v), grid);
      sheet_.text(tick_text(v, step_y), place(x_.low, v) + orbis::vec2(-8, 4), faint, 11, 1.0);
    }
    sheet_.text(title, {left_, top_ - 12}, ink, 14.5);
    sheet_.text(x_label, {left_ + width_, top_ + height_ + 36}, faint, 11.5, 1.0);
    sheet_.text(y_label, {left_ + width_, top_ - 12}, faint, 11.5, 1.0);
  }
  [[nodiscard]] orbis::vec2 place(double x, double y) const {
    return {left_ + (x - x_.low) / x_.length() * width_, top_ + (y_.high - y) / y_.length() * height_};
  }
  void curve(const std::vector<orbis::vec2>& points, const cv::Scalar& color, double width) {
    for (std::size_t i = 1; i < points.size(); ++i)
      sheet_.line(place(points[i - 1].x(), points[i - 1].y()), place(points[i].x(), points[i].y()), color, width);
  }

 private:
  /// The multiples of `step` in a range; their number is limited even if adding the step has no effect due to rounding.
  [[nodiscard]] static std::vector<double> ticks(const range& r, double step) {
    std::vector<double> at;
    const double first = std::ceil(r.low / step);
    for (int i = 0; i != 50 && (first + i) * step <= r.high; ++i) at.push_back((first + i) * step);
    return at;
  }

  sheet& sheet_;
  double left_, top_, width_, height_;
  range x_, y_;
};

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A drawing surface for plots, and axes.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
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

#include "picture_colors.hpp"

namespace app {

/// A drawing surface; coordinates are pixels. Shapes may extend beyond the surface; those whose coordinates are not
/// finite are not drawn.
class sheet {
 public:
  sheet(int width, int height) : pixels_(width, height, paper) {}

  void line(const orbis::vec2& a, const orbis::vec2& b, orbis::rgb8 color, double width = 1.0) {
    curve({a, b}, color, width);
  }
  /// Draws a line from each point to the next.
  void curve(const std::vector<orbis::vec2>& points, orbis::rgb8 color, double width) {
    if (points.size() < 2) return;
    orbis::vec2 low = points.front(), high = low;
    for (const orbis::vec2& p : points) {
      if (!p.allFinite()) return;
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const orbis::vec2 margin = orbis::vec2::Constant(width + 1);
    draw(low - margin, high + margin, color, [&](cv::Mat& fine, const orbis::vec2& origin) {
      for (std::size_t i = 1; i != points.size(); ++i)
        cv::line(fine, at(points[i - 1] - origin), at(points[i] - origin), 255,
                 std::max(1, static_cast<int>(width * zoom)), cv::LINE_AA, fraction_bits);
    });
  }
  void dot(const orbis::vec2& p, orbis::rgb8 color, double radius) {
    const orbis::vec2 margin = orbis::vec2::Constant(radius + 1);
    draw(p - margin, p + margin, color, [&](cv::Mat& fine, const orbis::vec2& origin) {
      cv::circle(fine, at(p - origin), static_cast<int>(radius * zoom * (1 << fraction_bits)), 255, cv::FILLED,
                 cv::LINE_AA, fraction_bits);
    });
  }
  /// `align`: 0: the text begins at `p`; 0.5: it is centred at `p`; 1: it ends at `p`.
  void text(const std::string& what, const orbis::vec2& p, orbis::rgb8 color = ink, double size = 13.0,
            double align = 0.0, bool bold = false) {
    const orbis::vec2 extent = text_size(what, size, bold), from = p - orbis::vec2(align * extent.x(), 0.0);
    draw(from - orbis::vec2(2.0, extent.y() + 2.0), from + orbis::vec2(extent.x() + 2.0, size), color,
         [&](cv::Mat& fine, const orbis::vec2& origin) {
           const orbis::vec2 begin = (from - origin) * zoom;
           cv::putText(fine, what, {static_cast<int>(begin.x()), static_cast<int>(begin.y())}, cv::FONT_HERSHEY_SIMPLEX,
                       font_scale(size), 255, font_thickness(bold), cv::LINE_AA);
         });
  }
  /// Draws a legend entry that begins at `p`; returns the start of the next entry.
  orbis::vec2 legend(const orbis::vec2& p, orbis::rgb8 color, const std::string& meaning) {
    constexpr double radius = 5.0, size = 11.5, to_text = 16.0, apart = 20.0;
    const orbis::vec2 middle = p + orbis::vec2(radius, -4.0);
    dot(middle, faint, radius + 0.5);  // a rim makes almost white colours visible
    dot(middle, color, radius);
    text(meaning, p + orbis::vec2(to_text, 0.0), ink, size);
    return p + orbis::vec2(to_text + text_size(meaning, size).x() + apart, 0.0);
  }
  void paste(const orbis::image<orbis::rgb8>& picture, int x, int y) { paste(picture, x, y, picture.width()); }
  /// Scales a picture to a width, and pastes it. @pre it is not empty, and then lies within the surface
  void paste(const orbis::image<orbis::rgb8>& picture, int x, int y, int width) {
    assert(!picture.empty());
    const cv::Mat from(picture.height(), picture.width(), CV_8UC3,
                       const_cast<orbis::rgb8*>(picture.data()));  // only read
    const cv::Rect part(x, y, width, std::max(1, picture.height() * width / picture.width()));
    cv::Mat to = cv::Mat(pixels_.height(), pixels_.width(), CV_8UC3, pixels_.data())(part);
    cv::resize(from, to, part.size(), 0, 0, cv::INTER_AREA);
  }
  [[nodiscard]] orbis::result<void> write(const std::filesystem::path& path) const {
    return orbis::io::write_png(path, pixels_.view());
  }

 private:
  static constexpr int zoom = 2;  ///< text and lines are drawn at this scale and averaged
  static constexpr int fraction_bits = 4;

  /// Draws in one colour between `low` and `high`: `shape(fine, origin)` draws 255 on a black surface, enlarged by
  /// `zoom`, whose first pixel is `origin`.
  template <class Shape>
  void draw(const orbis::vec2& low, const orbis::vec2& high, orbis::rgb8 color, const Shape& shape) {
    if (!low.allFinite() || !high.allFinite()) return;
    const auto inside = [](double v, int limit) { return static_cast<int>(std::clamp<double>(v, 0.0, limit)); };
    const int left = inside(std::floor(low.x()), pixels_.width()), top = inside(std::floor(low.y()), pixels_.height());
    const int width = inside(std::ceil(high.x()), pixels_.width()) - left,
              height = inside(std::ceil(high.y()), pixels_.height()) - top;
    if (width == 0 || height == 0) return;
    cv::Mat fine = cv::Mat::zeros(height * zoom, width * zoom, CV_8UC1), share;
    shape(fine, orbis::vec2(left, top));
    cv::resize(fine, share, cv::Size(width, height), 0, 0, cv::INTER_AREA);
    const auto mix = [](std::uint8_t& to, std::uint8_t from, int weight) {
      to = static_cast<std::uint8_t>((from * weight + to * (255 - weight) + 127) / 255);
    };
    for (int y = 0; y != height; ++y)
      for (int x = 0; x != width; ++x) {
        const int weight = share.at<std::uint8_t>(y, x);
        if (weight == 0) continue;
        orbis::rgb8& pixel = pixels_(left + x, top + y);
        mix(pixel.r, color.r, weight);
        mix(pixel.g, color.g, weight);
        mix(pixel.b, color.b, weight);
      }
  }
  static double font_scale(double size) { return size * zoom / 30.0; }
  static int font_thickness(bool bold) { return bold ? 3 : 2; }
  /// Width of a text, and its height above the base line.
  static orbis::vec2 text_size(const std::string& what, double size, bool bold = false) {
    int below = 0;
    const cv::Size extent =
        cv::getTextSize(what, cv::FONT_HERSHEY_SIMPLEX, font_scale(size), font_thickness(bold), &below);
    return orbis::vec2(extent.width, extent.height) / zoom;
  }
  static cv::Point at(const orbis::vec2& p) {
    const auto fixed = [](double v) {  // far outside of the surface, the direction of a line is approximate
      constexpr double scale = zoom << fraction_bits, limit = 1 << 28;
      return static_cast<int>(std::lround(std::clamp(v * scale, -limit, limit)));
    };
    return {fixed(p.x()), fixed(p.y())};
  }

  orbis::image<orbis::rgb8> pixels_;
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
  void curve(std::vector<orbis::vec2> points, orbis::rgb8 color, double width) {
    for (orbis::vec2& p : points) p = place(p.x(), p.y());
    sheet_.curve(points, color, width);
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

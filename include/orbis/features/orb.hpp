// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// ORB features, spread evenly over the image.
///
/// Source: Rublee, Rabaud, Konolige, Bradski, "ORB: an efficient alternative to SIFT or SURF", ICCV
/// 2011. Corners (FAST-9/16) and descriptors are OpenCV's; choice, orientation and coordinates are ours.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include <orbis/core/image.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/spread.hpp>

namespace orbis::features {

struct orb_options {
  int max_features = 1000;
  int levels = 8;             ///< of the image pyramid; levels too small for a patch are left out
  float scale_factor = 1.2F;  ///< between two levels, > 1
  int threshold = 20;         ///< brightness step of a corner
  int min_threshold = 7;      ///< where nothing reaches `threshold`; the same as it to have only strong ones
};

/// Finds ORB features. Calls on a const object may run at the same time.
class orb_extractor {
 public:
  orb_extractor() = default;
  /// @pre max_features >= 0, levels >= 1, scale_factor > 1, 1 <= min_threshold <= threshold
  explicit orb_extractor(const orb_options& options) : options_{options} {
    assert(options.max_features >= 0 && options.levels >= 1 && options.scale_factor > 1.0F);
    assert(options.min_threshold >= 1 && options.min_threshold <= options.threshold);
  }

  [[nodiscard]] const orb_options& options() const noexcept { return options_; }

  /// The features of a grey image, ordered by level, then from top to bottom. `mask`: empty, or of
  /// the image's size, 0 where no keypoint may lie. An image too small for a patch (37 pixels) has no features.
  [[nodiscard]] features operator()(image_view<const std::uint8_t> image,
                                    image_view<const std::uint8_t> mask = {}) const {
    assert(mask.empty() || (mask.width() == image.width() && mask.height() == image.height()));
    features found;
    if (image.empty() || options_.max_features == 0) return found;
    return extract(as_mat(image), mask);
  }

  /// The same for a colour image, by its luma.
  [[nodiscard]] features operator()(image_view<const rgb8> image, image_view<const std::uint8_t> mask = {}) const {
    if (image.empty()) return {};
    const cv::Mat color(image.height(), image.width(), CV_8UC3,
                        const_cast<rgb8*>(image.data()),  // cv::Mat knows no const; it is only read
                        static_cast<std::size_t>(image.stride()) * sizeof(rgb8));
    cv::Mat grey;
    cv::cvtColor(color, grey, cv::COLOR_RGB2GRAY);
    return (*this)(
        image_view<const std::uint8_t>{grey.data, grey.cols, grey.rows, static_cast<std::ptrdiff_t>(grey.step1())},
        mask);
  }

 private:
  static constexpr int patch_radius = 15;  ///< of the disc that orientation and descriptor look at
  static constexpr int border = 19;        ///< a rotated pattern with its smoothing reaches this far

  static cv::Mat as_mat(image_view<const std::uint8_t> image) {
    return {image.height(), image.width(), CV_8UC1,
            const_cast<std::uint8_t*>(image.data()),  // cv::Mat knows no const; it is only read
            static_cast<std::size_t>(image.stride())};
  }

  [[nodiscard]] features extract(const cv::Mat& image, image_view<const std::uint8_t> mask) const {
    const std::vector<cv::Mat> pyramid = pyramid_of(image);
    std::vector<std::vector<corner>> corners;
    corners.reserve(pyramid.size());
    for (const cv::Mat& level : pyramid) corners.push_back(corners_of(level, image.size(), mask));
    const std::vector<int> quotas = quotas_of(corners);
    features found;
    for (std::size_t level = 0; level != pyramid.size(); ++level)
      describe(found, pyramid[level], image.size(),
               spread(std::move(corners[level]), quotas[level], pyramid[level].cols, pyramid[level].rows,
                      static_cast<float>(options_.threshold)),
               static_cast<int>(level));
    return found;
  }

  /// The levels that are large enough to hold a keypoint.
  [[nodiscard]] std::vector<cv::Mat> pyramid_of(const cv::Mat& image) const {
    std::vector<cv::Mat> pyramid;
    for (int level = 0; level != options_.levels; ++level) {
      const double scale = std::pow(static_cast<double>(options_.scale_factor), level);
      const cv::Size size(static_cast<int>(std::lround(image.cols / scale)),
                          static_cast<int>(std::lround(image.rows / scale)));
      if (size.width <= 2 * border || size.height <= 2 * border) break;
      if (level == 0) {
        pyramid.push_back(image);
      } else {
        cv::Mat smaller;
        cv::resize(pyramid.back(), smaller, size, 0, 0, cv::INTER_LINEAR_EXACT);
        pyramid.push_back(std::move(smaller));
      }
    }
    return pyramid;
  }

  /// How many features each level gives: proportional to the side of its image. What a coarse level
  /// cannot give goes to the finer ones; what is left then, to any that has more.
  [[nodiscard]] std::vector<int> quotas_of(const std::vector<std::vector<corner>>& corners) const {
    const double ratio = 1.0 / static_cast<double>(options_.scale_factor);
    std::vector<int> quotas(corners.size());
    int left = options_.max_features;
    for (std::size_t level = corners.size(); level-- != 0;) {
      const auto finer = static_cast<double>(level);  // the number of levels that are still to come
      const double share = std::pow(ratio, finer) * (1.0 - ratio) / (1.0 - std::pow(ratio, finer + 1.0));
      quotas[level] = std::min(static_cast<int>(corners[level].size()), static_cast<int>(std::lround(left * share)));
      left -= quotas[level];
    }
    for (std::size_t level = 0; level != corners.size(); ++level) {
      const int more = std::min(left, static_cast<int>(corners[level].size()) - quotas[level]);
      quotas[level] += more;
      left -= more;
    }
    return quotas;
  }

  [[nodiscard]] std::vector<corner> corners_of(const cv::Mat& level, cv::Size full,
                                               image_view<const std::uint8_t> mask) const {
    constexpr int inset = border - 3;  // FAST itself leaves out three pixels
    std::vector<cv::KeyPoint> found;
    cv::FAST(level(cv::Rect(inset, inset, level.cols - 2 * inset, level.rows - 2 * inset)), found,
             options_.min_threshold, true);
    std::vector<corner> corners;
    corners.reserve(found.size());
    for (const cv::KeyPoint& k : found) {
      const corner c{static_cast<int>(k.pt.x) + inset, static_cast<int>(k.pt.y) + inset, k.response};
      if (mask.empty() ||
          masked_in(mask, full_coordinate(c.x, level.cols, full.width), full_coordinate(c.y, level.rows, full.height)))
        corners.push_back(c);
    }
    return corners;
  }

  [[nodiscard]] static bool masked_in(image_view<const std::uint8_t> mask, double x, double y) {
    return mask(std::clamp(static_cast<int>(std::lround(x)), 0, mask.width() - 1),
                std::clamp(static_cast<int>(std::lround(y)), 0, mask.height() - 1)) != 0;
  }

  /// From a pixel of a level to the full image: pixels are areas whose centres lie at integers, so
  /// that plain multiplication would shift coarse keypoints by up to a pixel.
  [[nodiscard]] static double full_coordinate(int at, int level_size, int full_size) {
    return (at + 0.5) * full_size / level_size - 0.5;
  }

  /// Direction from a corner to the centre of brightness of the disc around it, in [0, 2 pi).
  [[nodiscard]] static float orientation_of(const cv::Mat& level, int x, int y) {
    static constexpr std::array<int, patch_radius + 1> half_width = [] {
      std::array<int, patch_radius + 1> widths{};
      for (int dy = 0; dy <= patch_radius; ++dy)
        while ((widths[static_cast<std::size_t>(dy)] + 1) * (widths[static_cast<std::size_t>(dy)] + 1) + dy * dy <=
               patch_radius * (patch_radius + 1))
          ++widths[static_cast<std::size_t>(dy)];
      return widths;
    }();
    int moment_x = 0;
    int moment_y = 0;
    for (int dy = -patch_radius; dy <= patch_radius; ++dy) {
      const std::uint8_t* row = level.ptr<std::uint8_t>(y + dy) + x;
      const int reach = half_width[static_cast<std::size_t>(dy < 0 ? -dy : dy)];
      int sum = 0;
      for (int dx = -reach; dx <= reach; ++dx) {
        sum += row[dx];
        moment_x += dx * row[dx];
      }
      moment_y += dy * sum;
    }
    constexpr float turn = 2.0F * std::numbers::pi_v<float>;
    float angle = std::atan2(static_cast<float>(moment_y), static_cast<float>(moment_x));
    if (angle < 0.0F) angle += turn;
    return angle < turn ? angle : 0.0F;
  }

  /// Appends the corners of a level with orientation and descriptor.
  void describe(features& found, const cv::Mat& level, cv::Size full, const std::vector<corner>& corners,
                int octave) const {
    if (corners.empty()) return;
    const float size =
        static_cast<float>(2 * patch_radius + 1) * static_cast<float>(full.width) / static_cast<float>(level.cols);
    std::vector<cv::KeyPoint> points;
    std::vector<float> angles;
    points.reserve(corners.size());
    angles.reserve(corners.size());
    for (const corner& c : corners) {
      constexpr float degrees = 180.0F / std::numbers::pi_v<float>;
      angles.push_back(orientation_of(level, c.x, c.y));
      points.emplace_back(static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(2 * patch_radius + 1),
                          angles.back() * degrees, c.response, 0, static_cast<int>(points.size()));
    }
    cv::Mat described;
    cv::ORB::create(1, options_.scale_factor, 1, border)->compute(level, points, described);

    // OpenCV may drop and reorder; class_id says which corner a row belongs to.
    for (std::size_t i = 0; i != points.size(); ++i) {
      const auto from = static_cast<std::size_t>(points[i].class_id);
      const corner& c = corners[from];
      keypoint k;
      k.x = static_cast<float>(full_coordinate(c.x, level.cols, full.width));
      k.y = static_cast<float>(full_coordinate(c.y, level.rows, full.height));
      k.size = size;
      k.angle = angles[from];
      k.response = c.response;
      k.octave = octave;
      found.keypoints.push_back(k);
      binary_descriptor<256> bits;
      std::memcpy(bits.words.data(), described.ptr(static_cast<int>(i)), sizeof bits);
      found.descriptors.push_back(bits);
    }
  }

  orb_options options_{};
};

}  // namespace orbis::features

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Subpixel right-image coordinates of features in a rectified stereo pair.
///
/// @code
///   const stereo_matcher match;
///   const std::vector<float> columns = match(left_features, left, right_features, right, {.max_disparity = 300.0F});
/// @endcode
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/detail/extract/workspace_pool.hpp>
#include <orbis/features/detail/match/search_among.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/pyramid.hpp>

namespace orbis::features {
namespace detail {

/// Rows of pixels in an image.
struct pixel_rows {
  const std::uint8_t* first = nullptr;
  std::ptrdiff_t stride = 0;  ///< distance between rows
  int readable = 0;           ///< number of readable pixels per row; may be more than are needed
};

/// A square of `side` x `side` pixels, and the strip of the same height along which it slides.
struct sliding_square {
  static constexpr int max_side = 31, max_shifts = 32;

  int side = 0;
  pixel_rows square;  ///< rows with at least `side` readable pixels
  pixel_rows strip;   ///< rows with at least `side` + `shifts` - 1 readable pixels
};

/// Sets `sums[k]` to four times the sum of absolute differences between the square and the strip starting at column
/// `k`, each minus its mean (rounded to a quarter of a grey value), for k < `shifts`. Writes a multiple of 16 sums;
/// those at index `shifts` and above are unspecified. @pre 1 <= side <= max_side, 1 <= shifts <= max_shifts
ORBIS_LAZY void slide_differences(const sliding_square& s, int shifts, std::int32_t* sums);

}  // namespace detail

/// Options of `stereo_matcher`. "Pixels of a level" refers to the keypoint's pyramid level.
struct stereo_options {
  int levels = 8;               ///< number of levels of the extractor's pyramid; ignored if the pyramids are given
  float scale_factor = 1.2F;    ///< ratio of the image sizes of successive levels; ignored if the pyramids are given
  float min_disparity = 0.0F;   ///< minimum of left minus right coordinate, pixels
  float max_disparity = 1e9F;   ///< maximum of left minus right coordinate, pixels
  float rows = 2.0F;            ///< maximum row difference between the keypoints, pixels of a level
  int octaves = 1;              ///< maximum level difference between the keypoints
  std::uint32_t distance = 75;  ///< maximum descriptor distance
  int radius = 5;               ///< half the side of the compared square, pixels of a level; <= 15
  int slide = 5;                ///< maximum shift from the right keypoint in either direction, pixels of a level; <= 15
  float outlier = 3.0F;         ///< maximum pixel difference of a match, as a multiple of the median over all matches
};

/// Finds the right-image coordinates of the left image's features in a rectified pair. The descriptor of a feature is
/// compared with those of right-image features in a band of rows around it. Then a square around the feature slides
/// along the row near the best match, on the feature's pyramid level, and two lines of equal slope through the smallest
/// differences give the subpixel position. The differences are invariant to a brightness offset. Concurrent calls on a
/// const object are allowed.
///
/// Source: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2: an open-source SLAM system for monocular, stereo and RGB-D cameras",
/// T-RO 33 (2017), section III.A. The line fit is from M. Shimizu, M. Okutomi, "Precise sub-pixel estimation on
/// area-based matching", ICCV 2001: sums of absolute differences are not parabolic, and fitting a parabola gives errors
/// 1.4 times as large.
template <class Distance = hamming>
class stereo_matcher {
 public:
  stereo_matcher() = default;
  explicit stereo_matcher(Distance distance) : distance_{std::move(distance)} {}

  /// Returns, for each feature of the left image, its column in the right image in pixels; NaN if not found. O(pixels +
  /// features x features in a band of rows).
  /// @pre both images have the same size; levels >= 1, scale_factor > 1, 0 <= radius <= 15, 1 <= slide <= 15
  template <feature_descriptor D>
  requires descriptor_distance<Distance, D>
  [[nodiscard]] std::vector<float> operator()(const basic_features<D>& left, image_view<const std::uint8_t> left_image,
                                              const basic_features<D>& right,
                                              image_view<const std::uint8_t> right_image,
                                              const stereo_options& options = {}) const {
    std::vector<float> columns;
    into(columns, left, left_image, right, right_image, options);
    return columns;
  }

  /// As above; writes to `columns`. Allocates nothing if previous images had the same size and number of features.
  template <feature_descriptor D>
  requires descriptor_distance<Distance, D>
  void into(std::vector<float>& columns, const basic_features<D>& left, image_view<const std::uint8_t> left_image,
            const basic_features<D>& right, image_view<const std::uint8_t> right_image,
            const stereo_options& options = {}) const {
    assert(options.levels >= 1 && options.scale_factor > 1.0F);
    assert(left_image.width() == right_image.width() && left_image.height() == right_image.height());
    auto memory = workspaces_.acquire();
    memory->left.build(left_image, options.levels, static_cast<double>(options.scale_factor), 1);
    memory->right.build(right_image, options.levels, static_cast<double>(options.scale_factor), 1);
    find(*memory, columns, left, memory->left, right, memory->right, options);
    workspaces_.release(std::move(memory));
  }

  /// As above, with the pyramids of both images from an extractor (`pyramid_extractor`). O(features x features in a
  /// band of rows). @pre both pyramids were built from images of the same size, with the same options
  template <feature_descriptor D>
  requires descriptor_distance<Distance, D>
  void into(std::vector<float>& columns, const basic_features<D>& left, const image_pyramid& left_pyramid,
            const basic_features<D>& right, const image_pyramid& right_pyramid,
            const stereo_options& options = {}) const {
    auto memory = workspaces_.acquire();
    find(*memory, columns, left, left_pyramid, right, right_pyramid, options);
    workspaces_.release(std::move(memory));
  }

 private:
  static constexpr int largest = 15;

  struct match_found {
    std::uint32_t query;
    float column;
    float difference;  ///< mean difference per pixel
  };
  struct placed {
    float column = std::numeric_limits<float>::quiet_NaN();
    float difference = 0.0F;
  };
  /// A right keypoint, for sorting by row.
  struct right_place {
    float x, y;
    std::int32_t octave;
    std::uint32_t index;
  };
  struct workspace {
    image_pyramid left, right;                ///< used if the caller provides no pyramids
    std::vector<double> scales;               ///< pixels of the image per pixel of a level
    std::vector<std::uint32_t> first_in_row;  ///< index into `rows`
    std::vector<right_place> rows;            ///< right keypoints, sorted by row
    detail::search_among_workspace search;
    std::vector<candidate> candidates;
    std::vector<match_found> found;
    std::vector<float> differences;
  };

  template <feature_descriptor D>
  void find(workspace& memory, std::vector<float>& columns, const basic_features<D>& left,
            const image_pyramid& left_pyramid, const basic_features<D>& right, const image_pyramid& right_pyramid,
            const stereo_options& options) const {
    assert(options.radius >= 0 && options.radius <= largest && options.slide >= 1 && options.slide <= largest);
    assert(left_pyramid.size() == right_pyramid.size());
    columns.assign(left.size(), std::numeric_limits<float>::quiet_NaN());
    if (left.empty() || right.empty() || left_pyramid.empty()) return;
    const int height = left_pyramid[0].height();
    fill_scales(memory, left_pyramid);
    sort_by_row(memory, right.keypoints, height);
    const auto list = [&](std::size_t q, auto&& add) { list_band(options, memory, height, left.keypoints[q], add); };
    detail::search_among(distance_, memory.candidates, memory.search, feature_view<D>{left.keypoints, left.descriptors},
                         feature_view<D>{right.keypoints, right.descriptors}, {}, list);
    memory.found.clear();
    for (const candidate& c : memory.candidates) {
      if (c.distance > options.distance) continue;
      const auto octave = static_cast<std::size_t>(left.keypoints[c.query].octave);
      const placed at = place(options, left_pyramid[octave], left_pyramid[0], left.keypoints[c.query],
                              right_pyramid[octave], right.keypoints[c.train], memory.scales[octave]);
      if (!(at.column <= left.keypoints[c.query].x - options.min_disparity) ||
          !(at.column >= left.keypoints[c.query].x - options.max_disparity))
        continue;
      memory.found.push_back({c.query, at.column, at.difference});
    }
    keep_alike(options, memory);
    for (const match_found& m : memory.found) columns[m.query] = m.column;
  }

  static void fill_scales(workspace& memory, const image_pyramid& pyramid) {
    memory.scales.clear();
    for (std::size_t level = 0; level != pyramid.size(); ++level)
      memory.scales.push_back(static_cast<double>(pyramid[0].width()) / pyramid[level].width());
  }
  [[nodiscard]] static int clamped_row(float y, int height) noexcept {  // clamps rows outside the image
    return static_cast<int>(std::clamp(std::floor(y + 0.5F), 0.0F, static_cast<float>(height - 1)));
  }

  /// Counting sort, as in `keypoint_grid`.
  static void sort_by_row(workspace& memory, std::span<const keypoint> right, int height) {
    std::vector<std::uint32_t>& first = memory.first_in_row;
    first.assign(static_cast<std::size_t>(height) + 1, 0);
    for (const keypoint& k : right) ++first[static_cast<std::size_t>(clamped_row(k.y, height))];
    for (std::size_t row = 1; row != first.size(); ++row) first[row] += first[row - 1];
    memory.rows.resize(right.size());
    for (std::size_t i = right.size(); i-- != 0;)
      memory.rows[--first[static_cast<std::size_t>(clamped_row(right[i].y, height))]] = {
          right[i].x, right[i].y, right[i].octave, static_cast<std::uint32_t>(i)};
  }

  /// Lists the right keypoints to be compared with a left keypoint.
  template <class Add>
  static void list_band(const stereo_options& options, const workspace& memory, int height, const keypoint& k,
                        Add&& add) {
    if (k.octave < 0 || static_cast<std::size_t>(k.octave) >= memory.scales.size() || !std::isfinite(k.x + k.y)) return;
    const auto octave_scale = [&](int octave) {
      return static_cast<float>(memory.scales[std::min(static_cast<std::size_t>(octave), memory.scales.size() - 1)]);
    };
    const float widest = options.rows * octave_scale(k.octave + options.octaves) + 0.5F;
    const int from = clamped_row(k.y - widest, height), to = clamped_row(k.y + widest, height);
    const float slack = static_cast<float>(options.slide) * octave_scale(k.octave);
    const float least = k.x - options.max_disparity - slack, most = k.x - options.min_disparity + slack;
    const right_place* const first = memory.rows.data() + memory.first_in_row[static_cast<std::size_t>(from)];
    const right_place* const end = memory.rows.data() + memory.first_in_row[static_cast<std::size_t>(to) + 1];
    for (const right_place* r = first; r != end; ++r)
      if (r->x >= least && r->x <= most && std::abs(r->octave - k.octave) <= options.octaves &&
          std::abs(r->y - k.y) <= options.rows * octave_scale(std::max(r->octave, k.octave)))
        add(r->index);
  }

  /// Locates the square around the left keypoint in the right image. `a` and `b`: the level in both images; `scale`:
  /// pixels of the `full` image per pixel of the level.
  [[nodiscard]] static placed place(const stereo_options& options, image_view<const std::uint8_t> a,
                                    image_view<const std::uint8_t> full, const keypoint& left,
                                    image_view<const std::uint8_t> b, const keypoint& right, double scale) {
    const auto to_level = [](float at, int full_size, int size) {
      return static_cast<int>(std::lround(image_pyramid::full_coordinate(static_cast<double>(at), full_size, size)));
    };
    const int x = to_level(left.x, full.width(), a.width()), y = to_level(left.y, full.height(), a.height());
    const int around = to_level(right.x, full.width(), b.width());
    const int r = options.radius;
    if (x < r || y < r || x + r >= a.width() || y + r >= a.height()) return {};
    const int first = std::max(around - options.slide, r), last = std::min(around + options.slide, b.width() - 1 - r);
    if (last - first < 2) return {};
    const int shifts = last - first + 1;
    const detail::sliding_square sliding{.side = 2 * r + 1,
                                         .square = {&a(x - r, y - r), a.stride(), a.width() - (x - r)},
                                         .strip = {&b(first - r, y - r), b.stride(), b.width() - (first - r)}};
    alignas(64) std::array<std::int32_t, detail::sliding_square::max_shifts> sums;
    detail::slide_differences(sliding, shifts, sums.data());
    const auto least = std::min_element(sums.begin(), sums.begin() + shifts);
    const int best = first + static_cast<int>(least - sums.begin());
    if (best == first || best == last) return {};  // the minimum may be outside the range
    const auto sum = [&](int at) { return static_cast<double>(sums[static_cast<std::size_t>(at - first)]); };
    const double before = sum(best - 1), after = sum(best + 1), bend = std::max(before, after) - sum(best);
    const double within = bend > 0.0 ? 0.5 * (before - after) / bend : 0.0;
    const double disparity = (static_cast<double>(x - best) - within) * scale;
    return {static_cast<float>(static_cast<double>(left.x) - disparity),
            static_cast<float>(sum(best)) / static_cast<float>(4 * (2 * r + 1) * (2 * r + 1))};
  }

  /// Drops matches whose pixel difference is far above the median.
  static void keep_alike(const stereo_options& options, workspace& memory) {
    if (memory.found.empty()) return;
    memory.differences.clear();
    for (const match_found& m : memory.found) memory.differences.push_back(m.difference);
    const auto middle = memory.differences.begin() + static_cast<std::ptrdiff_t>(memory.differences.size() / 2);
    std::nth_element(memory.differences.begin(), middle, memory.differences.end());
    const float limit = options.outlier * std::max(*middle, 1.0F);
    std::erase_if(memory.found, [&](const match_found& m) { return m.difference > limit; });
  }

  [[no_unique_address]] Distance distance_{};
  mutable detail::workspace_pool<workspace> workspaces_;
};

}  // namespace orbis::features

#ifndef ORBIS_COMPILED
#include <orbis/features/stereo-inl.hpp>
#endif

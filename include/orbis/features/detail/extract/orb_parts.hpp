// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The parts of the ORB extractor. Their code is in fast.hpp, cover_first.hpp, orientation.hpp and steered_brief.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/extractor.hpp>

namespace orbis::features::detail {

/// Finds FAST-9/16 corners: nine contiguous pixels of the circle of radius 3 are all brighter or all
/// darker than the centre by more than a threshold. The response is the largest threshold at which
/// the pixel still is a corner; only pixels with a larger one than their eight neighbours count. The
/// threshold adapts to the texture: a cell of the area that has a corner of at least `strong` keeps only
/// such ones; the others keep all down to `weak`. As a response does not depend on the threshold, one
/// pass finds both.
///
/// Three things differ from other implementations by default. A slight smoothing, and that a corner whose
/// neighbour happens to be equal is not lost, make corners come again (by several per cent, under noise and shifts
/// most). A parabola through the scores of the pixel and its neighbours tells where the peak is (a third less
/// error). Without them the corners are OpenCV's.
struct fast9 {
  int cell = 35;       ///< side, pixels; about the reach of a descriptor
  bool smooth = true;  ///< look at the image convolved with the binomial (1, 2, 1) / 4 in x and y
  bool ties = true;    ///< of equal neighbours the last by row, then column, is a corner; false: none of them

  bool subpixel = true;  ///< fill in `dx` and `dy`

  struct workspace {
    std::vector<std::uint8_t> band;  ///< rows of the smoothed image
    std::vector<std::uint8_t> line;
    std::vector<std::uint8_t> scores;  ///< of three rows
    std::vector<std::uint32_t> columns;
    std::vector<std::uint32_t> cell_of;  ///< of each corner
    std::vector<float> strongest;        ///< of each cell
  };

  /// Replaces `corners` by those of the area. Pixels whose circle leaves the image are no corners. O(pixels of the
  /// area).
  /// @pre the area lies in the image; 0 <= weak <= strong <= 254; cell >= 1
  void operator()(image_view<const std::uint8_t> image, const region& area, const corner_thresholds& thresholds,
                  workspace& memory, std::vector<corner>& corners) const;

 private:
  void find_peaks(image_view<const std::uint8_t> image, const region& area, int threshold, workspace& memory,
                  std::vector<corner>& corners) const;
  static void smooth_band(image_view<const std::uint8_t> image, int left, int count, int first, int last,
                          workspace& memory);
  void drop_weak(const region& area, int strong, workspace& memory, std::vector<corner>& corners) const;
};
static_assert(corner_detector<fast9>);

/// Covers the image first: it is cut into square cells, as many as a share of the wanted corners, and every cell gives
/// its strongest corner of all levels. The rest are the strongest corners of their levels, wherever they are, because
/// strong corners are found again in other images. A cell gives one corner, not one on each level, so that there is
/// room for these. O(n), and sorting of the chosen corners.
struct cover_first {
  double share = 0.25;  ///< of the wanted corners, for covering; 0 (none) ... 1: from best found again to best spread

  struct workspace {
    struct candidate {
      float response = -1.0F;
      std::uint32_t level = 0;
      std::uint32_t index = 0;
    };
    std::vector<int> quotas;
    std::vector<candidate> best;  ///< of each cell
    std::vector<std::vector<corner>> covering;
  };

  /// @pre 0 <= share <= 1
  void operator()(std::span<level_corners> levels, int wanted, workspace& memory) const;

 private:
  void take_covering(std::span<level_corners> levels, int wanted, workspace& memory) const;
};
static_assert(corner_selection<cover_first>);

inline constexpr int disc_radius = 15;

/// The direction from a pixel to the centre of brightness of the disc of radius 15 around it
/// (Rosin, "Measuring corner properties", 1999, as in the ORB paper); 0 where there is none.
struct intensity_centroid {
  static constexpr int radius = disc_radius;

  /// @pre at least `radius` pixels from the image's edge, on the right one more
  [[nodiscard]] orientation operator()(image_view<const std::uint8_t> image, int x, int y) const;
};
static_assert(orientation_estimator<intensity_centroid>);

/// Memory of `smooth`, which the next call uses again.
struct smooth_workspace {
  std::vector<std::uint8_t> line;  ///< a row with its reflections
  std::vector<std::int16_t> sums;  ///< the last eight rows, smoothed horizontally
};

/// ORB's descriptor: the standard pattern, turned to the keypoint's direction and rounded to pixels,
/// on the image smoothed by a Gaussian (7x7, sigma 2). The same bits as OpenCV's ORB wherever the direction is the
/// same.
struct steered_brief {
  using descriptor = binary_descriptor<256>;
  static constexpr int reach = 18;     ///< of the turned pattern, pixels
  static constexpr int diameter = 31;  ///< of the described neighbourhood, by convention

  struct workspace {
    std::vector<std::uint8_t> pixels;
    image_view<const std::uint8_t> smoothed;
    smooth_workspace smoothing;
  };

  /// Smooths what descriptors of keypoints in rows `[first, last)` need. @pre image of at least 4x4 pixels
  void prepare(image_view<const std::uint8_t> image, int first, int last, workspace& memory) const;

  /// @pre at least `reach` pixels from the edge of the prepared image, in its prepared rows
  [[nodiscard]] descriptor operator()(const workspace& prepared, int x, int y, const orientation& o) const;
};
static_assert(patch_descriptor<steered_brief>);

}  // namespace orbis::features::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The parts of the ORB extractor. Implemented in fast.hpp, cover_first.hpp, orientation.hpp and steered_brief.hpp.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/extractor.hpp>

namespace orbis::features::detail {

/// Detects FAST-9/16 corners: nine contiguous pixels on the circle of radius 3 are all brighter or all darker than the
/// centre by more than a threshold. The response is the largest threshold at which the pixel is still a corner; only
/// pixels with a larger response than their eight neighbours count. The threshold adapts to the texture: a cell of the
/// area that has a corner with a response of at least `strong` keeps only such corners; other cells keep all corners
/// with a response of at least `weak`. A response does not depend on the threshold, so one pass finds both.
///
/// The defaults differ from other implementations in three respects. Slight smoothing, and keeping a corner whose
/// neighbour has an equal response, improve repeatability (by several per cent, most under noise and shifts). A
/// parabola through the scores of the pixel and its neighbours gives the subpixel peak (a third less error). With these
/// options off, the corners equal OpenCV's.
struct fast9 {
  int cell = 35;       ///< side of a cell, pixels; about the extent of a descriptor
  bool smooth = true;  ///< convolve the image with the binomial (1, 2, 1) / 4 in x and y first
  bool ties = true;    ///< the last of equal neighbours (by row, then column) is a corner; false: none is

  bool subpixel = true;  ///< compute `dx` and `dy`

  struct workspace {
    std::vector<std::uint8_t> band;  ///< rows of the smoothed image
    std::vector<std::uint8_t> line;
    std::vector<std::uint8_t> scores;  ///< scores of three rows
    std::vector<std::uint32_t> columns;
    std::vector<std::uint32_t> cell_of;  ///< cell of each corner
    std::vector<float> strongest;        ///< strongest response in each cell
  };

  /// Replaces `corners` with the corners in the area. Pixels whose circle leaves the image are not corners. O(pixels of
  /// the area). @pre the area is inside the image; 0 <= weak <= strong <= 254; cell >= 1
  ORBIS_LAZY void operator()(image_view<const std::uint8_t> image, const region& area,
                             const corner_thresholds& thresholds, workspace& memory,
                             std::vector<corner>& corners) const;

 private:
  ORBIS_LAZY void find_peaks(image_view<const std::uint8_t> image, const region& area, int threshold, workspace& memory,
                             std::vector<corner>& corners) const;
  ORBIS_LAZY static void smooth_band(image_view<const std::uint8_t> image, int left, int count, int first, int last,
                                     workspace& memory);
  ORBIS_LAZY void drop_weak(const region& area, int strong, workspace& memory, std::vector<corner>& corners) const;
};
static_assert(corner_detector<fast9>);

/// Selects corners that cover the image first. The image is divided into square cells, whose number is a fraction of
/// the number of requested corners, and every cell contributes its strongest corner across all levels. The rest are the
/// strongest corners of their levels, at any position, because strong corners are more repeatable. A cell contributes
/// one corner in total, not one per level, which leaves room for strong corners. O(n), plus sorting of the selected
/// corners.
struct cover_first {
  double share = 0.25;  ///< fraction of the corners used for coverage; 0: most repeatable, 1: best distributed

  struct workspace {
    struct candidate {
      float response = -1.0F;
      std::uint32_t level = 0;
      std::uint32_t index = 0;
    };
    std::vector<int> quotas;
    std::vector<candidate> best;  ///< best corner of each cell
    std::vector<std::vector<corner>> covering;
  };

  /// @pre 0 <= share <= 1
  ORBIS_LAZY void operator()(std::span<level_corners> levels, int wanted, workspace& memory) const;

 private:
  ORBIS_LAZY void take_covering(std::span<level_corners> levels, int wanted, workspace& memory) const;
};
static_assert(corner_selection<cover_first>);

inline constexpr int disc_radius = 15;

/// The direction from a pixel to the intensity centroid of the disc of radius 15 around it (Rosin, "Measuring corner
/// properties", 1999, as in the ORB paper); 0 if undefined.
struct intensity_centroid {
  static constexpr int radius = disc_radius;

  /// @pre the pixel is at least `radius` pixels from the image edge, and `radius` + 1 pixels from the right edge
  ORBIS_LAZY [[nodiscard]] orientation operator()(image_view<const std::uint8_t> image, int x, int y) const;
};
static_assert(orientation_estimator<intensity_centroid>);

/// Reusable memory for `smooth`.
struct smooth_workspace {
  std::vector<std::uint8_t> line;  ///< a row with reflected borders
  std::vector<std::int16_t> sums;  ///< the last eight rows, smoothed horizontally
};

/// ORB's descriptor: the standard pattern, rotated to the keypoint's orientation and rounded to pixels, in the image
/// smoothed by a Gaussian (7x7, sigma 2). Bit-identical to OpenCV's ORB for the same orientation.
struct steered_brief {
  using descriptor = binary_descriptor<256>;
  static constexpr int reach = 18;     ///< extent of the rotated pattern, pixels
  static constexpr int diameter = 31;  ///< diameter of the described neighbourhood, by convention

  struct workspace {
    std::vector<std::uint8_t> pixels;
    image_view<const std::uint8_t> smoothed;
    smooth_workspace smoothing;
  };

  /// Smooths the pixels that descriptors of keypoints in rows `[first, last)` need. @pre the image has at least 4x4
  /// pixels
  ORBIS_LAZY void prepare(image_view<const std::uint8_t> image, int first, int last, workspace& memory) const;

  /// @pre the pixel is at least `reach` pixels from the edge of the prepared image, and its row is prepared
  ORBIS_LAZY [[nodiscard]] descriptor operator()(const workspace& prepared, int x, int y, const orientation& o) const;
};
static_assert(patch_descriptor<steered_brief>);

}  // namespace orbis::features::detail

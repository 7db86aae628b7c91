// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The image pyramid of an extractor.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace orbis::slam {

/// The levels of an image pyramid and their scales.
class pyramid_scales {
 public:
  pyramid_scales() : pyramid_scales(8, 1.2) {}
  /// Creates the scales of `levels` levels, each smaller than the previous one by the factor `factor`.
  pyramid_scales(int levels, double factor) : levels_{levels}, factor_{factor} {
    for (int octave = 0; octave != tabled; ++octave)
      scales_[static_cast<std::size_t>(octave)] = std::pow(factor, octave);
  }

  [[nodiscard]] int levels() const noexcept { return levels_; }
  [[nodiscard]] double factor() const noexcept { return factor_; }
  /// The size of a pixel on a level, in pixels of the full image.
  [[nodiscard]] double scale(int octave) const {
    return octave >= 0 && octave < tabled ? scales_[static_cast<std::size_t>(octave)] : std::pow(factor_, octave);
  }
  /// 1 / sigma^2 of a keypoint's position, where sigma is one pixel of its level; in 1 / pixel^2 of the full image.
  [[nodiscard]] double information(int octave) const { return 1.0 / (scale(octave) * scale(octave)); }

 private:
  static constexpr int tabled = 16;  // a table, because it is read for every observation
  int levels_;
  double factor_;
  std::array<double, tabled> scales_;
};

}  // namespace orbis::slam

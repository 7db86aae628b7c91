// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The exact distance transform of a whole box, to compare with: P. F. Felzenszwalb, D. P. Huttenlocher, "Distance
/// Transforms of Sampled Functions", Theory of Computing 8, 2012, algorithm 1 along each axis.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <vector>

namespace orbis::bench {

/// Squared distances in voxels to the nearest occupied one, of every voxel of a box. Keeps its memory.
class box_distances {
 public:
  explicit box_distances(const std::array<int, 3>& size) : size_{size} {
    const auto longest = static_cast<std::size_t>(std::max({size[0], size[1], size[2]}));
    squared_.resize(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                    static_cast<std::size_t>(size[2]));
    line_.resize(longest);
    parabola_.resize(longest);
    border_.resize(longest + 1);
  }
  /// Nothing is occupied.
  void clear() { std::fill(squared_.begin(), squared_.end(), far); }
  void occupy(const std::array<int, 3>& p) { squared_[index(p)] = 0.0F; }
  /// What was occupied becomes distances. Without anything occupied they stay `far`. O(voxels).
  void transform() {
    const std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(size_[0]),
                                            static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1])};
    for (std::size_t axis = 0; axis != 3; ++axis) {
      const std::size_t a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
      for (int j = 0; j != size_[b]; ++j)
        for (int i = 0; i != size_[a]; ++i)
          transform_line(
              squared_.data() + static_cast<std::size_t>(i) * stride[a] + static_cast<std::size_t>(j) * stride[b],
              stride[axis], size_[axis]);
    }
  }
  [[nodiscard]] float squared(const std::array<int, 3>& p) const { return squared_[index(p)]; }
  [[nodiscard]] std::size_t bytes() const { return squared_.capacity() * sizeof(float); }

  static constexpr float far = 1e12F;

 private:
  [[nodiscard]] std::size_t index(const std::array<int, 3>& p) const {
    return (static_cast<std::size_t>(p[2]) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(p[1])) *
               static_cast<std::size_t>(size_[0]) +
           static_cast<std::size_t>(p[0]);
  }
  /// The lower envelope of the parabolas that stand on the line's voxels.
  void transform_line(float* values, std::size_t stride, int count) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    int last = -1;  // of the parabolas in the envelope
    for (int q = 0; q != count; ++q) {
      const float height = line_[static_cast<std::size_t>(q)] = values[static_cast<std::size_t>(q) * stride];
      if (height >= far) continue;  // nothing is nearer by this one
      const auto meets = [&](int v) {
        return ((height + static_cast<float>(q) * static_cast<float>(q)) -
                (line_[static_cast<std::size_t>(v)] + static_cast<float>(v) * static_cast<float>(v))) /
               static_cast<float>(2 * (q - v));
      };
      float from = -infinity;
      for (; last >= 0; --last) {
        from = meets(parabola_[static_cast<std::size_t>(last)]);
        if (from > border_[static_cast<std::size_t>(last)]) break;
      }
      if (last < 0) from = -infinity;
      ++last;
      parabola_[static_cast<std::size_t>(last)] = q;
      border_[static_cast<std::size_t>(last)] = from;
    }
    if (last < 0) return;
    border_[static_cast<std::size_t>(last) + 1] = infinity;
    std::size_t k = 0;
    for (int q = 0; q != count; ++q) {
      while (border_[k + 1] < static_cast<float>(q)) ++k;
      const int v = parabola_[k];
      values[static_cast<std::size_t>(q) * stride] =
          static_cast<float>((q - v) * (q - v)) + line_[static_cast<std::size_t>(v)];
    }
  }

  std::array<int, 3> size_;
  std::vector<float> squared_, line_, border_;
  std::vector<int> parabola_;
};

}  // namespace orbis::bench

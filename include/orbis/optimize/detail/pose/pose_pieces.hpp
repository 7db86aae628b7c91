// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Observations in the layout of the kernels of pose refinement, on the stack for any number of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include <orbis/optimize/detail/pose/pose_kernels.hpp>
#include <orbis/optimize/reprojection.hpp>

namespace orbis::optimize::detail {

/// The observations of a refinement as a structure of arrays: packed once if they fit, else piece by piece in every
/// pass. Active are those that are not outliers.
class pose_pieces {
 public:
  pose_pieces(std::span<const pose_observation> observations, std::span<const std::uint8_t> outliers)
      : observations_{observations}, outliers_{outliers} {
    if (fits()) pack(0);
  }

  /// Whether an observation has information and numbers that are finite when squared.
  [[nodiscard]] static bool usable(const pose_observation& o) {
    constexpr double most = 1e100;
    const double size = std::abs(o.point.x()) + std::abs(o.point.y()) + std::abs(o.point.z()) + std::abs(o.pixel.x()) +
                        std::abs(o.pixel.y()) + o.information;
    return size < most && o.information > 0.0 && !(std::abs(o.right) >= most);
  }

  /// Calls `f(lanes, first, count, padded)` for every piece; `padded` is `count` rounded up to a multiple of eight.
  template <class F>
  void for_each(F&& f) {
    for (std::size_t first = 0; first < observations_.size(); first += pose_lanes::capacity) {
      if (!fits()) pack(first);
      const std::size_t count = std::min(observations_.size() - first, pose_lanes::capacity);
      f(std::as_const(lanes_), first, count, padded(count));
    }
  }

  /// Call this when the outliers have changed.
  void update() {
    if (!fits()) return;
    for (std::size_t i = 0; i != observations_.size(); ++i)
      lanes_.active[i] = outliers_[i] == 0 ? lanes_.information[i] : 0.0;
  }

 private:
  [[nodiscard]] bool fits() const noexcept { return observations_.size() <= pose_lanes::capacity; }
  [[nodiscard]] static std::size_t padded(std::size_t count) noexcept {
    constexpr std::size_t width = 8;
    return (count + width - 1) / width * width;
  }

  void pack(std::size_t first) {
    const std::size_t count = std::min(observations_.size() - first, pose_lanes::capacity);
    const pose_observation nothing{.point = vec3(0.0, 0.0, 1.0), .information = 0.0};
    for (std::size_t i = 0; i != padded(count); ++i) {
      const bool use = i < count && usable(observations_[first + i]);
      const pose_observation& o = use ? observations_[first + i] : nothing;
      lanes_.x[i] = o.point.x();
      lanes_.y[i] = o.point.y();
      lanes_.z[i] = o.point.z();
      lanes_.u[i] = o.pixel.x();
      lanes_.v[i] = o.pixel.y();
      lanes_.right[i] = o.right;
      lanes_.information[i] = o.information;
      lanes_.active[i] = use && outliers_[first + i] == 0 ? o.information : 0.0;
    }
  }

  std::span<const pose_observation> observations_;
  std::span<const std::uint8_t> outliers_;
  pose_lanes lanes_;
};

}  // namespace orbis::optimize::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The points of a scan as what integrates them reads them: floats in memory.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <ranges>
#include <vector>

#include <orbis/core/point.hpp>

namespace orbis::octree::detail {

/// Points as floats x, y, z, x, y, z ... in memory.
struct point_view {
  const float* xyz = nullptr;
  std::size_t count = 0;

  [[nodiscard]] std::array<float, 3> operator()(std::size_t i) const noexcept {
    return {xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]};
  }
};

/// Whether the points of a range are that already.
template <class Points>
concept float_triples = std::ranges::contiguous_range<Points> && requires(const std::ranges::range_value_t<Points>& p) {
  requires sizeof(p) == 3 * sizeof(float);
  { p.data() } -> std::same_as<const float*>;
  { p[0] } -> std::convertible_to<float>;
};

/// Views ranges of any points: those that are floats in memory in place, others as copies that are rounded to float.
/// Keeps the memory of the copies.
class point_reader {
 public:
  /// Valid until the next call, and as long as `points` are.
  template <point_range Points>
  [[nodiscard]] point_view view(const Points& points) {
    const auto count = static_cast<std::size_t>(std::ranges::size(points));
    if (count == 0) return {};
    if constexpr (float_triples<const Points>) {
      return {std::ranges::data(points)->data(), count};
    } else {
      copies_.resize(count);
      const auto first = std::ranges::begin(points);
      for (std::size_t i = 0; i != count; ++i)
        copies_[i] = coordinates<float>(first[static_cast<std::ranges::range_difference_t<const Points>>(i)]);
      return {copies_.data()->data(), count};
    }
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return copies_.capacity() * sizeof(copies_[0]); }

 private:
  std::vector<std::array<float, 3>> copies_;
};

}  // namespace orbis::octree::detail

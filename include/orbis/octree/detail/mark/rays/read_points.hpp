// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Adapters from the points of a scan to floats in memory, the input format for integration.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <ranges>
#include <vector>

#include <orbis/core/point.hpp>

namespace orbis::octree::detail {

/// Points as contiguous floats x, y, z, x, y, z ...
struct point_view {
  const float* xyz = nullptr;
  std::size_t count = 0;

  [[nodiscard]] std::array<float, 3> operator()(std::size_t i) const noexcept {
    return {xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]};
  }
};

/// True if the points of a range are stored in the format of point_view.
template <class Points>
concept float_triples = std::ranges::contiguous_range<Points> && requires(const std::ranges::range_value_t<Points>& p) {
  requires sizeof(p) == 3 * sizeof(float);
  { p.data() } -> std::same_as<const float*>;
  { p[0] } -> std::convertible_to<float>;
};

/// Views ranges of any points: in place if they are contiguous floats, otherwise as copies rounded to float. Reuses the
/// memory of the copies.
class point_reader {
 public:
  /// Returns a view that is valid until the next call or until `points` changes.
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

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// From the maps of bytes in which rays are marked to the bit masks of bricks.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/points/plane_stack.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

namespace orbis::octree::detail {

/// Where a window of planes lies in the grid.
struct stack_placement {
  std::size_t axis = 0;                 ///< that the planes are across
  std::int32_t step = 1;                ///< from plane to plane along it
  std::array<std::int32_t, 3> start{};  ///< the voxel where the rays start
  std::int32_t last = 0;                ///< the last layer of the window, from the start
  std::uint32_t width = 0, rows = 0;    ///< of a map, in cells

  [[nodiscard]] std::size_t axis_u() const noexcept { return axis == 0 ? 1 : 0; }
  [[nodiscard]] std::size_t axis_v() const noexcept { return axis == 2 ? 1 : 2; }
};

/// Bit i: whether any of the i-th bytes is set.
[[nodiscard]] inline std::uint64_t marks(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c) noexcept {
  using bytes = simd::vec<std::uint8_t, 64, simd::portable>;
  return simd::bits((bytes::load(a) | bytes::load(b) | bytes::load(c)) != bytes(0));
}
/// Eight layers of eight rows of eight voxels.
inline void add_brick(const std::array<std::uint64_t, 8>& layers, std::size_t axis, std::size_t iu, std::size_t iv,
                      scan_brick& to) noexcept {
  std::array<std::uint64_t, 16> spread;  // four voxels along u
  for (std::uint32_t four = 0; four != 16; ++four) {
    spread[four] = 0;
    for (std::uint32_t i = 0; i != 4; ++i) spread[four] |= std::uint64_t{four >> i & 1U} << (spread3(i) << iu);
  }
  for (std::uint32_t i = 0; i != 8; ++i)
    for (std::uint32_t k = 0; k != 8; ++k) {
      const auto row = static_cast<std::uint32_t>(layers[i] >> (8 * k) & 0xffU);
      if (row == 0) continue;
      const std::uint32_t place = spread3(i) << axis | spread3(k) << iv;
      to.free[place >> 6U] |= spread[row & 15U] << (place & 63U);
      to.free[place >> 6U | 1U << iu] |= spread[row >> 4U] << (place & 63U);
    }
}

/// Moves the marks of a window to `masks`, as free voxels.
inline void move_to_masks(const plane_stack& w, const stack_placement& at, scan_masks& masks) {
  const std::size_t iu = at.axis_u(), iv = at.axis_v();
  const std::int32_t start = at.start[at.axis];
  const std::int32_t end_a = start + at.step * w.first, end_b = start + at.step * at.last;
  const std::int32_t lowest = std::min(end_a, end_b), highest = std::max(end_a, end_b);
  std::array<std::uint64_t, 8> layers;
  for (std::int32_t brick = lowest & ~7; brick <= highest; brick += 8) {
    for (std::uint32_t v = 0; v != at.rows; v += 8) {
      for (std::uint32_t u = 0; u != at.width; u += 8) {
        std::uint64_t any = 0;
        for (std::int32_t i = 0; i != 8; ++i) {
          std::uint64_t& layer = layers[static_cast<std::size_t>(i)];
          layer = 0;
          if (brick + i < lowest || brick + i > highest) continue;
          const std::size_t from =
              static_cast<std::size_t>((brick + i - start) * at.step - w.first) * w.stride + w.at(u, v);
          layer = marks(w.planes + from, w.planes + from + w.stride, w.layers + from);
          any |= layer;
        }
        if (any == 0) continue;
        std::array<std::uint32_t, 3> corner;
        corner[at.axis] = static_cast<std::uint32_t>(brick);
        corner[iu] = static_cast<std::uint32_t>(at.start[iu] + w.low_u) + u;
        corner[iv] = static_cast<std::uint32_t>(at.start[iv] + w.low_v) + v;
        add_brick(layers, at.axis, iu, iv, masks.at({corner[0], corner[1], corner[2]}));
      }
    }
  }
}

}  // namespace orbis::octree::detail

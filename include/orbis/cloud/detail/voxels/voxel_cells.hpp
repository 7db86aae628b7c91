// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cells of a grid that contain points, computed block by block.
#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

#include <orbis/cloud/detail/voxels/voxel_key.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

/// Computes `cells[i] = floor(x[i] * inverse_size)` in double if the magnitude is below 2^31 - 1; otherwise, and if
/// x[i] is NaN, a value for which `is_cell` is false. @pre count is a multiple of eight
template <std::floating_point S>
struct voxel_cells {
  using signature = void(const S* x, std::size_t count, double inverse_size, std::int32_t* cells);

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const S* x, std::size_t count, double inverse_size, std::int32_t* cells) {
    using lanes = simd::vec<double, 8, Target>;
    for (std::size_t i = 0; i != count; i += lanes::count) {
      const lanes exact = simd::convert<double>(simd::vec<S, 8, Target>::load(x + i)) * lanes(inverse_size);
      const lanes within = min(lanes(2147483647.0), max(lanes(-2147483648.0), exact));  // NaN becomes the lower limit
      const lanes truncated = simd::convert<double>(simd::convert<std::int32_t>(within));
      const lanes floored = truncated - select(truncated > within, lanes(1.0), lanes(0.0));
      simd::convert<std::int32_t>(floored).store(cells + i);
    }
  }
};

/// 32-bit hash of a cell, whose upper bits are mixed best; for scalars or vectors of lanes.
template <class U>
[[nodiscard]] ORBIS_ALWAYS_INLINE constexpr U mixed_cell(const U& x, const U& y, const U& z) noexcept {
  // Distant cells may differ in their upper bits only, which a product would lose.
  U h = (x ^ (x >> 16)) * U(0x9e3779b1U) + (y ^ (y >> 16)) * U(0x85ebca77U) + (z ^ (z >> 16)) * U(0xc2b2ae3dU);
  h = (h ^ (h >> 15)) * U(0x2c1b3c6dU);
  return h ^ (h >> 14);
}
[[nodiscard]] constexpr std::uint32_t mixed_key(const voxel_key& key) noexcept {
  return mixed_cell(std::bit_cast<std::uint32_t>(key[0]), std::bit_cast<std::uint32_t>(key[1]),
                    std::bit_cast<std::uint32_t>(key[2]));
}

/// Computes `hashes[i] = mixed_key({x[i] >> bits, y[i] >> bits, z[i] >> bits})`: hashes of cubes with an edge of 2^bits
/// cells. @pre count is a multiple of eight
struct voxel_hashes {
  using signature = void(const std::int32_t* x, const std::int32_t* y, const std::int32_t* z, std::size_t count,
                         int bits, std::uint32_t* hashes);

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::int32_t* x, const std::int32_t* y, const std::int32_t* z,
                                      std::size_t count, int bits, std::uint32_t* hashes) {
    using cells = simd::vec<std::int32_t, 8, Target>;
    for (std::size_t i = 0; i != count; i += cells::count)
      mixed_cell(simd::convert<std::uint32_t>(cells::load(x + i) >> bits),
                 simd::convert<std::uint32_t>(cells::load(y + i) >> bits),
                 simd::convert<std::uint32_t>(cells::load(z + i) >> bits))
          .store(hashes + i);
  }
};

/// Points of a cloud with their cells, axis by axis, and the hashes of cubes of 2^CubeBits cells.
template <std::floating_point S, int CubeBits = 0>
class point_block {
 public:
  static constexpr std::size_t capacity = 256;

  /// `size`: edge of a cell, metres. @pre size > 0
  explicit point_block(double size) : inverse_size_{1.0 / size} {}

  /// Loads `count` points; `point(i)` returns the coordinates of the i-th. @pre count <= capacity
  template <class Point>
  void assign(std::size_t count, const Point& point) {
    for (std::size_t i = 0; i != count; ++i) {
      const std::array<S, 3> p = point(i);
      for (std::size_t a = 0; a != 3; ++a) x_[a][i] = p[a];
    }
    const std::size_t lanes = (count + 7) / 8 * 8;
    for (std::size_t a = 0; a != 3; ++a) find_cells_(x_[a].data(), lanes, inverse_size_, cells_[a].data());
    find_hashes_(cells_[0].data(), cells_[1].data(), cells_[2].data(), lanes, CubeBits, hashes_.data());
  }
  [[nodiscard]] voxel_key key(std::size_t i) const noexcept { return {cells_[0][i], cells_[1][i], cells_[2][i]}; }
  [[nodiscard]] std::uint32_t hash(std::size_t i) const noexcept { return hashes_[i]; }
  [[nodiscard]] std::span<const std::uint32_t> hashes(std::size_t count) const noexcept {
    return std::span{hashes_}.first(count);
  }
  [[nodiscard]] std::array<double, 3> point(std::size_t i) const noexcept {
    return {double{x_[0][i]}, double{x_[1][i]}, double{x_[2][i]}};
  }

 private:
  double inverse_size_;
  typename voxel_cells<S>::signature* find_cells_ = simd::kernel<voxel_cells<S>, typename voxel_cells<S>::signature>();
  voxel_hashes::signature* find_hashes_ = simd::kernel<voxel_hashes, voxel_hashes::signature>();
  alignas(64) std::array<std::array<S, capacity>, 3> x_{};
  alignas(64) std::array<std::array<std::int32_t, capacity>, 3> cells_{};
  alignas(64) std::array<std::uint32_t, capacity> hashes_{};
};

}  // namespace orbis::cloud::detail

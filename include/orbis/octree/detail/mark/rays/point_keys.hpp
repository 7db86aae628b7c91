// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Computes the voxels of points in batches.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/rays/read_points.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree::detail {

/// A batch of points in structure-of-arrays layout.
struct point_batch {
  static constexpr std::size_t capacity = 256;
  alignas(64) std::array<float, capacity> x, y, z;
};

/// Deinterleaves x, y, z, x, y, z ... into one array per coordinate.
struct load_triples_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const float* points, std::size_t count, point_batch& batch) noexcept {
    using floats = simd::native_vec<float, Target>;
    constexpr std::size_t n = floats::count;
    std::size_t i = 0;
    for (; i + n <= count; i += n) {
      const float* const p = points + 3 * i;
      const floats a = floats::load(p), b = floats::load(p + n), c = floats::load(p + 2 * n);
      coordinate<0>(a, b, c, std::make_index_sequence<n>{}).store(batch.x.data() + i);
      coordinate<1>(a, b, c, std::make_index_sequence<n>{}).store(batch.y.data() + i);
      coordinate<2>(a, b, c, std::make_index_sequence<n>{}).store(batch.z.data() + i);
    }
    for (; i != count; ++i) {
      batch.x[i] = points[3 * i];
      batch.y[i] = points[3 * i + 1];
      batch.z[i] = points[3 * i + 2];
    }
  }

 private:
  /// Every third of 3 N numbers, starting at index K.
  template <std::size_t K, class V, std::size_t... I>
  static ORBIS_ALWAYS_INLINE V coordinate(const V& a, const V& b, const V& c, std::index_sequence<I...>) noexcept {
    constexpr std::size_t n = sizeof...(I);
    const V from_two = simd::shuffle<(3 * I + K < 2 * n ? 3 * I + K : 0)...>(a, b);
    return simd::shuffle<(3 * I + K < 2 * n ? I : 3 * I + K - n)...>(from_two, c);
  }
};

/// Loads the points [begin, begin + count).
template <class = void>
inline void load_points(const point_view& points, std::size_t begin, std::size_t count, point_batch& batch) noexcept {
  auto* const load_triples = simd::kernel<load_triples_kernel, void(const float*, std::size_t, point_batch&)>();
  load_triples(points.xyz + 3 * begin, count, batch);
}

/// Points in any kind of storage, read in batches or one by one. Type-erased, so that the code that marks rays is
/// compiled once.
class point_source {
 public:
  /// Refers to `points`, a point_view or another type with the same members and an overload of load_points.
  template <class Points>
  requires(!std::same_as<Points, point_source>) point_source(const Points& points)
      : count{points.count},
        points_{&points},
        at_{[](const void* p, std::size_t i) -> std::array<float, 3> { return (*static_cast<const Points*>(p))(i); }},
        load_{[](const void* p, std::size_t begin, std::size_t n, point_batch& batch) {
          load_points(*static_cast<const Points*>(p), begin, n, batch);
        }} {}

  [[nodiscard]] std::array<float, 3> operator()(std::size_t i) const { return at_(points_, i); }
  /// Loads the points [begin, begin + n).
  void load(std::size_t begin, std::size_t n, point_batch& batch) const { load_(points_, begin, n, batch); }

  std::size_t count;

 private:
  const void* points_;
  std::array<float, 3> (*at_)(const void*, std::size_t);
  void (*load_)(const void*, std::size_t, std::size_t, point_batch&);
};

/// Voxels of a batch of points, in order, possibly without consecutive duplicates, and the number of points outside all
/// voxels.
struct batch_keys {
  alignas(64) std::array<std::uint32_t, point_batch::capacity + 16> x, y, z;
  std::size_t count = 0;
  std::size_t outside = 0;
};

/// Computes the cells of coordinates along one axis, relative to the middle of the grid, as voxel_grid::key does.
/// Clears the lanes of `inside` for coordinates that are outside the grid or NaN; their cells are undefined. `half`:
/// half the width of the grid, in cells.
template <class Floats, class Mask>
[[nodiscard]] ORBIS_ALWAYS_INLINE auto cells_along(const Floats& at, double per_metre, double half,
                                                   Mask& inside) noexcept {
  const auto cells = simd::convert<double>(at) * per_metre;
  inside = inside & simd::mask_as<4>((cells >= -half) & (cells < half));
  return simd::convert<std::int32_t>(floor(cells));
}

/// Computes the voxels along one axis in float arithmetic; clears `sure` if the result is uncertain. The product has an
/// error of two roundings, so a voxel is certain if the point is at least four roundings away from its faces.
template <class Floats, class Mask>
[[nodiscard]] ORBIS_ALWAYS_INLINE auto likely_keys(const Floats& at, float per_metre, float half, Mask& sure) noexcept {
  const Floats cells = at * per_metre, whole = floor(cells), above = cells - whole, size = abs(cells);
  sure = sure & (min(above, 1.0F - above) > size * 0x1p-22F) & (size < half - 2.0F);
  return simd::convert<std::int32_t>(whole) + static_cast<std::int32_t>(half);
}

struct find_keys_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const voxel_grid& grid, const point_batch& points, std::size_t count,
                                      batch_keys& keys) noexcept {
    using floats = simd::native_vec<float, Target>;
    using integers = simd::native_vec<std::int32_t, Target>;
    constexpr std::size_t n = floats::count;
    const double per_metre = 1.0 / grid.resolution(), half = 0.5 * grid.cells();
    const integers middle(static_cast<std::int32_t>(half)), none(-1);
    // All keys, shifted by one, so that the key before each key can be read; the first key has none.
    alignas(64) std::array<std::array<std::int32_t, point_batch::capacity + 32>, 3> all;
    for (auto& axis : all) axis[15] = -1;
    std::size_t used = 0, inside_count = 0;
    for (std::size_t i = 0; i < count; i += n) {
      auto inside = floats::mask_type::first(count - i);
      const integers x = cells_along(floats::load(points.x.data() + i), per_metre, half, inside) + middle;
      const integers y = cells_along(floats::load(points.y.data() + i), per_metre, half, inside) + middle;
      const integers z = cells_along(floats::load(points.z.data() + i), per_metre, half, inside) + middle;
      inside_count += simd::popcount(inside);
      select(inside, x, none).store(all[0].data() + 16 + i);  // differs from every voxel if outside
      y.store(all[1].data() + 16 + i);
      z.store(all[2].data() + 16 + i);
    }
    for (std::size_t i = 0; i < count; i += n) {
      const auto here = [&](std::size_t axis) ORBIS_INLINE_LAMBDA { return integers::load(all[axis].data() + 16 + i); };
      const auto before = [&](std::size_t axis)
                              ORBIS_INLINE_LAMBDA { return integers::load(all[axis].data() + 15 + i); };
      const integers x = here(0), y = here(1), z = here(2);
      const auto fresh = (x >= integers(0)) & ((x != before(0)) | (y != before(1)) | (z != before(2)));
      const auto put = [&](std::array<std::uint32_t, point_batch::capacity + 16>& to, const integers& k)
                           ORBIS_INLINE_LAMBDA {
                             return simd::compress_store(to.data() + used, simd::bits_as<std::uint32_t>(k), fresh);
                           };
      put(keys.x, x);
      put(keys.y, y);
      used += put(keys.z, z);
    }
    keys.count = used;
    keys.outside = count - inside_count;
  }
};

/// Finds the voxels of the first `count` points. @pre the arrays of `points` are readable up to the next multiple of 16
template <class = void>
inline void find_keys(const voxel_grid& grid, const point_batch& points, std::size_t count, batch_keys& keys) noexcept {
  using signature = void(const voxel_grid&, const point_batch&, std::size_t, batch_keys&);
  simd::kernel<find_keys_kernel, signature>()(grid, points, count, keys);
}

}  // namespace orbis::octree::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Computes the crossings of rays from one voxel with a stack of planes of voxel faces, several rays at a time, and the
/// resulting brick masks.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

namespace orbis::octree::detail {

/// Rays with positive direction along one axis. After its j-th plane (j = 1, 2 ... planes) a ray is in the cell
/// (floor(u + j * du), floor(v + j * dv)), relative to its start cell. @pre |du|, |dv| <= 1
struct queued_rays {
  static constexpr std::size_t lanes = 16;
  std::vector<double> u, du, v, dv;
  std::vector<std::int32_t> planes;
  std::vector<std::uint32_t> id;

  /// Makes room for `count` rays, and for reading a full vector that starts at any of them.
  void fit(std::size_t count) {
    if (planes.size() >= count + lanes) return;
    u.resize(count + lanes);
    du.resize(count + lanes);
    v.resize(count + lanes);
    dv.resize(count + lanes);
    planes.resize(count + lanes);
    id.resize(count + lanes);
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return planes.capacity() * (4 * sizeof(double) + sizeof(std::int32_t) + sizeof(std::uint32_t));
  }
};

/// Consecutive planes and the layers of voxels between them, each a byte map in tiles of 8x8. A tile is one cache line
/// and one layer of a brick. A byte of a plane is set if a ray passes through that cell of the plane, which means that
/// the voxels on both sides are crossed. A byte of a layer is set for a voxel that a ray enters and leaves between two
/// planes.
struct plane_stack {
  static constexpr unsigned fraction = 22;     ///< fraction bits of a coordinate; ten bits are left for the cell
  static constexpr std::uint32_t doubt = 12;   ///< maximum error of a coordinate, in units of 2^-22 cells
  static constexpr float order_doubt = 7e-6F;  ///< maximum error of the distances that order two crossings, in cells
  static constexpr std::uint8_t marked = 0xff;

  std::uint8_t* planes = nullptr;
  std::uint8_t* layers = nullptr;
  std::size_t size = 0;     ///< cells per map
  std::size_t stride = 0;   ///< offset between maps; the gap is used by inactive lanes
  unsigned log2_width = 0;  ///< width of a map in tiles; u is the fast axis
  std::int32_t low_u = 0;   ///< the map's first cell
  std::int32_t low_v = 0;
  std::int32_t first = 0;  ///< index of the first plane; plane 0 is at the start of the rays and needs no marks
  std::int32_t count = 0;  ///< number of planes

  /// Index of cell (u, v).
  [[nodiscard]] std::uint32_t cell(std::int32_t u, std::int32_t v) const noexcept {
    return at(static_cast<std::uint32_t>(u - low_u), static_cast<std::uint32_t>(v - low_v));
  }
  /// Index of a cell with u and v relative to the map's first cell.
  [[nodiscard]] std::uint32_t at(std::uint32_t u, std::uint32_t v) const noexcept {
    return ((v >> 3U << log2_width | u >> 3U) << 6U) | (v & 7U) << 3U | (u & 7U);
  }
};

/// Coordinates are unsigned fixed-point numbers: ten bits for the cell, and plane_stack::fraction bits for the
/// fraction.
struct mark_crossings_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const plane_stack& w, queued_rays& rays, std::size_t begin, std::size_t end,
                                      std::vector<std::uint32_t>& doubtful) {
    using integers = simd::native_vec<std::int32_t, Target>;
    using words = simd::native_vec<std::uint32_t, Target>;
    using floats = simd::native_vec<float, Target>;
    constexpr std::size_t n = integers::count;
    using doubles = simd::vec<double, n, Target>;
    using mask = typename integers::mask_type;
    constexpr int fraction = static_cast<int>(plane_stack::fraction);
    constexpr double scale = 1U << plane_stack::fraction;
    constexpr std::int32_t inside = (1 << fraction) - 1;
    static_assert(n <= queued_rays::lanes);
    alignas(64) std::array<std::int32_t, 20 * n> between;  // cells of layers, written later

    // Bits of a cell's index that come from u and from v.
    const auto of_u = static_cast<std::int32_t>(w.at((8U << w.log2_width) - 1, 0));
    const integers bits_u(of_u), bits_v(~of_u), tile_columns(of_u & ~7);
    const words tile_rows(~((64U << w.log2_width) - 1));
    const int tile_row = fraction - 3 - static_cast<int>(w.log2_width);
    const auto cell_at = [&](const words& u, const words& v) ORBIS_INLINE_LAMBDA {
      const words columns =
          ((u >> (fraction - 3)) & simd::bits_as<std::uint32_t>(tile_columns)) | ((u >> fraction) & words(7U));
      const words rows = ((v >> (fraction - 3)) & words(7U << 3U)) | ((v >> tile_row) & tile_rows);
      return simd::bits_as<std::int32_t>(columns | rows);
    };
    const integers nowhere(static_cast<std::int32_t>(w.size)), one_map(static_cast<std::int32_t>(w.stride));
    const std::int32_t stop = w.first + w.count - 1;
    const integers first_plane(w.first), origin_cell(static_cast<std::int32_t>(w.cell(0, 0)));

    for (std::size_t r = begin; r < end; r += n) {
      integers left = integers::load(rays.planes.data() + r) - first_plane;  // planes left; negative: the ray has ended
      mask alive = mask::first(end - r) & (left >= integers(0));
      if (none(alive)) continue;

      const doubles du_cells = doubles::load(rays.du.data() + r), dv_cells = doubles::load(rays.dv.data() + r);
      const auto start = [&](const double* at, std::int32_t low, const doubles& d) ORBIS_INLINE_LAMBDA {
        const doubles x = doubles::load(at) - double(low) + double(w.first) * d;
        // The values reach 2^32, so 2^31 is subtracted for the conversion to signed numbers.
        const doubles fixed = floor(x * scale + double{plane_stack::doubt}) - 2147483648.0;
        return simd::bits_as<std::uint32_t>(simd::convert<std::int32_t>(fixed)) ^ words(0x80000000U);
      };
      words u = start(rays.u.data() + r, w.low_u, du_cells), v = start(rays.v.data() + r, w.low_v, dv_cells);
      const auto rounded = [&](const doubles& d)
                               ORBIS_INLINE_LAMBDA { return simd::convert<std::int32_t>(floor(d * scale + 0.5)); };
      const integers du = rounded(du_cells), dv = rounded(dv_cells);
      const floats fu = abs(simd::convert<float>(du_cells)), fv = abs(simd::convert<float>(dv_cells));
      const integers flip_u = (du >> 31) & inside, flip_v = (dv >> 31) & inside;
      const floats order_doubt = (plane_stack::order_doubt * static_cast<float>(scale)) * (fu + fv);
      const auto part_of = [](const words& x)
                               ORBIS_INLINE_LAMBDA { return simd::bits_as<std::int32_t>(x) & integers(inside); };
      const auto is_close = [](const integers& part_u, const integers& part_v) ORBIS_INLINE_LAMBDA {
        return min(part_u, part_v) < integers(2 * static_cast<std::int32_t>(plane_stack::doubt));
      };

      mask doubtful_lanes = alive ^ alive;
      integers layer(0), last = origin_cell;
      std::size_t waiting = 0;
      std::int32_t j = w.first;
      std::uint8_t* map = w.planes;
      if (j != 0) {
        doubtful_lanes = alive & is_close(part_of(u), part_of(v));
        alive = and_not(alive, doubtful_lanes);
        last = cell_at(u, v);
        mark(map, select(alive, last, nowhere));
      }
      for (;;) {
        ++j;
        u += simd::bits_as<std::uint32_t>(du);
        v += simd::bits_as<std::uint32_t>(dv);
        map += w.stride;
        left -= integers(1);
        alive = alive & (left >= integers(0));
        if (j > stop || none(alive)) break;
        const integers part_u = part_of(u), part_v = part_of(v);
        const integers cell = cell_at(u, v), changed = cell ^ last;
        const mask both = ((changed & bits_u) != integers(0)) & ((changed & bits_v) != integers(0));
        // The ray first crosses the face that is further back, measured in units of the ray's speed.
        const floats behind_u = simd::convert<float>(part_u ^ flip_u) * fv;
        const floats behind_v = simd::convert<float>(part_v ^ flip_v) * fu;
        const floats order = behind_u - behind_v;
        const mask unsure = alive & (is_close(part_u, part_v) | (both & (abs(order) <= order_doubt)));
        doubtful_lanes = doubtful_lanes | unsure;
        alive = and_not(alive, unsure);
        // On AVX-512 compressing costs less than a mispredicted branch.
        if (const mask through = both & alive; Target::bytes == 64 || any(through)) {
          const integers corner = last ^ (changed & select(order > 0.0F, bits_u, bits_v));
          waiting += simd::compress_store(between.data() + waiting, corner + layer, through);
        }
        layer += one_map;
        mark(map, select(alive, cell, nowhere));
        last = cell;
      }
      for (std::size_t i = 0; i != waiting; ++i) w.layers[between[i]] = plane_stack::marked;
      for (std::uint64_t lanes = simd::bits(doubtful_lanes); lanes != 0; lanes &= lanes - 1) {
        const std::size_t i = r + static_cast<std::size_t>(std::countr_zero(lanes));
        doubtful.push_back(rays.id[i]);
        rays.planes[i] = -1;
      }
    }
  }

 private:
  /// Marks the bytes of some cells. The indices are kept in registers: loads from memory would wait for the preceding
  /// stores, because the addresses often agree in the lowest twelve bits.
  template <class Cells>
  static ORBIS_ALWAYS_INLINE void mark(std::uint8_t* map, const Cells& cells) noexcept {
    const auto pairs = simd::bits_as<std::uint64_t>(cells);
    [&]<std::size_t... I>(std::index_sequence<I...>) ORBIS_INLINE_LAMBDA {
      const auto two = [map](std::uint64_t c) ORBIS_INLINE_LAMBDA {
        map[static_cast<std::uint32_t>(c)] = plane_stack::marked;
        map[c >> 32U] = plane_stack::marked;
      };
      (two(pairs[I]), ...);
    }
    (std::make_index_sequence<Cells::count / 2>{});
  }
};

using crossings_kernel = void(const plane_stack&, queued_rays&, std::size_t, std::size_t, std::vector<std::uint32_t>&);

/// Marks the rays [begin, end) in a stack of planes. If the arithmetic cannot decide a cell or an order with certainty,
/// the ray is appended to `doubtful` and removed (planes = -1); its existing marks are correct. @pre the cells of the
/// rays are in the stack
template <class = void>
[[nodiscard]] inline crossings_kernel* mark_crossings() noexcept {
  return simd::kernel<mark_crossings_kernel, crossings_kernel>();
}

/// Position of a window of planes in the grid.
struct stack_placement {
  std::size_t axis = 0;                 ///< axis perpendicular to the planes
  std::int32_t step = 1;                ///< direction from plane to plane along the axis
  std::array<std::int32_t, 3> start{};  ///< voxel in which the rays start
  std::int32_t last = 0;                ///< last layer of the window, relative to the start
  std::uint32_t width = 0, rows = 0;    ///< size of a map in cells

  [[nodiscard]] std::size_t axis_u() const noexcept { return axis == 0 ? 1 : 0; }
  [[nodiscard]] std::size_t axis_v() const noexcept { return axis == 2 ? 1 : 2; }
};

/// Returns a mask; bit i is set if the i-th byte at `a`, `b` or `c` is not zero.
[[nodiscard]] inline std::uint64_t marks(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c) noexcept {
  using bytes = simd::vec<std::uint8_t, 64, simd::portable>;
  return simd::bits((bytes::load(a) | bytes::load(b) | bytes::load(c)) != bytes(0));
}
/// Adds eight layers of eight rows of eight voxels to a brick.
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

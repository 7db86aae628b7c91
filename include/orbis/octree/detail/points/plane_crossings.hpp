// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where rays from one voxel cross a stack of planes of voxel faces, several rays at a time.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/points/plane_stack.hpp>

namespace orbis::octree::detail {

/// Coordinates are fixed-point numbers without sign: ten bits of cell, plane_stack::fraction bits of fraction.
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

    // The bits of a cell's number that come from u and from v.
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
      integers left = integers::load(rays.planes.data() + r) - first_plane;  // planes; negative: the ray has ended
      mask alive = mask::first(end - r) & (left >= integers(0));
      if (none(alive)) continue;

      const doubles du_cells = doubles::load(rays.du.data() + r), dv_cells = doubles::load(rays.dv.data() + r);
      const auto start = [&](const double* at, std::int32_t low, const doubles& d) ORBIS_INLINE_LAMBDA {
        const doubles x = doubles::load(at) - double(low) + double(w.first) * d;
        // The numbers reach 2^32: half of that is taken off for the conversion, which knows signed numbers.
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
        // Which face was crossed first: the one that lies further behind, in units of the ray's own speed.
        const floats behind_u = simd::convert<float>(part_u ^ flip_u) * fv;
        const floats behind_v = simd::convert<float>(part_v ^ flip_v) * fu;
        const floats order = behind_u - behind_v;
        const mask unsure = alive & (is_close(part_u, part_v) | (both & (abs(order) <= order_doubt)));
        doubtful_lanes = doubtful_lanes | unsure;
        alive = and_not(alive, unsure);
        if (const mask through = both & alive; any(through)) {
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
  /// Marks the bytes at some cells. The numbers go through registers: read from memory they would have to wait for
  /// the marks before them, whose addresses often agree in the last twelve bits.
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

/// Marks the rays [begin, end) in a stack of planes. Where arithmetic cannot tell for certain which cell or which
/// order is right, the ray is appended to `doubtful` and taken out (planes = -1); what has been marked of it is right.
/// @pre the cells of the rays lie in the stack
[[nodiscard]] inline crossings_kernel* mark_crossings() noexcept {
  return simd::kernel<mark_crossings_kernel, crossings_kernel>();
}

}  // namespace orbis::octree::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The Schur complement: elimination of the points from the normal equations, and back-substitution for their steps.
///
/// With V = L L^T for a point and Y = W L^-T for each camera that observes it, Y_a Y_b^T is subtracted from the reduced
/// system for every pair of cameras; the result is exactly symmetric despite rounding. Source: D. C. Brown, "The bundle
/// adjustment - progress and prospects", 1976.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <orbis/core/rounded.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/optimize/detail/bundle/bundle_kernels.hpp>
#include <orbis/optimize/detail/bundle/bundle_structure.hpp>
#include <orbis/optimize/detail/bundle/transposed.hpp>
#include <orbis/optimize/detail/unroll.hpp>

namespace orbis::optimize::detail {

/// Memory layout of C rows, which fill whole registers; a last row that would need its own register is stored
/// separately.
template <int C>
struct row_layout {
  static constexpr bool has_last = C > 8 && C % 8 == 1;
  static constexpr int body = has_last ? C - 1 : (C + 3) / 4 * 4;  ///< rows in registers
  static constexpr int size = has_last ? body + 4 : body;          ///< number of values of a vector of C rows
  /// Size of a C x C block: C columns of `body` rows, followed by the last row if it is separate.
  static constexpr int block = C * body + (has_last ? size : 0);
  /// Returns the offset of an entry of a block.
  [[nodiscard]] static constexpr int at(int row, int column) {
    return row < body ? body * column + row : C * body + column;
  }
};
/// Number of rows in a register.
template <int C, simd::target Target>
inline constexpr int row_width = row_layout<C>::body % static_cast<int>(Target::bytes / 8) == 0 ? Target::bytes / 8 : 4;
/// True if the registers have room for two blocks at a time: 2 C sums, two rows and one common factor.
template <int C, simd::target Target>
inline constexpr bool has_room_for_two = 2 * C + 3 <= (Target::bytes == 64 ? 32 : 16);

/// Elimination of a chunk of points, for cameras with C unknowns.
struct elimination {
  const bundle_structure& structure;
  std::size_t chunk = 0;
  const double* normal = nullptr;   ///< `point_size` values per point; all zero if the point is fixed
  const double* damping = nullptr;  ///< three values per point, or null
  const double* mixed = nullptr;    ///< tiles of camera-point blocks
  double* inverse = nullptr;        ///< `point_size` values per point: L^-1, row by row, and L^-1 g
  // Contributions to subtract from the reduced system.
  double* blocks = nullptr;   ///< `row_layout<C>::block` values per slot
  double* right = nullptr;    ///< C values per unknown
  double* scratch = nullptr;  ///< three vectors per observation of the chunk by a movable camera
};

/// Computes L^-1 and L^-1 g of up to eight points starting at `p`, before `end`. Returns the first point whose block is
/// not positive definite, or `end`.
template <simd::target Target>
ORBIS_ALWAYS_INLINE std::size_t invert_factors(const elimination& work, std::size_t p, std::size_t end) {
  using L = simd::vec<double, 8, Target>;
  constexpr double least = 1e-14;
  const std::size_t count = std::min<std::size_t>(8, end - p);
  const double nothing[point_size] = {};
  double nowhere[point_size];
  const double* from[8];
  double* to[8];
  for (std::size_t i = 0; i != 8; ++i) {
    from[i] = i < count ? work.normal + point_size * (p + i) : nothing;
    to[i] = i < count ? work.inverse + point_size * (p + i) : nowhere;
  }
  L v[point_size];
  unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA {
    load_transposed<4>(from, v + 4 * k);
    for (const double*& row : from) row += 4;
  });
  const L none = 0.0, one = 1.0;
  L d[3] = {none, none, none};
  if (work.damping != nullptr) {
    double gathered[3][8] = {};
    for (std::size_t i = 0; i != count; ++i)
      for (std::size_t k = 0; k != 3; ++k) gathered[k][i] = work.damping[3 * (p + i) + k];
    for (int k = 0; k != 3; ++k) d[k] = L::load(gathered[k]);
  }
  const auto moves = !((v[0] == none) & (v[3] == none) & (v[5] == none));
  const L v00 = v[0] + d[0], v11 = v[3] + d[1], v22 = v[5] + d[2];
  auto definite = (L(1e-290) < v00) & (v00 < L(1e290));
  const L i00 = simd::reciprocal_root(select(definite, v00, one));
  const L l10 = v[1] * i00, l20 = v[2] * i00;
  const L p11 = v11 - l10 * l10;
  definite = definite & (least * v11 < p11) & (L(1e-290) < p11) & (p11 < L(1e290));
  const L i11 = simd::reciprocal_root(select(definite, p11, one));
  const L l21 = (v[4] - l20 * l10) * i11;
  const L p22 = v22 - (l20 * l20 + l21 * l21);
  definite = definite & (least * v22 < p22) & (L(1e-290) < p22) & (p22 < L(1e290));
  const L i22 = simd::reciprocal_root(select(definite, p22, one));
  const L i10 = none - (l10 * i00) * i11;
  const L i20 = none - (l20 * i00 + l21 * i10) * i22;
  const L i21 = none - (l21 * i11) * i22;
  const L s0 = i00 * v[6], s1 = i10 * v[6] + i11 * v[7], s2 = i20 * v[6] + (i21 * v[7] + i22 * v[8]);
  const auto kept = [&](const L& x) ORBIS_INLINE_LAMBDA { return select(moves, x, none); };
  store_transposed(kept(i00), kept(i10), kept(i11), kept(i20), to, 0);
  store_transposed(kept(i21), kept(i22), kept(s0), kept(s1), to, 4);
  store_transposed(kept(s2), none, none, none, to, 8);
  const auto failed = moves & !definite;
  if (!any(failed)) return end;
  double flags[8];
  select(failed, one, none).store(flags);
  std::size_t i = 0;
  while (flags[i] == 0.0) ++i;
  return p + i;
}

/// Computes Y for one camera's observations in a chunk, the sum of Y Y^T, and the contribution to the right-hand side.
template <int C, bool ThroughCamera, simd::target Target>
ORBIS_ALWAYS_INLINE void make_factors(const elimination& work, const bundle_structure::segment& segment,
                                      std::size_t unknown) {
  using L = simd::vec<double, 8, Target>;
  using rows = row_layout<C>;
  using mixed_block = mixed_tile<C, ThroughCamera>;
  const std::size_t first_number = work.structure.chunk_begin[work.chunk].first_mixed;
  L square[C * (C + 1) / 2], right[C];
  for (auto& entry : square) entry = 0.0;
  for (auto& entry : right) entry = 0.0;
  const double* mixed = work.mixed + mixed_block::size * segment.first_mixed_tile;
  for (std::size_t first = 0; first < segment.count; first += 8, mixed += mixed_block::size) {
    const std::uint32_t* const point = work.structure.point.data() + 8 * segment.first_tile + first;
    const std::uint32_t* const number = work.structure.mixed_number.data() + 8 * segment.first_tile + first;
    double nowhere[3 * rows::size];  // output for the empty places of the last tile, not used
    const double* from[8];
    double* to[8];
    for (std::size_t i = 0; i != 8; ++i) {
      from[i] = work.inverse + point_size * std::size_t{point[i]};
      to[i] = first + i < segment.count ? work.scratch + 3 * rows::size * (number[i] - first_number) : nowhere;
    }
    L f[point_size], w[C][3];
    load_transposed<4>(from, f);
    for (const double*& row : from) row += 4;
    load_transposed<4>(from, f + 4);
    for (const double*& row : from) row += 4;
    load_transposed<3>(from, f + 8);
    mixed_block::load(mixed, w);
    unroll<C>([&](auto i) ORBIS_INLINE_LAMBDA {
      w[i][2] = w[i][0] * f[3] + (w[i][1] * f[4] + w[i][2] * f[5]);
      w[i][1] = w[i][0] * f[1] + w[i][1] * f[2];
      w[i][0] = w[i][0] * f[0];
      right[i] += (w[i][0] * f[6] + w[i][1] * f[7]) + w[i][2] * f[8];
    });
    const L none = 0.0;
    unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA {
      unroll<rows::size / 4>([&](auto quarter) ORBIS_INLINE_LAMBDA {
        constexpr int start = 4 * decltype(quarter)::value;
        const auto at = [&](int i) ORBIS_INLINE_LAMBDA -> const L& { return i < C ? w[i][k] : none; };
        store_transposed(at(start), at(start + 1), at(start + 2), at(start + 3), to, rows::size * k + start);
      });
    });
    int next = 0;
    unroll<C>([&](auto i) ORBIS_INLINE_LAMBDA {
      unroll<i + 1>([&](auto j) ORBIS_INLINE_LAMBDA {
        square[next] += (w[i][0] * w[j][0] + w[i][1] * w[j][1]) + w[i][2] * w[j][2];
        ++next;
      });
    });
  }
  double* const block = work.blocks + rows::block * std::size_t{work.structure.diagonal_slot[unknown]};
  int next = 0;
  for (int i = 0; i != C; ++i) {
    work.right[C * unknown + static_cast<std::size_t>(i)] += simd::sum(right[i]);
    for (int j = 0; j <= i; ++j) {
      const double entry = simd::sum(square[next++]);
      block[rows::at(i, j)] += entry;
      if (j != i) block[rows::at(j, i)] += entry;
    }
  }
}

/// Adds Y_a Y_c^T, summed over a group of points, to a block for each of `Count` cameras a. The Y of a camera are
/// `columns` vectors, followed by those of the next camera.
template <int C, int Count, simd::target Target>
ORBIS_ALWAYS_INLINE void add_products(const double* ya, const double* yc, std::size_t columns,
                                      double* const (&blocks)[Count]) {
  using rows = row_layout<C>;
  constexpr int width = row_width<C, Target>, parts = rows::body / width;
  using row = simd::vec<double, width, Target>;
  unroll<parts>([&](auto i) ORBIS_INLINE_LAMBDA {
    row sum[Count][C];
    unroll<Count>([&](auto r) ORBIS_INLINE_LAMBDA {
      unroll<C>([&](auto c) ORBIS_INLINE_LAMBDA { sum[r][c] = row::load(blocks[r] + rows::body * c + width * i); });
    });
    const double *a = ya + width * i, *b = yc;
    for (std::size_t k = 0; k != columns; ++k, a += rows::size, b += rows::size) {  // unrolling would spill registers
      row own[Count];
      unroll<Count>([&](auto r) ORBIS_INLINE_LAMBDA { own[r] = row::load(a + r * columns * rows::size); });
      unroll<C>([&](auto c) ORBIS_INLINE_LAMBDA {
        const row other = b[c];
        unroll<Count>([&](auto r) ORBIS_INLINE_LAMBDA { sum[r][c] += own[r] * other; });
      });
    }
    unroll<Count>([&](auto r) ORBIS_INLINE_LAMBDA {
      unroll<C>([&](auto c) ORBIS_INLINE_LAMBDA { sum[r][c].store(blocks[r] + rows::body * c + width * i); });
    });
  });
  if constexpr (rows::has_last)
    unroll<Count>([&](auto r) ORBIS_INLINE_LAMBDA {
      constexpr int last = C - 1;
      double* const to = blocks[r] + C * rows::body;
      row sum[parts];
      unroll<parts>([&](auto i) ORBIS_INLINE_LAMBDA { sum[i] = row::load(to + width * i); });
      double corner = to[last];
      const double *a = ya + r * columns * rows::size, *b = yc;
      for (std::size_t k = 0; k != columns; ++k, a += rows::size, b += rows::size) {
        unroll<parts>([&](auto i) ORBIS_INLINE_LAMBDA { sum[i] += row(a[last]) * row::load(b + width * i); });
        corner += rounded_product(a[last], b[last]);
      }
      unroll<parts>([&](auto i) ORBIS_INLINE_LAMBDA { sum[i].store(to + width * i); });
      to[last] = corner;
    });
}

/// Eliminates a chunk. Returns the first point whose block is not positive definite, or `bundle_structure::none`.
template <int C, bool ThroughCamera, simd::target Target>
ORBIS_ALWAYS_INLINE std::size_t eliminate(const elimination& work) {
  using rows = row_layout<C>;
  const bundle_structure& structure = work.structure;
  const bundle_structure::chunk &begin = structure.chunk_begin[work.chunk],
                                &end = structure.chunk_begin[work.chunk + 1];
  for (std::size_t p = begin.first_point; p < end.first_point; p += 8)
    if (const std::size_t failed = invert_factors<Target>(work, p, end.first_point); failed != end.first_point)
      return failed;
  for (std::size_t s = begin.first_segment; s != end.first_segment; ++s) {
    const bundle_structure::segment& segment = structure.segments[s];
    const std::uint32_t unknown = structure.unknown[segment.camera];
    if (unknown != bundle_structure::none) make_factors<C, ThroughCamera, Target>(work, segment, unknown);
  }
  for (std::size_t k = begin.first_group; k != end.first_group; ++k) {
    const bundle_structure::group& group = structure.groups[k];
    const std::size_t count = group.cameras, columns = 3 * std::size_t{group.points};
    if (count < 2) continue;
    const std::uint32_t* const slots = structure.pair_slot.data() + group.first_pair;
    const auto block_at = [&](std::size_t a, std::size_t c) ORBIS_INLINE_LAMBDA {
      return work.blocks + rows::block * std::size_t{slots[a * (a - 1) / 2 + c]};
    };
    const auto y = [&](std::size_t a) ORBIS_INLINE_LAMBDA {
      return work.scratch + rows::size * (3 * (group.first_mixed - begin.first_mixed) + columns * a);
    };
    const auto unknown = [&](std::size_t a) { return structure.mixed_unknown[group.first_mixed + a * group.points]; };
    bool is_seen_twice = false;  // true if the same camera observes a point twice
    for (std::size_t a = 1; a != count; ++a) is_seen_twice |= unknown(a) == unknown(a - 1);
    std::size_t a = 1;
    if constexpr (has_room_for_two<C, Target>)  // two rows of blocks share loads of their factors
      for (; a + 1 < count && !is_seen_twice; a += 2) {
        for (std::size_t c = 0; c != a; ++c)
          add_products<C, 2, Target>(y(a), y(c), columns, {block_at(a, c), block_at(a + 1, c)});
        add_products<C, 1, Target>(y(a + 1), y(a), columns, {block_at(a + 1, a)});
      }
    for (; a != count; ++a)
      for (std::size_t c = 0; c != a; ++c) {
        add_products<C, 1, Target>(y(a), y(c), columns, {block_at(a, c)});
        if (is_seen_twice && unknown(c) == unknown(a))  // on the diagonal, add the transposed product as well
          add_products<C, 1, Target>(y(c), y(a), columns, {block_at(a, c)});
      }
  }
  return bundle_structure::none;
}

/// Computes the steps of a chunk of points, `-V^-1 (g + W^T x)`, for the steps x of the cameras.
struct substitution {
  const bundle_structure& structure;
  std::size_t chunk = 0;
  const double* mixed = nullptr;
  const double* inverse = nullptr;
  const double* cameras = nullptr;
  double* pulled = nullptr;  ///< four values per point
  double* steps = nullptr;   ///< three values per point
};

template <int C, bool ThroughCamera, simd::target Target>
ORBIS_ALWAYS_INLINE void substitute(const substitution& work) {
  using L = simd::vec<double, 8, Target>;
  using mixed_block = mixed_tile<C, ThroughCamera>;
  const bundle_structure& structure = work.structure;
  const bundle_structure::chunk &begin = structure.chunk_begin[work.chunk],
                                &end = structure.chunk_begin[work.chunk + 1];
  std::fill(work.pulled + 4 * begin.first_point, work.pulled + 4 * end.first_point, 0.0);
  const L none = 0.0;
  for (std::size_t s = begin.first_segment; s != end.first_segment; ++s) {
    const bundle_structure::segment& segment = structure.segments[s];
    const std::uint32_t unknown = structure.unknown[segment.camera];
    if (unknown == bundle_structure::none) continue;
    const double* mixed = work.mixed + mixed_block::size * segment.first_mixed_tile;
    const double* const x = work.cameras + C * std::size_t{unknown};
    for (std::size_t first = 0; first < segment.count; first += 8, mixed += mixed_block::size) {
      L pulled[3] = {none, none, none};
      const auto add = [&](int row, const L& factor) ORBIS_INLINE_LAMBDA {
        unroll<3>([&](auto k)
                      ORBIS_INLINE_LAMBDA { pulled[k] += L::load(mixed + mixed_block::row(row) + 8 * k) * factor; });
      };
      if constexpr (ThroughCamera) {  // rows 3 to 5 are hat(q) times rows 0 to 2
        const L q[3] = {L::load(mixed + mixed_block::q), L::load(mixed + mixed_block::q + 8),
                        L::load(mixed + mixed_block::q + 16)};
        add(0, x[0] + (x[4] * q[2] - x[5] * q[1]));
        add(1, x[1] + (x[5] * q[0] - x[3] * q[2]));
        add(2, x[2] + (x[3] * q[1] - x[4] * q[0]));
        unroll<C - 6>([&](auto i) ORBIS_INLINE_LAMBDA { add(6 + i, x[6 + i]); });
      } else {
        unroll<C>([&](auto i) ORBIS_INLINE_LAMBDA { add(i, x[i]); });
      }
      double* to[8];
      for (std::size_t i = 0; i != 8; ++i)
        to[i] = work.pulled + 4 * std::size_t{structure.point[8 * segment.first_tile + first + i]};
      add_transposed(pulled[0], pulled[1], pulled[2], none, to, 0);
    }
  }
  for (std::size_t p = begin.first_point; p != end.first_point; ++p) {
    const double *const m = work.inverse + point_size * p, *const t = work.pulled + 4 * p;
    const double u0 = -(m[6] + rounded_product(m[0], t[0]));
    const double u1 = -(m[7] + (rounded_product(m[1], t[0]) + rounded_product(m[2], t[1])));
    const double u2 =
        -(m[8] + (rounded_product(m[3], t[0]) + (rounded_product(m[4], t[1]) + rounded_product(m[5], t[2]))));
    double* const step = work.steps + 3 * p;
    step[0] = rounded_product(m[0], u0) + (rounded_product(m[1], u1) + rounded_product(m[3], u2));
    step[1] = rounded_product(m[2], u1) + rounded_product(m[4], u2);
    step[2] = m[5] * u2;
  }
}

/// The two loops over a chunk, compiled for every instruction set.
template <int C, bool ThroughCamera>
struct eliminate_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE std::size_t run(const elimination& work) {
    return eliminate<C, ThroughCamera, Target>(work);
  }
};
template <int C, bool ThroughCamera>
struct substitute_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const substitution& work) {
    substitute<C, ThroughCamera, Target>(work);
  }
};

/// Pointers to the kernels for this processor's instruction set.
template <int C, bool ThroughCamera>
struct schur_kernels {
  using eliminator = std::size_t(const elimination&);
  using substituter = void(const substitution&);
  eliminator* eliminate_points;
  substituter* substitute_points;
  schur_kernels();
};
template <int C, bool ThroughCamera>
schur_kernels<C, ThroughCamera>::schur_kernels()
    : eliminate_points{simd::kernel<eliminate_kernel<C, ThroughCamera>, eliminator>()},
      substitute_points{simd::kernel<substitute_kernel<C, ThroughCamera>, substituter>()} {}

#ifdef ORBIS_COMPILED  // instantiated in cmake/compiled/optimize_kernels.cpp
extern template struct schur_kernels<6, true>;
extern template struct schur_kernels<9, true>;
#endif

}  // namespace orbis::optimize::detail

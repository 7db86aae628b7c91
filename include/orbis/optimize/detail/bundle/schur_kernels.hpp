// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The Schur complement: elimination of the points from the normal equations, and their steps by back-substitution.
///
/// With V = L L^T of a point and Y = W L^-T of each camera that sees it, Y_a Y_b^T is subtracted from the reduced
/// system for every pair of cameras; this is symmetric in spite of rounding. Source: D. C. Brown, "The bundle
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
#include <orbis/optimize/detail/unroll.hpp>

namespace orbis::optimize::detail {

/// Numbers of a point: the upper triangle of its block of the normal equations, row by row, then its gradient. Points
/// are stored in tiles of eight: number k of point p is `tile[8 * k + p % 8]`.
inline constexpr std::size_t point_size = 9;
[[nodiscard]] ORBIS_ALWAYS_INLINE std::size_t point_at(std::size_t p) { return point_size * (p / 8 * 8) + p % 8; }

/// The elimination of a chunk of points, for cameras with C unknowns.
struct elimination {
  std::size_t begin = 0, end = 0;   ///< `begin` is a multiple of eight
  const double* normal = nullptr;   ///< `point_size` of each point; all zero: the point stays
  const double* damping = nullptr;  ///< three of each point, or null
  const double* mixed = nullptr;    ///< 3 * padded<C> of each observation
  const std::uint32_t* first_mixed = nullptr;
  const std::uint32_t* mixed_unknown = nullptr;
  const std::size_t* first_pair = nullptr;
  const std::uint32_t* pair_slot = nullptr;
  double* inverse = nullptr;  ///< `point_size` of each point: L^-1, row by row, and L^-1 g
  // What is subtracted from the reduced system.
  double* blocks = nullptr;   ///< C columns of padded<C> rows for each slot
  double* right = nullptr;    ///< padded<C> of each unknown
  double* scratch = nullptr;  ///< 3 * padded<C> * most observations of a point
};

/// Computes L^-1 and L^-1 g of eight points from `p` on. Returns the first of them before `work.end` whose block is not
/// positive definite, or `work.end`.
template <simd::target Target>
ORBIS_ALWAYS_INLINE std::size_t invert_factors(const elimination& work, std::size_t p) {
  using L = simd::vec<double, 8, Target>;
  constexpr double least = 1e-14;
  const double* const v = work.normal + point_at(p);
  double* const out = work.inverse + point_at(p);
  const L none = 0.0, one = 1.0;
  L d[3] = {none, none, none};
  if (work.damping != nullptr) {
    double gathered[3][8] = {};
    for (std::size_t i = 0; i != std::min<std::size_t>(8, work.end - p); ++i)
      for (std::size_t k = 0; k != 3; ++k) gathered[k][i] = work.damping[3 * (p + i) + k];
    for (int k = 0; k != 3; ++k) d[k] = L::load(gathered[k]);
  }
  const L h00 = L::load(v), h11 = L::load(v + 24), h22 = L::load(v + 40);
  const auto moves = !((h00 == none) & (h11 == none) & (h22 == none));
  const L v00 = h00 + d[0], v11 = h11 + d[1], v22 = h22 + d[2];
  auto definite = (L(1e-290) < v00) & (v00 < L(1e290));
  const L i00 = simd::reciprocal_root(select(definite, v00, one));
  const L l10 = L::load(v + 8) * i00, l20 = L::load(v + 16) * i00;
  const L p11 = v11 - l10 * l10;
  definite = definite & (least * v11 < p11) & (L(1e-290) < p11) & (p11 < L(1e290));
  const L i11 = simd::reciprocal_root(select(definite, p11, one));
  const L l21 = (L::load(v + 32) - l20 * l10) * i11;
  const L p22 = v22 - (l20 * l20 + l21 * l21);
  definite = definite & (least * v22 < p22) & (L(1e-290) < p22) & (p22 < L(1e290));
  const L i22 = simd::reciprocal_root(select(definite, p22, one));
  const L i10 = none - (l10 * i00) * i11;
  const L i20 = none - (l20 * i00 + l21 * i10) * i22;
  const L i21 = none - (l21 * i11) * i22;
  const L g0 = L::load(v + 48), g1 = L::load(v + 56), g2 = L::load(v + 64);
  const L results[point_size] = {
      i00, i10, i11, i20, i21, i22, i00 * g0, i10 * g0 + i11 * g1, i20 * g0 + (i21 * g1 + i22 * g2)};
  for (std::size_t k = 0; k != point_size; ++k) select(moves, results[k], none).store(out + 8 * k);
  double failed[8];
  select(moves & !definite, one, none).store(failed);
  for (std::size_t i = 0; i != 8; ++i)
    if (failed[i] != 0.0 && p + i < work.end) return p + i;
  return work.end;
}

/// Rows of a block in registers.
template <int C, simd::target Target>
inline constexpr int row_width = padded<C> % static_cast<int>(Target::bytes / 8) == 0 ? Target::bytes / 8 : 4;

/// Returns the first point whose block is not positive definite, or `work.end`.
template <int C, simd::target Target>
ORBIS_ALWAYS_INLINE std::size_t eliminate(const elimination& work) {
  constexpr int pad = padded<C>, width = row_width<C, Target>, parts = pad / width;
  using row = simd::vec<double, width, Target>;
  for (std::size_t p = work.begin; p < work.end; p += 8)
    if (const std::size_t failed = invert_factors<Target>(work, p); failed != work.end) return failed;

  for (std::size_t p = work.begin; p != work.end; ++p) {
    const double* const inverse = work.inverse + point_at(p);
    const std::uint32_t first = work.first_mixed[p], count = work.first_mixed[p + 1] - first;
    if (inverse[0] == 0.0) continue;
    const std::uint32_t* slot = work.pair_slot + work.first_pair[p];
    // Y of an observation, which later ones need as well, and what is subtracted from the right-hand side.
    const auto make = [&](std::uint32_t a, row(*y)[parts]) ORBIS_INLINE_LAMBDA {
      const double* const w = work.mixed + 3 * pad * std::size_t{first + a};
      double* const kept = work.scratch + 3 * pad * std::size_t{a};
      double* const right = work.right + pad * std::size_t{work.mixed_unknown[first + a]};
      const row i00 = inverse[0], i10 = inverse[8], i11 = inverse[16], i20 = inverse[24], i21 = inverse[32],
                i22 = inverse[40], s0 = inverse[48], s1 = inverse[56], s2 = inverse[64];
      unroll<parts>([&](auto i) ORBIS_INLINE_LAMBDA {
        const row w0 = row::load(w + width * i), w1 = row::load(w + pad + width * i),
                  w2 = row::load(w + 2 * pad + width * i);
        y[0][i] = w0 * i00;
        y[1][i] = w0 * i10 + w1 * i11;
        y[2][i] = w0 * i20 + (w1 * i21 + w2 * i22);
        y[0][i].store(kept + width * i);
        y[1][i].store(kept + pad + width * i);
        y[2][i].store(kept + 2 * pad + width * i);
        double* const to = right + width * i;
        (row::load(to) + ((y[0][i] * s0 + y[1][i] * s1) + y[2][i] * s2)).store(to);
      });
    };
    const auto add = [&](double* block, const row(*y)[parts], const auto& column, const row& f0, const row& f1,
                         const row& f2) ORBIS_INLINE_LAMBDA {
      unroll<parts>([&](auto i) ORBIS_INLINE_LAMBDA {
        double* const to = block + pad * column + width * i;
        (((row::load(to) + y[0][i] * f0) + y[1][i] * f1) + y[2][i] * f2).store(to);
      });
    };
    const auto block_at = [&](const std::uint32_t* at)
                              ORBIS_INLINE_LAMBDA { return work.blocks + C * pad * std::size_t{*at}; };
    // A camera that sees the point twice: the pair counts in both orders.
    const auto mirror = [&](std::uint32_t a, std::uint32_t b, double* block) ORBIS_INLINE_LAMBDA {
      if (a == b || work.mixed_unknown[first + a] != work.mixed_unknown[first + b]) return;
      const double *const one = work.scratch + 3 * pad * std::size_t{a}, *const other =
                                                                             work.scratch + 3 * pad * std::size_t{b};
      for (int c = 0; c != C; ++c)
        for (int r = 0; r != C; ++r)
          for (int k = 0; k != 3; ++k) block[pad * c + r] += rounded_product(other[pad * k + r], one[pad * k + c]);
    };
    std::uint32_t a = 0;
    for (; a + 1 < count; a += 2) {  // two rows of blocks share the loads of their factors
      row upper[3][parts], lower[3][parts];
      make(a, upper);
      make(a + 1, lower);
      const std::uint32_t* const below = slot + a + 1;
      for (std::uint32_t b = 0; b <= a; ++b) {
        const double* const f = work.scratch + 3 * pad * std::size_t{b};
        double *const first_block = block_at(slot + b), *const second_block = block_at(below + b);
        unroll<C>([&](auto c) ORBIS_INLINE_LAMBDA {
          const row f0 = f[c], f1 = f[pad + c], f2 = f[2 * pad + c];
          add(first_block, upper, c, f0, f1, f2);
          add(second_block, lower, c, f0, f1, f2);
        });
        mirror(a, b, first_block);
        mirror(a + 1, b, second_block);
      }
      const double* const f = work.scratch + 3 * pad * std::size_t{a + 1};
      double* const last = block_at(below + a + 1);
      unroll<C>([&](auto c) ORBIS_INLINE_LAMBDA { add(last, lower, c, f[c], f[pad + c], f[2 * pad + c]); });
      slot = below + a + 2;
    }
    if (a != count) {
      row y[3][parts];
      make(a, y);
      for (std::uint32_t b = 0; b <= a; ++b) {
        const double* const f = work.scratch + 3 * pad * std::size_t{b};
        double* const block = block_at(slot + b);
        unroll<C>([&](auto c) ORBIS_INLINE_LAMBDA { add(block, y, c, f[c], f[pad + c], f[2 * pad + c]); });
        mirror(a, b, block);
      }
    }
  }
  return work.end;
}

/// The steps of the points, `-V^-1 (g + W^T x)`, for the steps x of the cameras, padded like the blocks.
struct substitution {
  std::size_t begin = 0, end = 0;
  const double* mixed = nullptr;
  const std::uint32_t* first_mixed = nullptr;
  const std::uint32_t* mixed_unknown = nullptr;
  const double* inverse = nullptr;
  const double* cameras = nullptr;
  double* steps = nullptr;  ///< three of each point
};

template <int C, simd::target Target>
ORBIS_ALWAYS_INLINE void substitute(const substitution& work) {
  constexpr int pad = padded<C>, width = row_width<C, Target>, parts = pad / width;
  using row = simd::vec<double, width, Target>;
  for (std::size_t p = work.begin; p != work.end; ++p) {
    row sum[3][parts];
    unroll<parts>([&](auto i) ORBIS_INLINE_LAMBDA { sum[0][i] = sum[1][i] = sum[2][i] = row(0.0); });
    for (std::uint32_t a = work.first_mixed[p]; a != work.first_mixed[p + 1]; ++a) {
      const double* const w = work.mixed + 3 * pad * std::size_t{a};
      const double* const x = work.cameras + pad * std::size_t{work.mixed_unknown[a]};
      unroll<parts>([&](auto i) ORBIS_INLINE_LAMBDA {
        const row xi = row::load(x + width * i);
        unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA { sum[k][i] = sum[k][i] + row::load(w + pad * k + width * i) * xi; });
      });
    }
    const double* const m = work.inverse + point_at(p);
    double t[3];
    for (int k = 0; k != 3; ++k) {
      double entries[pad];
      unroll<parts>([&](auto i) ORBIS_INLINE_LAMBDA { sum[k][i].store(entries + width * i); });
      double total = entries[0];
      for (int i = 1; i != C; ++i) total += entries[i];
      t[k] = total;
    }
    const double u0 = -(m[48] + rounded_product(m[0], t[0]));
    const double u1 = -(m[56] + (rounded_product(m[8], t[0]) + rounded_product(m[16], t[1])));
    const double u2 =
        -(m[64] + (rounded_product(m[24], t[0]) + (rounded_product(m[32], t[1]) + rounded_product(m[40], t[2]))));
    double* const step = work.steps + 3 * p;
    step[0] = rounded_product(m[0], u0) + (rounded_product(m[8], u1) + rounded_product(m[24], u2));
    step[1] = rounded_product(m[16], u1) + rounded_product(m[32], u2);
    step[2] = m[40] * u2;
  }
}

/// The two loops over points, compiled for every instruction set.
template <int C>
struct eliminate_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE std::size_t run(const elimination& work) {
    return eliminate<C, Target>(work);
  }
};
template <int C>
struct substitute_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const substitution& work) {
    substitute<C, Target>(work);
  }
};

/// The kernels for this processor.
template <int C>
struct schur_kernels {
  using eliminator = std::size_t(const elimination&);
  using substituter = void(const substitution&);
  eliminator* eliminate_points = simd::kernel<eliminate_kernel<C>, eliminator>();
  substituter* substitute_points = simd::kernel<substitute_kernel<C>, substituter>();
};

}  // namespace orbis::optimize::detail

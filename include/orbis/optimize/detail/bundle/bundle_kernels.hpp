// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Linearisation and cost of the observations by one camera, eight at a time.
///
/// With q = R X + t and M = J_q^T W J_q, all blocks of the normal equations of an observation are products of M with R
/// and hat(q), which halves the number of arithmetic operations; see `camera_frame_residual`.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/bundle/lane_residual.hpp>
#include <orbis/optimize/detail/bundle/transposed.hpp>
#include <orbis/optimize/detail/loss_lanes.hpp>
#include <orbis/optimize/detail/unroll.hpp>

namespace orbis::optimize::detail {

/// Cost of an observation that has no projection after a step: as large as for an error of a thousand standard
/// deviations, so that losing observations never reduces the cost.
inline constexpr double out_of_sight = 0.5e6;

/// Memory layout of the camera-point blocks of eight observations: row by row in vectors of eight. With camera-frame
/// residuals, rows 3 to 5 are hat(q) times rows 0 to 2, and q is stored instead of them.
template <int C, bool ThroughCamera>
struct mixed_tile {
  static constexpr int vectors = 3 * C - (ThroughCamera ? 6 : 0);
  static constexpr std::size_t size = 8 * vectors;

  /// Returns the offset of row `i`; not valid for rows 3 to 5 of camera-frame residuals.
  [[nodiscard]] static constexpr int row(int i) { return 24 * (ThroughCamera && i >= 6 ? i - 2 : i); }
  static constexpr int q = 72;  ///< offset of q

  template <class L>
  static ORBIS_ALWAYS_INLINE void load(const double* from, L (*rows)[3]) {
    unroll<C>([&](auto i) ORBIS_INLINE_LAMBDA {
      if constexpr (!ThroughCamera || i < 3 || i >= 6)
        unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA { rows[i][k] = L::load(from + row(i) + 8 * k); });
    });
    if constexpr (ThroughCamera) {
      const L x = L::load(from + q), y = L::load(from + q + 8), z = L::load(from + q + 16);
      unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA {
        rows[3][k] = y * rows[2][k] - z * rows[1][k];
        rows[4][k] = z * rows[0][k] - x * rows[2][k];
        rows[5][k] = x * rows[1][k] - y * rows[0][k];
      });
    }
  }
};
/// Number of values per point: the upper triangle of its block of the normal equations, row by row, then its gradient.
inline constexpr int point_size = 12;
/// Number of values per camera: the lower triangle of its block, row by row, then its gradient.
template <int C>
inline constexpr int camera_numbers = C*(C + 1) / 2 + C;

/// Inputs and outputs for the observations by one camera.
template <class R>
struct camera_work {
  const R& residual;
  const typename R::view& view;
  std::size_t count = 0;
  const double* measurements = nullptr;                   ///< for residuals evaluated eight at a time
  const typename R::observation* observations = nullptr;  ///< for residuals evaluated individually
  const double* information = nullptr;                    ///< 0 for excluded observations
  const std::uint32_t* point = nullptr;
  const double* positions = nullptr;  ///< positions of the points, four values each
  // Outputs.
  double* normal = nullptr;  ///< `point_size` values per point, to which the observations contribute
  double* mixed = nullptr;   ///< one `mixed_tile` per eight observations if the camera is movable
  double* sums = nullptr;    ///< `camera_numbers` values; null if the camera is fixed
};

/// Evaluates eight residuals individually. Not inlined into the kernels, because these are compiled for instruction
/// sets that might round differently.
template <class R, int Columns>
struct tile_of_residuals {
  static constexpr std::size_t rows = R::dimension;
  double value[rows][8];
  double by_point[rows][3][8];
  double by_camera[rows][Columns == 0 ? 1 : Columns][8];
  double valid[8];
};

template <bool Derive, class R, int Columns>
[[gnu::noinline]] void evaluate_tile(const camera_work<R>& work, std::size_t first, const double* where,
                                     tile_of_residuals<R, Columns>& out) {
  constexpr int rows = R::dimension;
  matrix<rows, Columns> by_camera = zeros<matrix<rows, Columns>>();
  matrix<rows, 3> by_point = zeros<matrix<rows, 3>>();
  for (std::size_t i = 0; i != 8; ++i) {
    out.valid[i] = 0.0;
    std::optional<matrix<rows>> r;
    if (first + i < work.count && work.information[first + i] > 0.0) {
      const vec3 x{where[i], where[8 + i], where[16 + i]};
      const auto& o = work.observations[first + i];
      if constexpr (!Derive && camera_frame_residual<R>)
        r = work.residual.residual_in_camera(work.view, x, o);
      else if constexpr (!Derive)
        r = work.residual.residual(work.view, x, o);
      else if constexpr (camera_frame_residual<R>)
        r = work.residual.linearize_in_camera(work.view, x, o, by_point, by_camera);
      else
        r = work.residual.linearize(work.view, x, o, by_camera, by_point);
    }
    const bool valid = r && r->allFinite();
    out.valid[i] = valid ? 1.0 : 0.0;
    for (int d = 0; d != rows; ++d) {
      const auto row = static_cast<std::size_t>(d);
      out.value[row][i] = valid ? (*r)[d] : 0.0;
      if constexpr (Derive) {
        for (int k = 0; k != 3; ++k) out.by_point[row][k][i] = valid ? by_point(d, k) : 0.0;
        for (int k = 0; k != Columns; ++k) out.by_camera[row][k][i] = valid ? by_camera(d, k) : 0.0;
      }
    }
  }
}

/// Computes the residuals `r` of eight observations and, if `Derive` is true, their derivatives with respect to `q`
/// (the point in the camera frame, or, for general residuals, in the world frame) and to the other parameters. Returns
/// the mask of observations with a projection.
template <bool Derive, class R, int Columns, class L>
ORBIS_ALWAYS_INLINE typename L::mask_type residuals_of_tile(const camera_work<R>& work, std::size_t first, const L* q,
                                                            L* r, L (*by_q)[3],
                                                            L (*by_rest)[Columns == 0 ? 1 : Columns]) {
  if constexpr (lane_residual<R>) {
    return work.residual.template lanes_in_camera<Derive>(work.view, work.measurements + R::measured * first, q, r,
                                                          by_q, by_rest);
  } else {
    double where[24];
    q[0].store(where);
    q[1].store(where + 8);
    q[2].store(where + 16);
    tile_of_residuals<R, Columns> tile;
    evaluate_tile<Derive>(work, first, where, tile);
    for (int d = 0; d != R::dimension; ++d) {
      r[d] = L::load(tile.value[d]);
      if constexpr (Derive) {
        for (int k = 0; k != 3; ++k) by_q[d][k] = L::load(tile.by_point[d][k]);
        for (int k = 0; k != Columns; ++k) by_rest[d][k] = L::load(tile.by_camera[d][k]);
      }
    }
    return L(0.0) < L::load(tile.valid);
  }
}

/// Loads eight points in the camera frame or, for general residuals, in the world frame.
template <class R, class L>
ORBIS_ALWAYS_INLINE void points_of_tile(const camera_work<R>& work, std::size_t first, L* q) {
  const double* from[8];
  for (std::size_t i = 0; i != 8; ++i) from[i] = work.positions + 4 * std::size_t{work.point[first + i]};
  L p[3];
  load_transposed<3>(from, p);
  if constexpr (camera_frame_residual<R>) {
    const double* const m = work.view.rotation.data();
    for (int i = 0; i != 3; ++i)
      q[i] = ((m[i] * p[0] + m[3 + i] * p[1]) + m[6 + i] * p[2]) + work.view.translation.data()[i];
  } else {
    for (int i = 0; i != 3; ++i) q[i] = p[i];
  }
}

/// Returns the cost of a camera's observations at `work.view` and `work.positions`.
template <simd::target Target, class R, class Loss>
ORBIS_ALWAYS_INLINE double camera_cost(const camera_work<R>& work, const Loss& loss) {
  using L = simd::vec<double, 8, Target>;
  constexpr int columns = camera_frame_residual<R> ? R::camera_manifold::dimension - 6 : R::camera_manifold::dimension;
  L cost = 0.0;
  for (std::size_t first = 0; first < work.count; first += 8) {
    L q[3], r[R::dimension], by_q[R::dimension][3], by_rest[R::dimension][columns == 0 ? 1 : columns];
    points_of_tile(work, first, q);
    const auto valid = residuals_of_tile<false, R, columns>(work, first, q, r, by_q, by_rest);
    const L information = L::load(work.information + first);
    L squared = r[0] * r[0];
    for (int d = 1; d < R::dimension; ++d) squared = squared + r[d] * r[d];
    squared = select(valid, information * squared, L(0.0));
    const auto seen = valid & (squared <= L(1e100));
    L rho, weight;
    lanes_of_loss<Loss>::weigh(loss, select(seen, squared, L(0.0)), rho, weight);
    cost = cost + select(L(0.0) < information, select(seen, 0.5 * rho, L(out_of_sight)), L(0.0));
  }
  return simd::sum(cost);
}

/// Sets `flags[i]` if observation i has a finite residual.
template <simd::target Target, class R>
ORBIS_ALWAYS_INLINE void camera_visibility(const camera_work<R>& work, double* flags) {
  using L = simd::vec<double, 8, Target>;
  constexpr int columns = camera_frame_residual<R> ? R::camera_manifold::dimension - 6 : R::camera_manifold::dimension;
  for (std::size_t first = 0; first < work.count; first += 8) {
    L q[3], r[R::dimension], by_q[R::dimension][3], by_rest[R::dimension][columns == 0 ? 1 : columns];
    points_of_tile(work, first, q);
    const auto valid = residuals_of_tile<false, R, columns>(work, first, q, r, by_q, by_rest);
    L squared = r[0] * r[0];
    for (int d = 1; d < R::dimension; ++d) squared = squared + r[d] * r[d];
    squared = squared * L::load(work.information + first);
    select(valid & (squared <= L(1e100)), L(1.0), L(0.0)).store(flags + first);
  }
}

/// Adds the contributions of eight observations to their points.
template <class R, class L>
ORBIS_ALWAYS_INLINE void add_to_points(const camera_work<R>& work, std::size_t first, const L* share) {
  double* to[8];
  const L none = 0.0;
  for (std::size_t i = 0; i != 8; ++i) to[i] = work.normal + point_size * std::size_t{work.point[first + i]};
  add_transposed(share[0], share[1], share[2], share[3], to, 0);
  add_transposed(share[4], share[5], share[6], share[7], to, 4);
  add_transposed(share[8], none, none, none, to, 8);
}

/// Number of unknowns of a camera in addition to its pose; for general residuals, all unknowns.
template <class R>
inline constexpr int other_unknowns = R::camera_manifold::dimension - (camera_frame_residual<R> ? 6 : 0);

/// Eight linearised observations; zero for excluded ones.
template <class R, class L>
struct linear_tile {
  L q[3];                   ///< points, from `points_of_tile`
  L r[R::dimension];        ///< residuals
  L by_q[R::dimension][3];  ///< derivatives of the residuals
  L by_rest[R::dimension][std::max(1, other_unknowns<R>)];
  L weight;  ///< product of the information and the weight of the loss
};

/// Linearises eight observations; returns their costs.
template <class R, class Loss, class L>
ORBIS_ALWAYS_INLINE L linearize_tile(const camera_work<R>& work, const Loss& loss, std::size_t first,
                                     linear_tile<R, L>& out) {
  constexpr int rows = R::dimension, columns = other_unknowns<R>;
  L q[3], r[rows], by_q[rows][3], by_rest[rows][std::max(1, columns)];
  points_of_tile(work, first, q);
  const auto valid = residuals_of_tile<true, R, columns>(work, first, q, r, by_q, by_rest);
  const L information = L::load(work.information + first);
  L squared = r[0] * r[0];
  L size = squared;  // not finite if any value is not finite
  for (int d = 0; d != rows; ++d) {
    if (d != 0) squared = squared + r[d] * r[d];
    for (int k = 0; k != 3; ++k) size = size + by_q[d][k] * by_q[d][k];
    for (int k = 0; k != columns; ++k) size = size + by_rest[d][k] * by_rest[d][k];
  }
  squared = information * squared;
  const auto seen = valid & (squared <= L(1e100));
  L rho, weight;
  lanes_of_loss<Loss>::weigh(loss, select(seen, squared, L(0.0)), rho, weight);
  const auto used = seen & (information * size <= L(1e100));
  const auto kept = [&](const L& x) ORBIS_INLINE_LAMBDA { return select(used, x, L(0.0)); };
  out.weight = kept(information * weight);
  for (int k = 0; k != 3; ++k) out.q[k] = kept(q[k]);
  for (int d = 0; d != rows; ++d) {
    out.r[d] = kept(r[d]);
    for (int k = 0; k != 3; ++k) out.by_q[d][k] = kept(by_q[d][k]);
    for (int k = 0; k != columns; ++k) out.by_rest[d][k] = kept(by_rest[d][k]);
  }
  return select(L(0.0) < information, select(seen, 0.5 * rho, L(out_of_sight)), L(0.0));
}

/// Computes the normal equations of a camera's observations; returns their cost.
template <simd::target Target, class R, class Loss>
ORBIS_ALWAYS_INLINE double linearize_camera(const camera_work<R>& work, const Loss& loss) {
  using L = simd::vec<double, 8, Target>;
  constexpr int rows = R::dimension;
  constexpr int C = R::camera_manifold::dimension;
  constexpr bool through_camera = camera_frame_residual<R>;
  constexpr int columns = other_unknowns<R>;
  using mixed_block = mixed_tile<C, through_camera>;
  L hessian[C * (C + 1) / 2], gradient[C];
  for (auto& h : hessian) h = 0.0;
  for (auto& g : gradient) g = 0.0;
  L cost = 0.0;
  L minus_rotation[9];
  if constexpr (through_camera)
    for (int i = 0; i != 9; ++i) minus_rotation[i] = -work.view.rotation.data()[i];
  const auto at = [](int i, int j) ORBIS_INLINE_LAMBDA { return i * (i + 1) / 2 + j; };  // index in the lower triangle

  // Linearisation is one long dependency chain; the normal equations are many short ones. If they are separate, the
  // processor can overlap several tiles.
  constexpr std::size_t group = 8;
  linear_tile<R, L> tiles[group];
  for (std::size_t first = 0; first < work.count; first += 8) {
    if (first % (8 * group) == 0)
      for (std::size_t t = 0; t != group && first + 8 * t < work.count; ++t)
        cost = cost + linearize_tile(work, loss, first + 8 * t, tiles[t]);
    const auto& tile = tiles[first / 8 % group];
    const auto& q = tile.q;
    const auto& r = tile.r;
    const auto& by_q = tile.by_q;
    const auto& by_rest = tile.by_rest;
    const L& w = tile.weight;

    L weighted[rows][3];  // W J_q
    unroll<rows>([&](auto d) ORBIS_INLINE_LAMBDA {
      unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA { weighted[d][k] = w * by_q[d][k]; });
    });
    const auto product = [&](int i, int j) ORBIS_INLINE_LAMBDA {
      L sum = by_q[0][i] * weighted[0][j];
      unroll<rows - 1>([&](auto d) ORBIS_INLINE_LAMBDA { sum = sum + by_q[d + 1][i] * weighted[d + 1][j]; });
      return sum;
    };
    const auto times_residual = [&](const auto& column) ORBIS_INLINE_LAMBDA {
      L sum = column(0) * r[0];
      unroll<rows - 1>([&](auto d) ORBIS_INLINE_LAMBDA { sum = sum + column(d + 1) * r[d + 1]; });
      return sum;
    };
    L m[3][3], b[3];  // J_q^T W J_q, J_q^T W r
    unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA {
      unroll<i + 1>([&](auto j) ORBIS_INLINE_LAMBDA {
        const L entry = product(i, j);
        m[i][j] = entry;
        m[j][i] = entry;
      });
      b[i] = times_residual([&](int d) ORBIS_INLINE_LAMBDA -> const L& { return weighted[d][i]; });
    });

    L share[9];
    double* const mixed = work.sums != nullptr ? work.mixed + mixed_block::size * (first / 8) : nullptr;
    if constexpr (through_camera) {
      unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA { b[i] = L(0.0) - b[i]; });
      const auto cross = [&](const L* v, L* out) ORBIS_INLINE_LAMBDA {  // hat(q) v
        out[0] = q[1] * v[2] - q[2] * v[1];
        out[1] = q[2] * v[0] - q[0] * v[2];
        out[2] = q[0] * v[1] - q[1] * v[0];
      };
      L top[3][3];  // -M R
      unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA {
        const L* const column = minus_rotation + 3 * k;
        unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA {
          top[i][k] = (m[i][0] * column[0] + m[i][1] * column[1]) + m[i][2] * column[2];
        });
      });
      int next = 0;
      unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA {
        const L* const row = minus_rotation + 3 * i;
        unroll<3 - i>([&](auto d) ORBIS_INLINE_LAMBDA {
          constexpr int k = decltype(i)::value + decltype(d)::value;
          share[next++] = (row[0] * top[0][k] + row[1] * top[1][k]) + row[2] * top[2][k];
        });
        share[6 + i] = (row[0] * b[0] + row[1] * b[1]) + row[2] * b[2];
      });
      if (work.sums != nullptr) {
        unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA {
          unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA { top[i][k].store(mixed + mixed_block::row(i) + 8 * k); });
          q[i].store(mixed + mixed_block::q + 8 * i);
        });
        L turned[3][3];  // hat(q) M, by column
        unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA { cross(m[k], turned[k]); });
        unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA {
          unroll<i + 1>([&](auto j) ORBIS_INLINE_LAMBDA { hessian[at(i, j)] = hessian[at(i, j)] + m[i][j]; });
          unroll<3>([&](auto j) ORBIS_INLINE_LAMBDA { hessian[at(3 + i, j)] = hessian[at(3 + i, j)] + turned[j][i]; });
          const L row[3] = {turned[0][i], turned[1][i], turned[2][i]};
          L twice[3];
          cross(row, twice);
          unroll<i + 1>([&](auto j)
                            ORBIS_INLINE_LAMBDA { hessian[at(3 + i, 3 + j)] = hessian[at(3 + i, 3 + j)] + twice[j]; });
          gradient[i] = gradient[i] + b[i];
        });
        L moment[3];
        cross(b, moment);
        unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA { gradient[3 + i] = gradient[3 + i] + moment[i]; });
        unroll<columns>([&](auto c) ORBIS_INLINE_LAMBDA {
          L n[3], swung[3];  // -J_k^T W J_q
          unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA {
            L sum = by_rest[0][c] * weighted[0][i];
            unroll<rows - 1>([&](auto d) ORBIS_INLINE_LAMBDA { sum = sum + by_rest[d + 1][c] * weighted[d + 1][i]; });
            n[i] = L(0.0) - sum;
          });
          cross(n, swung);
          unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA {
            hessian[at(6 + c, i)] = hessian[at(6 + c, i)] + n[i];
            hessian[at(6 + c, 3 + i)] = hessian[at(6 + c, 3 + i)] + swung[i];
            const L* const column = minus_rotation + 3 * i;
            const L entry = (n[0] * column[0] + n[1] * column[1]) + n[2] * column[2];
            entry.store(mixed + mixed_block::row(6 + c) + 8 * i);
          });
          unroll<c + 1>([&](auto e) ORBIS_INLINE_LAMBDA {
            L sum = by_rest[0][c] * (w * by_rest[0][e]);
            unroll<rows - 1>([&](auto d)
                                 ORBIS_INLINE_LAMBDA { sum = sum + by_rest[d + 1][c] * (w * by_rest[d + 1][e]); });
            hessian[at(6 + c, 6 + e)] = hessian[at(6 + c, 6 + e)] + sum;
          });
          L pull = by_rest[0][c] * (w * r[0]);
          unroll<rows - 1>([&](auto d) ORBIS_INLINE_LAMBDA { pull = pull + by_rest[d + 1][c] * (w * r[d + 1]); });
          gradient[6 + c] = gradient[6 + c] + pull;
        });
      }
    } else {
      int next = 0;
      unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA {
        unroll<3 - i>([&](auto d) ORBIS_INLINE_LAMBDA { share[next++] = m[i][i + d]; });
        share[6 + i] = b[i];
      });
      if (work.sums != nullptr) {
        for (int c = 0; c != C; ++c) {
          for (int k = 0; k != 3; ++k) {
            L sum = by_rest[0][c] * weighted[0][k];
            for (int d = 1; d < rows; ++d) sum = sum + by_rest[d][c] * weighted[d][k];
            sum.store(mixed + mixed_block::row(c) + 8 * k);
          }
          L pulled[rows];
          for (int d = 0; d != rows; ++d) pulled[d] = w * by_rest[d][c];
          for (int e = 0; e <= c; ++e) {
            L sum = by_rest[0][e] * pulled[0];
            for (int d = 1; d < rows; ++d) sum = sum + by_rest[d][e] * pulled[d];
            hessian[at(c, e)] = hessian[at(c, e)] + sum;
          }
          L sum = pulled[0] * r[0];
          for (int d = 1; d < rows; ++d) sum = sum + pulled[d] * r[d];
          gradient[c] = gradient[c] + sum;
        }
      }
    }
    add_to_points(work, first, share);
  }
  if (work.sums != nullptr) {
    for (int i = 0; i != C * (C + 1) / 2; ++i) work.sums[i] = simd::sum(hessian[i]);
    for (int i = 0; i != C; ++i) work.sums[C * (C + 1) / 2 + i] = simd::sum(gradient[i]);
  }
  return simd::sum(cost);
}

/// The loops over the observations of a camera, compiled for every instruction set.
template <class R, class Loss>
struct linearize_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE double run(const camera_work<R>& work, const Loss& loss) {
    return linearize_camera<Target>(work, loss);
  }
};
template <class R, class Loss>
struct cost_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE double run(const camera_work<R>& work, const Loss& loss) {
    return camera_cost<Target>(work, loss);
  }
};
/// The loop that finds observations without a projection. It runs once per problem, so one instruction set is enough.
template <class R>
struct visibility_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const camera_work<R>& work, double* flags) {
    camera_visibility<Target>(work, flags);
  }
};
template <class R>
void find_visible(const camera_work<R>& work, double* flags) {
  simd::kernel<visibility_kernel<R>, void(const camera_work<R>&, double*), simd::portable>()(work, flags);
}

/// Pointers to the kernels for this processor's instruction set.
template <class R, class Loss>
struct bundle_kernels {
  using reduce = double(const camera_work<R>&, const Loss&);
  reduce* linearize;
  reduce* cost;
  bundle_kernels();
};
template <class R, class Loss>
bundle_kernels<R, Loss>::bundle_kernels()
    : linearize{simd::kernel<linearize_kernel<R, Loss>, reduce>()},
      cost{simd::kernel<cost_kernel<R, Loss>, reduce>()} {}

}  // namespace orbis::optimize::detail

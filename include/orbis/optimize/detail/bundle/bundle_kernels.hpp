// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Linearisation and cost of all observations by one camera, eight at a time.
///
/// With q = R X + t and M = J_q^T W J_q all blocks of the normal equations of an observation are products of M with R
/// and hat(q), which saves half of the arithmetic; see `camera_frame_residual`.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
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

/// The cost of an observation that loses its projection by a step: that of an error of a thousand sigmas, so that no
/// step gains by losing observations.
inline constexpr double out_of_sight = 0.5e6;

/// Rows of the camera-point block of an observation, rounded up to whole registers.
template <int C>
inline constexpr int padded = (C + 3) / 4 * 4;
/// Size of the contribution of an observation to its point: the upper triangle of the block, row by row, then the
/// gradient.
inline constexpr int share_size = 12;

/// All observations by one camera.
template <class R>
struct camera_work {
  const R& residual;
  const typename R::view& view;
  std::size_t count = 0;
  const double* measurements = nullptr;                   ///< for residuals that are evaluated in lanes
  const typename R::observation* observations = nullptr;  ///< for other residuals
  const double* information = nullptr;                    ///< 0 for those that take no part
  const std::uint32_t* point = nullptr;
  const double* positions = nullptr;  ///< of the points, four numbers each
  // Where results go.
  const std::uint32_t* by_point = nullptr;
  const std::uint32_t* mixed_by_point = nullptr;
  double* shares = nullptr;
  double* mixed = nullptr;    ///< null for a camera that does not move
  double* hessian = nullptr;  ///< C x C of the camera
  double* gradient = nullptr;
};

/// Residuals of eight observations, for residuals that are evaluated one at a time. Not inlined into the kernels, which
/// are compiled for instruction sets that might round differently.
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
  matrix<rows, Columns> by_camera = matrix<rows, Columns>::Zero();
  matrix<rows, 3> by_point = matrix<rows, 3>::Zero();
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

/// The residuals `r` of eight observations, and with `Derive` their derivatives by `q` (the point in the camera frame,
/// or for general residuals in the world) and by the other parameters. Returns which have a projection.
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

/// Loads eight points in the camera frame; for general residuals in the world.
template <class R, class L>
ORBIS_ALWAYS_INLINE void points_of_tile(const camera_work<R>& work, std::size_t first, L* q) {
  const double* from[8];
  for (std::size_t i = 0; i != 8; ++i) from[i] = work.positions + 4 * std::size_t{work.point[first + i]};
  L p[3];
  load_transposed(from, p);
  if constexpr (camera_frame_residual<R>) {
    const double* const m = work.view.rotation.data();
    for (int i = 0; i != 3; ++i)
      q[i] = ((m[i] * p[0] + m[3 + i] * p[1]) + m[6 + i] * p[2]) + work.view.translation.data()[i];
  } else {
    for (int i = 0; i != 3; ++i) q[i] = p[i];
  }
}

/// The cost of a camera's observations at `work.view` and `work.positions`.
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

/// Sets `flags[i]` where observation i has a finite residual.
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

/// Writes the contributions of eight observations to their points, and their camera-point blocks.
template <int C, class R, class L>
ORBIS_ALWAYS_INLINE void scatter(const camera_work<R>& work, std::size_t first, const L* share, const L (*mixed)[3]) {
  constexpr int pad = padded<C>;
  const std::size_t count = work.count - first;
  double nowhere[3 * pad > share_size ? 3 * pad : share_size];  // for the empty places of the last tile
  double* to[8];
  for (std::size_t i = 0; i != 8; ++i)
    to[i] = i < count ? work.shares + share_size * std::size_t{work.by_point[first + i]} : nowhere;
  const L none = 0.0;
  store_transposed(share[0], share[1], share[2], share[3], to, 0);
  store_transposed(share[4], share[5], share[6], share[7], to, 4);
  store_transposed(share[8], none, none, none, to, 8);
  if (work.mixed == nullptr) return;
  for (std::size_t i = 0; i != 8; ++i)
    to[i] = i < count ? work.mixed + 3 * pad * std::size_t{work.mixed_by_point[first + i]} : nowhere;
  unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA {
    unroll<pad / 4>([&](auto quarter_of) ORBIS_INLINE_LAMBDA {
      constexpr int row = 4 * decltype(quarter_of)::value;
      const auto at = [&](int i) ORBIS_INLINE_LAMBDA -> const L& { return i < C ? mixed[i][k] : none; };
      store_transposed(at(row), at(row + 1), at(row + 2), at(row + 3), to, pad * k + row);
    });
  });
}

/// Normal equations of a camera's observations; returns their cost.
template <simd::target Target, class R, class Loss>
ORBIS_ALWAYS_INLINE double linearize_camera(const camera_work<R>& work, const Loss& loss) {
  using L = simd::vec<double, 8, Target>;
  constexpr int rows = R::dimension;
  constexpr int C = R::camera_manifold::dimension;
  constexpr bool through_camera = camera_frame_residual<R>;
  constexpr int columns = through_camera ? C - 6 : C;
  constexpr int room = columns == 0 ? 1 : columns;
  L hessian[C * (C + 1) / 2], gradient[C];
  for (auto& h : hessian) h = 0.0;
  for (auto& g : gradient) g = 0.0;
  L cost = 0.0;
  L minus_rotation[9];
  if constexpr (through_camera)
    for (int i = 0; i != 9; ++i) minus_rotation[i] = -work.view.rotation.data()[i];
  const auto at = [](int i, int j) ORBIS_INLINE_LAMBDA { return i * (i + 1) / 2 + j; };  // of the lower triangle

  for (std::size_t first = 0; first < work.count; first += 8) {
    L q[3], r[rows], by_q[rows][3], by_rest[rows][room];
    points_of_tile(work, first, q);
    auto valid = residuals_of_tile<true, R, columns>(work, first, q, r, by_q, by_rest);
    const L information = L::load(work.information + first);
    L squared = r[0] * r[0];
    L size = squared;  // anything that is not finite makes this so
    for (int d = 0; d != rows; ++d) {
      if (d != 0) squared = squared + r[d] * r[d];
      for (int k = 0; k != 3; ++k) size = size + by_q[d][k] * by_q[d][k];
      for (int k = 0; k != columns; ++k) size = size + by_rest[d][k] * by_rest[d][k];
    }
    squared = information * squared;
    const auto seen = valid & (squared <= L(1e100));
    L rho, weight;
    lanes_of_loss<Loss>::weigh(loss, select(seen, squared, L(0.0)), rho, weight);
    cost = cost + select(L(0.0) < information, select(seen, 0.5 * rho, L(out_of_sight)), L(0.0));
    const auto used = seen & (information * size <= L(1e100));
    const L w = select(used, information * weight, L(0.0));
    for (auto& coordinate : q) coordinate = select(used, coordinate, L(0.0));
    for (int d = 0; d != rows; ++d) {
      r[d] = select(used, r[d], L(0.0));
      for (int k = 0; k != 3; ++k) by_q[d][k] = select(used, by_q[d][k], L(0.0));
      for (int k = 0; k != columns; ++k) by_rest[d][k] = select(used, by_rest[d][k], L(0.0));
    }

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

    L share[9], mixed[C][3];
    if constexpr (through_camera) {
      unroll<C - 6>([&](auto i) ORBIS_INLINE_LAMBDA {  // fixed cameras write nothing there, and the compiler warns
        unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA { mixed[6 + i][k] = L(0.0); });
      });
      unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA { b[i] = L(0.0) - b[i]; });
      const auto cross = [&](const L* v, L* out) ORBIS_INLINE_LAMBDA {  // hat(q) v
        out[0] = q[1] * v[2] - q[2] * v[1];
        out[1] = q[2] * v[0] - q[0] * v[2];
        out[2] = q[0] * v[1] - q[1] * v[0];
      };
      unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA {
        L top[3], bottom[3];
        const L* const column = minus_rotation + 3 * k;
        unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA {
          top[i] = (m[i][0] * column[0] + m[i][1] * column[1]) + m[i][2] * column[2];
          mixed[i][k] = top[i];
        });
        cross(top, bottom);
        unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA { mixed[3 + i][k] = bottom[i]; });
      });
      int next = 0;
      unroll<3>([&](auto i) ORBIS_INLINE_LAMBDA {
        const L* const row = minus_rotation + 3 * i;
        unroll<3 - i>([&](auto d) ORBIS_INLINE_LAMBDA {
          constexpr int k = decltype(i)::value + decltype(d)::value;
          share[next++] = (row[0] * mixed[0][k] + row[1] * mixed[1][k]) + row[2] * mixed[2][k];
        });
        share[6 + i] = (row[0] * b[0] + row[1] * b[1]) + row[2] * b[2];
      });
      if (work.mixed != nullptr) {
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
            mixed[6 + c][i] = (n[0] * column[0] + n[1] * column[1]) + n[2] * column[2];
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
      if (work.mixed != nullptr) {
        for (int c = 0; c != C; ++c) {
          for (int k = 0; k != 3; ++k) {
            L sum = by_rest[0][c] * weighted[0][k];
            for (int d = 1; d < rows; ++d) sum = sum + by_rest[d][c] * weighted[d][k];
            mixed[c][k] = sum;
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
    scatter<C>(work, first, share, mixed);
  }
  if (work.mixed != nullptr)
    for (int i = 0; i != C; ++i) {
      work.gradient[i] = simd::sum(gradient[i]);
      for (int j = 0; j <= i; ++j) work.hessian[i * C + j] = work.hessian[j * C + i] = simd::sum(hessian[at(i, j)]);
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
/// Runs once for a problem, so that one instruction set is enough.
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

/// The kernels for this processor.
template <class R, class Loss>
struct bundle_kernels {
  using reduce = double(const camera_work<R>&, const Loss&);
  reduce* linearize = simd::kernel<linearize_kernel<R, Loss>, reduce>();
  reduce* cost = simd::kernel<cost_kernel<R, Loss>, reduce>();
};

}  // namespace orbis::optimize::detail

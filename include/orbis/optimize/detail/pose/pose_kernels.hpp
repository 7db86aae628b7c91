// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The inner loops of pose refinement: eight observations at a time, for any camera model and loss. Every instruction
/// set gives the same bits.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include <orbis/camera/project_lanes.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/optimize/detail/loss_lanes.hpp>
#include <orbis/optimize/reprojection.hpp>

namespace orbis::optimize::detail {

/// Observations as a structure of arrays, with room for `capacity`. About 64 kB.
struct alignas(64) pose_lanes {
  static constexpr std::size_t capacity = 1024;
  using row = std::array<double, capacity>;
  row x, y, z;       ///< coordinates of the point
  row u, v, right;   ///< pixel and right coordinate of the observation
  row depth_weight;  ///< 0 if the depth is unknown
  row information;   ///< 0 for unusable observations
  row active;        ///< information of inliers, 0 for outliers
};

/// The normal equations of a pose `T_camera_world` with steps on the left, `exp(xi) * T`.
struct pose_sums {
  /// H: the lower triangle for the translation, row by row; the block for translation and rotation; the lower triangle
  /// for the rotation.
  std::array<double, 6> translation{};
  std::array<double, 9> corner{};
  std::array<double, 6> rotation{};
  std::array<double, 6> gradient{};
  double cost = 0.0;  ///< half the sum of the robust loss
};

/// The constants of one pass over the observations.
struct pose_at {
  mat3 rotation;  ///< from the world to the camera
  vec3 translation;
  double bf;
  double without_projection;  ///< chi-squared error of a point without a projection
};

/// Eight observations at a pose: points in the camera frame, their residuals and chi-squared errors.
template <camera::double_lanes L>
struct pose_block {
  L x, y, z;
  L r0, r1, r2;
  L chi2;
  camera::lane_projection<L> projection;
  L depth_weight;
  L inverse_z;
};

template <bool Jacobian, class Camera, camera::double_lanes L>
ORBIS_ALWAYS_INLINE void see(const pose_lanes& in, std::size_t i, const L& information, const Camera& camera,
                             const pose_at& at, pose_block<L>& b) {
  const L wx = L::load(&in.x[i]), wy = L::load(&in.y[i]), wz = L::load(&in.z[i]);
  const auto& r = at.rotation;
  b.x = r(0, 0) * wx + r(0, 1) * wy + r(0, 2) * wz + at.translation.x();
  b.y = r(1, 0) * wx + r(1, 1) * wy + r(1, 2) * wz + at.translation.y();
  b.z = r(2, 0) * wx + r(2, 1) * wy + r(2, 2) * wz + at.translation.z();
  camera::lanes_of<Camera>::template project<Jacobian>(camera, b.x, b.y, b.z, b.projection);
  b.inverse_z = 1.0 / b.z;
  b.depth_weight = L::load(&in.depth_weight[i]);
  b.r0 = b.projection.u - L::load(&in.u[i]);
  b.r1 = b.projection.v - L::load(&in.v[i]);
  b.r2 = b.depth_weight * (b.projection.u - at.bf * b.inverse_z - L::load(&in.right[i]));
  b.chi2 = information * (b.r0 * b.r0 + b.r1 * b.r1 + b.r2 * b.r2);
  b.projection.valid = b.projection.valid & (b.chi2 <= L(std::numeric_limits<double>::max()));
}

/// Computes the equations of the first `count` observations, a multiple of eight. A point without a projection has the
/// cost of a point at the gate, so that a step cannot reduce the cost by losing points.
template <simd::target Target, class Camera>
ORBIS_ALWAYS_INLINE void sum_pose(const pose_lanes& in, std::size_t count, const Camera& camera, const pose_at& at,
                                  const huber& loss, pose_sums& out) {
  using L = simd::vec<double, 8, Target>;
  constexpr bool aligned = camera::lanes_of<Camera>::axis_aligned;
  L t0(0.0), t1(0.0), t2(0.0), t3(0.0), t4(0.0), t5(0.0);
  L c0(0.0), c1(0.0), c2(0.0), c3(0.0), c4(0.0), c5(0.0), c6(0.0), c7(0.0), c8(0.0);
  L r0(0.0), r1(0.0), r2(0.0), r3(0.0), r4(0.0), r5(0.0);
  L g0(0.0), g1(0.0), g2(0.0), g3(0.0), g4(0.0), g5(0.0);
  L total(0.0);
  const L lost = loss.cost(at.without_projection);
  for (std::size_t i = 0; i != count; i += L::count) {
    const L information = L::load(&in.active[i]);
    pose_block<L> b;
    see<true>(in, i, information, camera, at, b);
    const auto active = L(0.0) < information;
    const auto valid = active & b.projection.valid;
    L cost, weight;
    lanes_of_loss<huber>::weigh(loss, select(valid, b.chi2, L(0.0)), cost, weight);
    total = total + select(valid, cost, select(active, lost, L(0.0)));
    weight = weight * information;

    // Compute M = w J^T J and v = w J^T r for a step of the point, then apply the chain rule for a step of the pose.
    const auto& j = b.projection.j;
    const L j20 = b.depth_weight * j[0][0];
    const L j22 = b.depth_weight * (j[0][2] + at.bf * b.inverse_z * b.inverse_z);
    const L w00 = weight * j[0][0], w02 = weight * j[0][2], w11 = weight * j[1][1], w12 = weight * j[1][2];
    const L w20 = weight * j20, w22 = weight * j22;
    L m00 = w00 * j[0][0] + w20 * j20;
    L m02 = w00 * j[0][2] + w20 * j22;
    L m11 = w11 * j[1][1];
    L m12 = w11 * j[1][2];
    L m22 = w02 * j[0][2] + w12 * j[1][2] + w22 * j22;
    L m01(0.0);
    L v0 = w00 * b.r0 + w20 * b.r2;
    L v1 = w11 * b.r1;
    L v2 = w02 * b.r0 + w12 * b.r1 + w22 * b.r2;
    if constexpr (!aligned) {
      const L j21 = b.depth_weight * j[0][1];
      const L w01 = weight * j[0][1], w10 = weight * j[1][0], w21 = weight * j21;
      m00 = m00 + w10 * j[1][0];
      m01 = w00 * j[0][1] + w10 * j[1][1] + w20 * j21;
      m02 = m02 + w10 * j[1][2];
      m11 = m11 + w01 * j[0][1] + w21 * j21;
      m12 = m12 + w01 * j[0][2] + w21 * j22;
      v0 = v0 + w10 * b.r1;
      v1 = v1 + w01 * b.r0 + w21 * b.r2;
      m01 = select(valid, m01, L(0.0));
    }
    m00 = select(valid, m00, L(0.0));
    m02 = select(valid, m02, L(0.0));
    m11 = select(valid, m11, L(0.0));
    m12 = select(valid, m12, L(0.0));
    m22 = select(valid, m22, L(0.0));
    v0 = select(valid, v0, L(0.0));
    v1 = select(valid, v1, L(0.0));
    v2 = select(valid, v2, L(0.0));

    const L &x = b.x, &y = b.y, &z = b.z;
    t0 = t0 + m00;
    t2 = t2 + m11;
    t3 = t3 + m02;
    t4 = t4 + m12;
    t5 = t5 + m22;
    // Rows of the mixed block: p x (row of M). Rotation block: p x (column of the mixed block).
    const L n00 = y * m02, n10 = y * m12, n20 = y * m22;
    L a00 = n00, a02(0.0), a10 = n10, a12 = x * m11, a11, a01;
    if constexpr (aligned) {
      a01 = z * m00 - x * m02;
      a02 = L(0.0) - y * m00;
      a10 = n10 - z * m11;
      a11 = L(0.0) - x * m12;
    } else {
      t1 = t1 + m01;
      a00 = n00 - z * m01;
      a01 = z * m00 - x * m02;
      a02 = x * m01 - y * m00;
      a10 = n10 - z * m11;
      a11 = z * m01 - x * m12;
      a12 = a12 - y * m01;
    }
    const L a20 = n20 - z * m12, a21 = z * m02 - x * m22, a22 = x * m12 - y * m02;
    c0 = c0 + a00;
    c1 = c1 + a01;
    c2 = c2 + a02;
    c3 = c3 + a10;
    c4 = c4 + a11;
    c5 = c5 + a12;
    c6 = c6 + a20;
    c7 = c7 + a21;
    c8 = c8 + a22;
    r0 = r0 + (y * a20 - z * a10);
    r1 = r1 + (z * a00 - x * a20);
    r2 = r2 + (z * a01 - x * a21);
    r3 = r3 + (x * a10 - y * a00);
    r4 = r4 + (x * a11 - y * a01);
    r5 = r5 + (x * a12 - y * a02);
    g0 = g0 + v0;
    g1 = g1 + v1;
    g2 = g2 + v2;
    g3 = g3 + (y * v2 - z * v1);
    g4 = g4 + (z * v0 - x * v2);
    g5 = g5 + (x * v1 - y * v0);
  }
  out.translation = {sum(t0), sum(t1), sum(t2), sum(t3), sum(t4), sum(t5)};
  out.corner = {sum(c0), sum(c1), sum(c2), sum(c3), sum(c4), sum(c5), sum(c6), sum(c7), sum(c8)};
  out.rotation = {sum(r0), sum(r1), sum(r2), sum(r3), sum(r4), sum(r5)};
  out.gradient = {sum(g0), sum(g1), sum(g2), sum(g3), sum(g4), sum(g5)};
  out.cost = 0.5 * sum(total);
}

/// Computes the chi-squared errors of the first `count` observations, including outliers; infinite for points without a
/// projection or without information.
template <simd::target Target, class Camera>
ORBIS_ALWAYS_INLINE void judge_pose(const pose_lanes& in, std::size_t count, const Camera& camera, const pose_at& at,
                                    double* chi2) {
  using L = simd::vec<double, 8, Target>;
  for (std::size_t i = 0; i != count; i += L::count) {
    const L information = L::load(&in.information[i]);
    pose_block<L> b;
    see<false>(in, i, information, camera, at, b);
    select(b.projection.valid & (L(0.0) < information), b.chi2, L(std::numeric_limits<double>::infinity()))
        .store(chi2 + i);
  }
}

/// The two loops, compiled for every instruction set.
template <class Camera>
struct sum_pose_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const pose_lanes& in, std::size_t count, const Camera& camera, const pose_at& at,
                                      const huber& loss, pose_sums& out) {
    sum_pose<Target>(in, count, camera, at, loss, out);
  }
};
template <class Camera>
struct judge_pose_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const pose_lanes& in, std::size_t count, const Camera& camera, const pose_at& at,
                                      double* chi2) {
    judge_pose<Target>(in, count, camera, at, chi2);
  }
};

/// Returns a pointer to the loop for this processor's instruction set.
template <class Camera>
[[nodiscard]] auto* sum_pose_function() noexcept {
  return simd::kernel<sum_pose_kernel<Camera>,
                      void(const pose_lanes&, std::size_t, const Camera&, const pose_at&, const huber&, pose_sums&)>();
}
template <class Camera>
[[nodiscard]] auto* judge_pose_function() noexcept {
  return simd::kernel<judge_pose_kernel<Camera>,
                      void(const pose_lanes&, std::size_t, const Camera&, const pose_at&, double*)>();
}

}  // namespace orbis::optimize::detail

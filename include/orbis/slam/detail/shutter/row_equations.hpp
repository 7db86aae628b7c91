// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The normal equations of a pose and of the camera motion during read-out, from keypoints as read: eight keypoints at
/// a time, for any camera model. Every instruction set gives the same bits.
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/project_lanes.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/reprojection.hpp>

namespace orbis::slam::detail {

/// A keypoint as read, and the known point that it observes.
struct row_observation {
  optimize::pose_observation seen;
  double time = 0.0;  ///< time of the keypoint's row relative to the frame, seconds
};

/// Observations in blocks of eight, as a structure of arrays. Reuses its memory.
class row_lanes {
 public:
  /// Eight observations. `information` is 0 in unused lanes.
  struct alignas(64) block {
    std::array<double, 8> x{}, y{}, z{}, time{}, information{};
    std::array<double, std::size_t{8} * optimize::reprojection<camera::pinhole>::measured> measurements{};
  };

  void clear() { count_ = 0; }
  /// Adds an observation. Amortised O(1).
  template <camera::camera_model Camera>
  void add(const row_observation& o, const optimize::reprojection<Camera>& model) {
    const std::size_t lane = count_ % 8, at = count_ / 8;
    if (blocks_.size() == at) blocks_.emplace_back();
    block& b = blocks_[at];
    if (lane == 0) b = {};
    b.x[lane] = o.seen.point.x(), b.y[lane] = o.seen.point.y(), b.z[lane] = o.seen.point.z();
    b.time[lane] = o.time;
    b.information[lane] = o.seen.information;
    model.measure(o.seen, b.measurements.data() + lane);
    ++count_;
  }
  [[nodiscard]] const block* blocks() const noexcept { return blocks_.data(); }
  [[nodiscard]] std::size_t block_count() const noexcept { return (count_ + 7) / 8; }

 private:
  std::vector<block> blocks_;
  std::size_t count_ = 0;
};

/// The normal equations of the residuals `r` with weights `w`, summed over observations. `J` is the derivative with
/// respect to a motion of the camera frame (`exp(step) * T_camera_world`) at the time `t` of the observation's row; the
/// derivative with respect to the twist is `-t J`.
struct row_sums {
  /// Entries on and below the diagonal of a symmetric matrix, row by row.
  using triangle = std::array<double, 21>;
  std::array<triangle, 3> h{};               ///< `(-t)^k w J^T J`, k = 0, 1, 2
  std::array<std::array<double, 6>, 2> g{};  ///< `(-t)^k w J^T r`, k = 0, 1
  double cost = 0.0;                         ///< half the sum of the robust loss

  [[nodiscard]] mat6 matrix(std::size_t k) const {
    mat6 out;
    std::size_t i = 0;
    for (int row = 0; row != 6; ++row)
      for (int column = 0; column <= row; ++column) out(row, column) = out(column, row) = h[k][i++];
    return out;
  }
  [[nodiscard]] vec6 gradient(std::size_t k) const {
    vec6 out;
    for (int row = 0; row != 6; ++row) out[row] = g[k][static_cast<std::size_t>(row)];
    return out;
  }
};

/// The pose and the twist at which the equations are evaluated.
struct row_state {
  mat3 rotation;  ///< from the world to the camera
  vec3 translation;
  vec6 twist;
  bool with_depth = true;  ///< false: only pixels are used
};

/// Width of the Huber loss for these residuals, in standard deviations: as in pose-only refinement.
inline constexpr double row_loss_width = 2.447;

/// Sums blocks of observations.
template <class Camera>
struct row_kernel {
  using signature = void(const row_lanes::block*, std::size_t count, const optimize::reprojection<Camera>&,
                         const row_state&, row_sums&);

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const row_lanes::block* blocks, std::size_t count,
                                      const optimize::reprojection<Camera>& model, const row_state& at, row_sums& out) {
    using L = simd::vec<double, 8, Target>;
    L h[3][21], g[2][6], total(0.0);
    for (auto& of_power : h)
      for (L& entry : of_power) entry = 0.0;
    for (auto& of_power : g)
      for (L& entry : of_power) entry = 0.0;
    const double depth = at.with_depth ? 1.0 : 0.0;
    constexpr double bound = row_loss_width * row_loss_width;

    for (const row_lanes::block* b = blocks; b != blocks + count; ++b) {
      // The point in the camera frame at the time of its row, by the formula of camera::moved_by.
      const L t = L(0.0) - L::load(b->time.data());
      const L wx = L::load(b->x.data()), wy = L::load(b->y.data()), wz = L::load(b->z.data());
      L q[3], turn[3], motion[3];
      for (int i = 0; i != 3; ++i) {
        q[i] = at.rotation(i, 0) * wx + at.rotation(i, 1) * wy + at.rotation(i, 2) * wz + at.translation[i];
        turn[i] = t * at.twist[3 + i];
      }
      for (int i = 0; i != 3; ++i) motion[i] = across(turn, q, i) + t * at.twist[i];
      for (int i = 0; i != 3; ++i) q[i] = q[i] + motion[i] + 0.5 * across(turn, motion, i);

      // The residual of optimize::reprojection, and its derivative by the point.
      const auto measured = [&](int i) ORBIS_INLINE_LAMBDA { return L::load(b->measurements.data() + 8 * i); };
      camera::lane_projection<L> seen;
      camera::lanes_of<Camera>::template project<true>(model.camera, q[0], q[1], q[2], seen);
      const L inverse_z = 1.0 / q[2], shift = model.bf * inverse_z, depth_weight = depth * measured(3);
      const L smear[2] = {measured(4), measured(5)};
      L r[3] = {seen.u - measured(0), seen.v - measured(1)}, by_q[3][3];
      const L along = smear[0] * r[0] + smear[1] * r[1];
      r[2] = depth_weight * ((seen.u - shift) - measured(2) - along * smear[0]);
      for (int i = 0; i != 2; ++i) r[i] -= along * smear[i];
      for (int k = 0; k != 3; ++k) {
        const L change = smear[0] * seen.j[0][k] + smear[1] * seen.j[1][k];
        for (int i = 0; i != 2; ++i) by_q[i][k] = seen.j[i][k] - change * smear[i];
        by_q[2][k] = depth_weight * (k == 2 ? by_q[0][2] + shift * inverse_z : by_q[0][k]);
      }
      const L information = L::load(b->information.data());
      const auto valid = seen.valid & (L(0.0) < information);
      for (int i = 0; i != 3; ++i) {
        q[i] = select(valid, q[i], L(0.0));
        r[i] = select(valid, r[i], L(0.0));
        for (int k = 0; k != 3; ++k) by_q[i][k] = select(valid, by_q[i][k], L(0.0));
      }
      const L squared = information * (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
      const auto inside = squared <= L(bound);
      const L pull = row_loss_width * simd::reciprocal_root(select(inside, L(1.0), squared));
      total += select(inside, squared, 2.0 * (squared * pull) - bound);
      const L weight = information * select(inside, L(1.0), pull);

      // m = w B^T B and v = w B^T r for the derivative B by the point; J = [B, -B hat(q)].
      L m[3][3], v[3];
      for (int i = 0; i != 3; ++i) {
        const L w0 = weight * by_q[0][i], w1 = weight * by_q[1][i], w2 = weight * by_q[2][i];
        for (int k = 0; k <= i; ++k) m[i][k] = m[k][i] = w0 * by_q[0][k] + w1 * by_q[1][k] + w2 * by_q[2][k];
        v[i] = w0 * r[0] + w1 * r[1] + w2 * r[2];
      }
      L terms[21], slope[6];
      std::size_t next = 0;
      for (int i = 0; i != 3; ++i)
        for (int k = 0; k <= i; ++k) terms[next++] = m[i][k];
      L corner[3][3];  // hat(q) m
      for (int k = 0; k != 3; ++k)
        for (int i = 0; i != 3; ++i) corner[i][k] = across(q, m[k], i);
      for (int i = 0; i != 3; ++i) {
        for (int k = 0; k != 3; ++k) terms[next++] = corner[i][k];
        for (int k = 0; k <= i; ++k) terms[next++] = across(q, corner[i], k);
      }
      for (int i = 0; i != 3; ++i) slope[i] = v[i], slope[3 + i] = across(q, v, i);

      for (std::size_t i = 0; i != 21; ++i) {
        const L times_t = t * terms[i];
        h[0][i] += terms[i];
        h[1][i] += times_t;
        h[2][i] += t * times_t;
      }
      for (std::size_t i = 0; i != 6; ++i) {
        g[0][i] += slope[i];
        g[1][i] += t * slope[i];
      }
    }
    for (std::size_t k = 0; k != 3; ++k)
      for (std::size_t i = 0; i != 21; ++i) out.h[k][i] = sum(h[k][i]);
    for (std::size_t k = 0; k != 2; ++k)
      for (std::size_t i = 0; i != 6; ++i) out.g[k][i] = sum(g[k][i]);
    out.cost = 0.5 * sum(total);
  }

 private:
  /// Entry `i` of the cross product of two vectors.
  template <class L>
  static ORBIS_ALWAYS_INLINE L across(const L* a, const L* b, int i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    return a[j] * b[k] - a[k] * b[j];
  }
};

/// Sums the normal equations over the observations at a pose and a twist (per second, translation first). If
/// `with_depth` is false, only the pixels are used. Points without a projection are ignored. O(observations).
template <camera::camera_model Camera>
[[nodiscard]] row_sums sum_rows(const row_lanes& observations, const optimize::reprojection<Camera>& model,
                                const se3& T_camera_world, const vec6& twist, bool with_depth = true) {
  const row_state at{T_camera_world.rotation_matrix(), T_camera_world.translation(), twist, with_depth};
  row_sums sums;
  camera::with_model(model.camera, [&](const auto& camera) {
    using kernel = row_kernel<std::remove_cvref_t<decltype(camera)>>;
    simd::kernel<kernel, typename kernel::signature>()(observations.blocks(), observations.block_count(),
                                                       {camera, model.bf}, at, sums);
  });
  return sums;
}

}  // namespace orbis::slam::detail

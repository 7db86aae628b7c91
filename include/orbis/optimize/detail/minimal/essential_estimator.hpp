// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The RANSAC estimator of essential matrices.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/LU>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/descent.hpp>
#include <orbis/optimize/detail/minimal/epipolar_motion.hpp>
#include <orbis/optimize/detail/minimal/five_point.hpp>
#include <orbis/optimize/detail/minimal/horn.hpp>
#include <orbis/optimize/detail/minimal/image_matches.hpp>
#include <orbis/optimize/detail/unroll.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize::detail {

/// Returns the four poses `T_second_first` (translations of length 1) that an essential matrix may represent.
[[nodiscard]] inline std::array<se3, 4> decompose_essential(const mat3& essential) {
  auto [u, values, v] = svd<3>(essential);
  if (determinant(u) < 0.0) set_column(u, 2, -column_of(u, 2));
  if (determinant(v) < 0.0) set_column(v, 2, -column_of(v, 2));
  mat3 quarter;
  quarter << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const so3 one(u * quarter * transposed(v)), other(u * transposed(quarter) * transposed(v));
  const vec3 t = column_of(u, 2);
  return {se3(one, t), se3(one, -t), se3(other, t), se3(other, -t)};
}

template <class = void>
class basic_essential_estimator {
 public:
  using model = mat3;
  static constexpr std::size_t sample_size = 5;
  static constexpr double model_cost = 2000.0;  ///< see `ransac_options`

  explicit basic_essential_estimator(const std::vector<image_match>& matches) : matches_{matches} {
    stride_ = (matches.size() + consensus_block - 1) / consensus_block * consensus_block;
    columns_.assign(10 * stride_, 0.0F);
    for (std::size_t i = 0; i != matches.size(); ++i) {
      const image_match& m = matches[i];
      const pixel_gradient a(m.first), b(m.second);
      const std::array values{m.first.x, m.first.y, m.second.x, m.second.y, a.xx, a.yx, a.yy, b.xx, b.yx, b.yy};
      for (std::size_t k = 0; k != values.size(); ++k) columns_[k * stride_ + i] = static_cast<float>(values[k]);
    }
  }

  [[nodiscard]] std::size_t size() const noexcept { return matches_.size(); }
  [[nodiscard]] five_point_solutions fit(const std::array<std::uint32_t, 5>& sample) const {
    std::array<vec3, 5> first, second;
    for (std::size_t i = 0; i != 5; ++i) {
      first[i] = matches_[sample[i]].first.direction();
      second[i] = matches_[sample[i]].second.direction();
    }
    return five_point(first, second);
  }

  [[nodiscard]] double squared_error(const mat3& e, std::size_t i) const { return squared_sampson(e, matches_[i]); }

  void squared_errors(const mat3& e, std::size_t first, std::span<float, consensus_block> out) const {
    using V = simd::vec<float, 4, simd::portable>;
    V m[9];
    unroll<9>([&](auto k) ORBIS_INLINE_LAMBDA { m[k] = static_cast<float>(e(k / 3, k % 3)); });
    for (std::size_t i = 0; i != consensus_block; i += V::count) {
      V v[10];
      unroll<10>([&](auto k) ORBIS_INLINE_LAMBDA { v[k] = V::load(columns_.data() + first + i + k * stride_); });
      V line[3], other[2];
      unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA { line[k] = (m[3 * k + 2] + m[3 * k] * v[0]) + m[3 * k + 1] * v[1]; });
      unroll<2>([&](auto k) ORBIS_INLINE_LAMBDA { other[k] = (m[6 + k] + m[k] * v[2]) + m[3 + k] * v[3]; });
      const V c = (line[2] + line[0] * v[2]) + line[1] * v[3];
      V sum = 0.0F;
      const auto add_gradient = [&](const V& gx, const V& gy, const V& xx, const V& yx, const V& yy)
                                    ORBIS_INLINE_LAMBDA {
                                      const V by_x = xx * gx, by_y = yx * gx + yy * gy;
                                      sum += by_x * by_x;
                                      sum += by_y * by_y;
                                    };
      add_gradient(other[0], other[1], v[4], v[5], v[6]);
      add_gradient(line[0], line[1], v[7], v[8], v[9]);
      (c * c / sum).store(out.data() + i);
    }
  }

  /// Refines an essential matrix by Gauss-Newton on the rotation and the direction of the translation.
  [[nodiscard]] std::optional<mat3> refine(const mat3& start, std::span<const std::uint32_t> inliers) const {
    return refine(start, inliers, 4);
  }
  [[nodiscard]] std::optional<mat3> refine(const mat3& start, std::span<const std::uint32_t> inliers, int steps) const {
    if (inliers.size() < 6) return std::nullopt;
    const se3 pose = decompose_essential(start)[0];
    const auto step = [](const epipolar_motion& m, const epipolar_equations& at) -> std::optional<epipolar_motion> {
      auto [a, g] = at.by_motion(m);
      change_diagonal(a, 1.0 + 1e-9, 0.0);
      change_diagonal(a, 1.0, 1e-12 * max_entry(diagonal(a)));
      small_cholesky<5> factors;
      if (!factors.set(a) || !(factors.factor(0.0) > 0.0)) return std::nullopt;
      const matrix<5> d = -factors.solve(g);
      if (!(norm(d) < 1.0)) return std::nullopt;
      return m.moved(d);
    };
    const auto found = descend(
        epipolar_motion(pose.rotation(), pose.translation()), steps,
        [&](const epipolar_motion& m) { return sum_up(m.e, inliers); }, step);
    if (!found) return std::nullopt;
    return found->e;
  }

 private:
  [[nodiscard]] epipolar_equations sum_up(const mat3& e, std::span<const std::uint32_t> inliers) const {
    epipolar_equations sum;
    for (const std::uint32_t i : inliers) sum.add(e, matches_[i]);
    sum.mirror();
    return sum;
  }

  const std::vector<image_match>& matches_;
  std::vector<float> columns_;
  std::size_t stride_ = 0;
};
using essential_estimator = basic_essential_estimator<>;

/// Returns the number of inliers that a pure rotation of the camera explains. The rotation is estimated with weights
/// that decrease with the error, because the inliers include wrong matches that are close to their epipolar lines by
/// chance.
[[nodiscard]] inline std::size_t count_rotation_inliers(const std::vector<image_match>& matches,
                                                        std::span<const std::uint32_t> inliers,
                                                        double squared_threshold) {
  mat3 rotation = identity<mat3>();
  std::size_t explained = 0;
  for (int round = 0; round != 10; ++round) {
    mat3 products = zeros<mat3>();
    explained = 0;
    for (const std::uint32_t i : inliers) {
      const metric_ray& to = matches[i].second;
      const vec3 from = matches[i].first.direction(), p = rotation * from;
      const double dx = p.x() / p.z() - to.x, dy = p.y() / p.z() - to.y;
      const double u = to.xx * dx + to.xy * dy, v = to.yy * dy;
      const double squared = p.z() > 0.0 ? u * u + v * v : std::numeric_limits<double>::infinity();
      explained += squared < 2.0 * squared_threshold ? 1U : 0U;
      const double weight = round == 0 ? 1.0 : 1.0 / (1.0 + squared / squared_threshold);
      products += weight * normalized(from) * transposed(normalized(to.direction()));
    }
    const auto turn = find_best_rotation(products, 1e-10);
    if (!turn) break;
    rotation = so3(turn->quaternion).rotation_matrix();
  }
  return explained;
}

}  // namespace orbis::optimize::detail

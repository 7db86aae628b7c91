// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The estimator of RANSAC for transforms between two lists of points.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/horn.hpp>
#include <orbis/optimize/detail/unroll.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize::detail {

/// Pairs of points about their centres, in random order.
template <class Transform>
class alignment_estimator {
 public:
  struct model {
    Transform transform;           ///< between the centred points
    std::array<float, 12> rows{};  ///< the same, by rows
  };
  static constexpr std::size_t sample_size = 3;
  static constexpr bool with_scale = std::same_as<Transform, sim3>;

  struct pair {
    vec3 from, to;
    double weight;  ///< 1 / deviation^2
    std::uint32_t original;
  };

  explicit alignment_estimator(std::vector<pair> pairs) : pairs_{std::move(pairs)} {
    stride_ = (pairs_.size() + consensus_block - 1) / consensus_block * consensus_block;
    columns_.assign(7 * stride_, 0.0F);
    for (std::size_t i = 0; i != pairs_.size(); ++i) {
      for (std::size_t k = 0; k != 3; ++k) {
        columns_[k * stride_ + i] = static_cast<float>(pairs_[i].from[static_cast<Eigen::Index>(k)]);
        columns_[(3 + k) * stride_ + i] = static_cast<float>(pairs_[i].to[static_cast<Eigen::Index>(k)]);
      }
      columns_[6 * stride_ + i] = static_cast<float>(pairs_[i].weight);
    }
  }

  [[nodiscard]] std::size_t size() const noexcept { return pairs_.size(); }
  [[nodiscard]] const pair& operator[](std::size_t i) const noexcept { return pairs_[i]; }

  [[nodiscard]] std::optional<model> fit_to(std::span<const std::uint32_t> indices) const {
    const auto found = align_pairs(
        indices.size(),
        [&](std::size_t i, double* a, double* b) {
          const pair& p = pairs_[indices[i]];
          std::copy_n(p.from.data(), 3, a);
          std::copy_n(p.to.data(), 3, b);
          return p.weight;
        },
        with_scale);
    if (!found || !(found->scale() > 0.0)) return std::nullopt;
    if constexpr (with_scale)
      return made_of(*found);
    else
      return made_of(se3(found->rotation(), found->translation()));
  }
  struct candidates {
    std::optional<model> found;
    [[nodiscard]] const model* begin() const noexcept { return found ? &*found : nullptr; }
    [[nodiscard]] const model* end() const noexcept { return found ? &*found + 1 : nullptr; }
  };
  [[nodiscard]] candidates fit(const std::array<std::uint32_t, 3>& sample) const { return {fit_to(sample)}; }
  [[nodiscard]] std::optional<model> refine(const model&, std::span<const std::uint32_t> inliers) const {
    return fit_to(inliers);
  }

  [[nodiscard]] double squared_error(const model& m, std::size_t i) const {
    return pairs_[i].weight * squared_norm(m.transform * pairs_[i].from - pairs_[i].to);
  }
  void squared_errors(const model& m, std::size_t first, std::span<float, consensus_block> out) const {
    using V = simd::vec<float, 4, simd::portable>;
    for (std::size_t i = 0; i != consensus_block; i += V::count) {
      const auto at = [&](std::size_t k) { return V::load(columns_.data() + first + i + k * stride_); };
      const V x = at(0), y = at(1), z = at(2);
      V sum = 0.0F;
      unroll<3>([&](auto k) ORBIS_INLINE_LAMBDA {
        const float* const row = m.rows.data() + 4 * k;
        const V d = (((row[3] + row[0] * x) + row[1] * y) + row[2] * z) - at(3 + k);
        sum += d * d;
      });
      (sum * at(6)).store(out.data() + i);
    }
  }

 private:
  [[nodiscard]] static model made_of(const Transform& t) {
    const auto matrix = t.to_matrix();
    model m{t, {}};
    for (int row = 0; row != 3; ++row)
      for (int column = 0; column != 4; ++column)
        m.rows[static_cast<std::size_t>(4 * row + column)] = static_cast<float>(matrix(row, column));
    return m;
  }

  std::vector<pair> pairs_;
  std::vector<float> columns_;  ///< from, to, weight
  std::size_t stride_ = 0;
};

}  // namespace orbis::optimize::detail

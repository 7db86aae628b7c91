// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of alignment.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <orbis/core/inline.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/optimize/alignment.hpp>
#include <orbis/optimize/detail/minimal/horn.hpp>
#include <orbis/optimize/detail/unroll.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize {
namespace detail {

/// Pairs of points relative to their centres, in random order.
template <class Transform>
class alignment_estimator {
 public:
  struct model {
    Transform transform;           ///< transform between the centred points
    std::array<float, 12> rows{};  ///< the transform as a 3x4 matrix, row by row
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
      return make_model(*found);
    else
      return make_model(se3(found->rotation(), found->translation()));
  }
  [[nodiscard]] one_or_none<model> fit(const std::array<std::uint32_t, 3>& sample) const { return {fit_to(sample)}; }
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
  [[nodiscard]] static model make_model(const Transform& t) {
    const auto matrix = t.to_matrix();
    model m{t, {}};
    for (int row = 0; row != 3; ++row)
      for (int column = 0; column != 4; ++column)
        m.rows[static_cast<std::size_t>(4 * row + column)] = static_cast<float>(matrix(row, column));
    return m;
  }

  std::vector<pair> pairs_;
  std::vector<float> columns_;  ///< coordinates of `from` and `to`, and the weights
  std::size_t stride_ = 0;
};

}  // namespace detail

namespace detail {

inline constexpr const char* absolute_orientation_name = "absolute orientation";

ORBIS_LAZY_INLINE result<void> check_pairs(std::size_t from, std::size_t to, std::span<const double> weights) {
  constexpr const char* where = absolute_orientation_name;
  if (from != to) return fail(errc::invalid_argument, where, "the two lists of points differ in length");
  if (!weights.empty() && weights.size() != from)
    return fail(errc::invalid_argument, where, "the number of weights differs from the number of pairs");
  for (std::size_t i = 0; i != weights.size(); ++i)
    if (!(weights[i] >= 0.0 && std::isfinite(weights[i])))
      return fail(errc::invalid_argument, where,
                  "the weight of pair " + std::to_string(i) + " is negative or not finite");
  if (from < 3) return fail(errc::no_data, where, "fewer than three pairs of points");
  return {};
}

ORBIS_LAZY_INLINE std::optional<sim3> align_by_moments(const pair_moments& moments, std::size_t n, bool with_scale) {
  return transform_between(moments, n, with_scale);
}

ORBIS_LAZY_INLINE error alignment_error(std::size_t not_finite, std::size_t n) {
  if (not_finite != n)
    return {errc::degenerate, absolute_orientation_name,
            "a coordinate of pair " + std::to_string(not_finite) + " is not finite"};
  return {errc::degenerate, absolute_orientation_name,
          "the points do not determine a rotation: they are collinear or coincident"};
}

template <class Transform>
result<alignment_estimate<Transform>> align_vectors(std::span<const vec3> from, std::span<const vec3> to,
                                                    const alignment_options& options) {
  constexpr const char* where = "alignment";
  using estimator_type = detail::alignment_estimator<Transform>;
  const std::size_t n = from.size();
  if (n != to.size()) return fail(errc::invalid_argument, where, "the two lists of points differ in length");
  if (!options.deviations.empty() && options.deviations.size() != n)
    return fail(errc::invalid_argument, where, "the number of deviations differs from the number of pairs");
  const ransac_options asked = detail::ransac_part(options);
  if (const char* const fault = detail::find_fault(asked)) return fail(errc::invalid_argument, where, fault);
  if (n < 3) return fail(errc::no_data, where, "fewer than three pairs of points");
  const auto weight_of = [&](std::size_t i) {
    return options.deviations.empty() ? 1.0 : 1.0 / (options.deviations[i] * options.deviations[i]);
  };
  std::vector<typename estimator_type::pair> pairs;
  pairs.reserve(n);
  vec3 from_centre = zeros<vec3>(), to_centre = zeros<vec3>();
  for (std::size_t i = 0; i != n; ++i) {
    const typename estimator_type::pair p{from[i], to[i], weight_of(i), static_cast<std::uint32_t>(i)};
    if (!all_finite(p.from) || !all_finite(p.to) || !(p.weight > 0.0) || !std::isfinite(p.weight)) continue;
    pairs.push_back(p);
    from_centre += p.from;
    to_centre += p.to;
  }
  if (pairs.size() < 3)
    return fail(
        errc::degenerate, where,
        "only " + std::to_string(pairs.size()) + " of " + std::to_string(n) + " pairs are finite; three are needed");
  from_centre /= static_cast<double>(pairs.size());
  to_centre /= static_cast<double>(pairs.size());
  mat3 spread = zeros<mat3>(), spread_to = zeros<mat3>();
  for (auto& p : pairs) {
    p.from -= from_centre;
    p.to -= to_centre;
    spread += p.from * transposed(p.from);
    spread_to += p.to * transposed(p.to);
  }
  random_bits random(mix64(options.seed));
  shuffle(pairs, random);

  const estimator_type estimator(std::move(pairs));
  auto found = ransac(estimator, asked);
  if (!found) {
    if (found.error().code == errc::degenerate)
      for (const mat3& s : {spread, spread_to}) {
        const vec3 sizes = eigen_of_symmetric<3>(s).values;
        if (!(sizes[1] > 1e-12 * sizes[2]))
          return fail(errc::degenerate, where, "all points are collinear or coincident");
      }
    return fail(found.error());
  }
  // Undo the centring.
  const auto& centred = found->model.transform;
  Transform transform;
  if constexpr (estimator_type::with_scale)
    transform =
        sim3(centred.rotation(),
             to_centre + centred.translation() - centred.scale() * (centred.rotation() * from_centre), centred.scale());
  else
    transform = se3(centred.rotation(), to_centre + centred.translation() - centred.rotation() * from_centre);
  alignment_estimate<Transform> out{transform, {}, 0.0, found->iterations};
  out.inliers.reserve(found->inliers.size());
  double sum = 0.0;
  for (std::size_t i = 0; i != n; ++i) {
    const double weight = weight_of(i), e = weight * squared_norm(transform * from[i] - to[i]);
    if (!(weight > 0.0) || !(e < options.threshold * options.threshold)) continue;
    out.inliers.push_back(static_cast<std::uint32_t>(i));
    sum += e;
  }
  if (auto enough = detail::enough_inliers(where, out.inliers.size(), n, options.min_inliers, 3); !enough)
    return fail(std::move(enough.error()));
  out.rmse = std::sqrt(sum / static_cast<double>(out.inliers.size()));
  return out;
}

}  // namespace detail

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The rigid or similarity transform between two lists of points, many pairs of which may be wrong: two views of the
/// same landmarks at a loop, say.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <ranges>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/optimize/absolute_orientation.hpp>
#include <orbis/optimize/detail/sparse/wide.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize {

struct alignment_options {
  /// Largest distance of an inlier between where it is and where the transform takes its partner: metres, or in units
  /// of `deviations` where those are given.
  double threshold = 0.05;
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 6;  ///< fewer than this is a failure
  std::uint64_t seed = 1;
  /// Of the distance of each pair, metres: that of a depth camera grows with the square of the depth. Weighs the pairs
  /// as well. Empty: all pairs alike.
  std::span<const double> deviations = {};
};

template <class Transform>
struct alignment_estimate {
  Transform T_to_from;
  std::vector<std::uint32_t> inliers;  ///< exactly the pairs within the threshold, ascending
  double rmse = 0.0;                   ///< of the inliers, in the threshold's units
  std::size_t iterations = 0;
};

namespace detail {

/// Pairs of points as `ransac` wants them, about their centres and in random order.
template <class Transform>
class alignment_estimator {
 public:
  struct model {
    Transform transform;           ///< between the centred points
    std::array<float, 12> rows{};  ///< the same
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
    return pairs_[i].weight * (m.transform * pairs_[i].from - pairs_[i].to).squaredNorm();
  }
  void squared_errors(const model& m, std::size_t first, std::span<float, consensus_block> out) const {
    using namespace wide;
    using V = numbers<float, 4>;
    for (std::size_t i = 0; i != consensus_block; i += 4) {
      const float* const at = columns_.data() + first + i;
      V from[3], sum{}, weight;
      unrolled<3>([&](auto k) { load(from[k], at + k * stride_); });
      unrolled<3>([&](auto k) {
        V d, r;
        fill(d, m.rows[4 * k + 3]);
        unrolled<3>([&](auto j) {
          fill(r, m.rows[4 * k + j]);
          add_product(d, r, from[j]);
        });
        load(r, at + (3 + k) * stride_);
        d -= r;
        add_product(sum, d, d);
      });
      load(weight, at + 6 * stride_);
      multiply(sum, sum, weight);
      store(out.data() + i, sum);
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

}  // namespace detail

/// The `Transform` (`se3` or `sim3`) with the most pairs `Transform * from[i]` near `to[i]`. Pairs that are not finite,
/// and those whose deviation is 0 or not finite, are outliers. Deterministic by `options.seed`.
/// Errors: `invalid_argument` for lists of different length or options out of range, `no_data` below three pairs,
/// `degenerate` where all points lie on a line or in one place, or no transform has `min_inliers` inliers; the message
/// says which.
template <class Transform = se3, point_range From, point_range To>
requires(std::same_as<Transform, se3> || std::same_as<Transform, sim3>)
    [[nodiscard]] result<alignment_estimate<Transform>> estimate_alignment(const From& from, const To& to,
                                                                           const alignment_options& options = {}) {
  constexpr const char* where = "alignment";
  using estimator_type = detail::alignment_estimator<Transform>;
  const auto n = static_cast<std::size_t>(std::ranges::size(from));
  if (n != static_cast<std::size_t>(std::ranges::size(to)))
    return fail(errc::invalid_argument, where, "the two lists of points differ in length");
  if (!options.deviations.empty() && options.deviations.size() != n)
    return fail(errc::invalid_argument, where, "there are not as many deviations as pairs");
  const ransac_options asked = detail::ransac_part(options);
  if (const char* const fault = detail::fault_of(asked)) return fail(errc::invalid_argument, where, fault);
  if (n < 3) return fail(errc::no_data, where, "fewer than three pairs of points");
  const auto read = [](const auto& points, std::size_t i) {
    using range = std::remove_cvref_t<decltype(points)>;
    const auto c =
        coordinates<double>(std::ranges::begin(points)[static_cast<std::ranges::range_difference_t<range>>(i)]);
    return vec3(c[0], c[1], c[2]);
  };
  const auto weight_of = [&](std::size_t i) {
    return options.deviations.empty() ? 1.0 : 1.0 / (options.deviations[i] * options.deviations[i]);
  };
  std::vector<typename estimator_type::pair> pairs;
  pairs.reserve(n);
  vec3 from_centre = vec3::Zero(), to_centre = vec3::Zero();
  for (std::size_t i = 0; i != n; ++i) {
    const typename estimator_type::pair p{read(from, i), read(to, i), weight_of(i), static_cast<std::uint32_t>(i)};
    if (!p.from.allFinite() || !p.to.allFinite() || !(p.weight > 0.0) || !std::isfinite(p.weight)) continue;
    pairs.push_back(p);
    from_centre += p.from;
    to_centre += p.to;
  }
  if (pairs.size() < 3)
    return fail(errc::degenerate, where,
                "of " + std::to_string(n) + " pairs " + std::to_string(pairs.size()) + " are finite, three are needed");
  from_centre /= static_cast<double>(pairs.size());
  to_centre /= static_cast<double>(pairs.size());
  mat3 spread = mat3::Zero(), spread_to = mat3::Zero();
  for (auto& p : pairs) {
    p.from -= from_centre;
    p.to -= to_centre;
    spread += p.from * p.from.transpose();
    spread_to += p.to * p.to.transpose();
  }
  random_bits random(mix64(options.seed));
  shuffle(pairs, random);

  const estimator_type estimator(std::move(pairs));
  auto found = ransac(estimator, asked, ransac_policies{msac{}, uniform_sampling{}, sprt{}, iterated_refinement{}});
  if (!found) {
    if (found.error().code == errc::degenerate)
      for (const mat3& s : {spread, spread_to}) {
        const vec3 sizes = eigen_of_symmetric<3>(s).values;
        if (!(sizes[1] > 1e-12 * sizes[2]))
          return fail(errc::degenerate, where, "the points all lie on one line or in one place");
      }
    return fail(found.error());
  }
  // Back from the centres.
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
    const double weight = weight_of(i), e = weight * (transform * read(from, i) - read(to, i)).squaredNorm();
    if (!(weight > 0.0) || !(e < options.threshold * options.threshold)) continue;
    out.inliers.push_back(static_cast<std::uint32_t>(i));
    sum += e;
  }
  if (auto enough = detail::enough_inliers(where, out.inliers.size(), n, options.min_inliers, 3); !enough)
    return fail(std::move(enough.error()));
  out.rmse = std::sqrt(sum / static_cast<double>(out.inliers.size()));
  return out;
}

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The homography between two images of a plane, or of anything from one place: from four matches, from many, from
/// many of which most may be wrong; and what it says about the cameras and the plane.
///
/// Sources: R. Hartley, A. Zisserman, "Multiple View Geometry in Computer Vision", 2003, chapter 4; Y. Ma, S. Soatto,
/// J. Kosecka, S. Sastry, "An Invitation to 3-D Vision", 2003, section 5.3, for the decomposition.
///
/// `S` is always double: the functions are templates so that only who calls them has them compiled.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/pose/descent.hpp>
#include <orbis/optimize/detail/sparse/small_cholesky.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize {

struct homography_options {
  double threshold = 3.0;  ///< largest error of an inlier, pixels: root mean square of the transfers both ways
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 8;  ///< fewer than this is a failure
  std::uint64_t seed = 1;
};

struct homography_estimate {
  mat3 H_second_first;                 ///< `second ~ H * (first, 1)`, with H(2, 2) = 1 unless that is 0
  std::vector<std::uint32_t> inliers;  ///< exactly the matches within the threshold, ascending
  double rmse = 0.0;                   ///< of the inliers, pixels
  std::size_t iterations = 0;
};

/// A way to read the homography of a plane: `H ~ rotation + translation * normal^T`, with `normal` the plane's unit
/// normal in the first camera (towards the plane: points on it have normal . p > 0), `translation` that of
/// `T_second_first` in units of the plane's distance from the first camera.
struct plane_motion {
  so3 R_second_first;
  vec3 translation = vec3::Zero();
  vec3 normal = vec3::UnitZ();
};

namespace detail {

/// The homography of four points each, by projective bases; false where three of them are on a line, or where points
/// would have to change sides.
template <std::same_as<double> S = double>
[[nodiscard]] bool homography_of_four(const std::array<vec2, 4>& first, const std::array<vec2, 4>& second,
                                      matrix<3, 3, S>& out) {
  using vec3 = matrix<3, 1, S>;
  using mat3 = matrix<3, 3, S>;
  mat3 bases[2];
  vec3 weights[2];
  for (int k = 0; k != 2; ++k) {
    const std::array<matrix<2, 1, S>, 4>& p = k == 0 ? first : second;
    const auto cross = [&](std::size_t a, std::size_t b, std::size_t c) {
      return (p[b].x() - p[a].x()) * (p[c].y() - p[a].y()) - (p[b].y() - p[a].y()) * (p[c].x() - p[a].x());
    };
    // The fourth point in terms of the other three, by the areas of triangles.
    weights[k] = vec3(cross(3, 1, 2), cross(0, 3, 2), cross(0, 1, 3));
    const double area = cross(0, 1, 2);
    const double extent = (p[1] - p[0]).squaredNorm() + (p[2] - p[0]).squaredNorm() + (p[3] - p[0]).squaredNorm();
    if (!(std::min(std::fabs(area), weights[k].cwiseAbs().minCoeff()) > 1e-6 * extent)) return false;
    weights[k] /= area;
    for (int i = 0; i != 3; ++i) bases[k].col(i) = weights[k][i] * p[static_cast<std::size_t>(i)].homogeneous();
  }
  const vec3 ratio = weights[1].cwiseQuotient(weights[0]);
  if (!(ratio.minCoeff() > 0.0)) return false;  // the plane would be seen from behind by some of the points
  out = bases[1] * bases[0].inverse();
  out /= out.norm();
  return out.allFinite();
}

template <std::same_as<double> S = double>
class homography_estimator {
  using vec2 = matrix<2, 1, S>;
  using vec3 = matrix<3, 1, S>;
  using mat3 = matrix<3, 3, S>;

 public:
  struct model {
    mat3 forward, backward;
  };
  static constexpr std::size_t sample_size = 4;

  struct match {
    vec2 first, second;
    std::uint32_t original;
  };

  explicit homography_estimator(const std::vector<match>& matches) : matches_{matches} {
    for (const match& m : matches) {
      const std::array values{m.first.x(), m.first.y(), m.second.x(), m.second.y()};
      for (std::size_t k = 0; k != 4; ++k) columns_[k].push_back(static_cast<float>(values[k]));
    }
    for (auto& column : columns_)
      column.resize((matches.size() + consensus_block - 1) / consensus_block * consensus_block);
  }

  [[nodiscard]] std::size_t size() const noexcept { return matches_.size(); }

  struct candidates {
    std::optional<model> found;
    [[nodiscard]] const model* begin() const noexcept { return found ? &*found : nullptr; }
    [[nodiscard]] const model* end() const noexcept { return found ? &*found + 1 : nullptr; }
  };
  [[nodiscard]] candidates fit(const std::array<std::uint32_t, 4>& s) const {
    mat3 h;
    if (!homography_of_four<S>(
            {matches_[s[0]].first, matches_[s[1]].first, matches_[s[2]].first, matches_[s[3]].first},
            {matches_[s[0]].second, matches_[s[1]].second, matches_[s[2]].second, matches_[s[3]].second}, h))
      return {};
    return {made_of(h)};
  }

  [[nodiscard]] double squared_error(const model& m, std::size_t i) const {
    const match& x = matches_[i];
    const vec3 p = m.forward * x.first.homogeneous(), q = m.backward * x.second.homogeneous();
    return 0.5 * ((p.template head<2>() / p.z() - x.second).squaredNorm() +
                  (q.template head<2>() / q.z() - x.first).squaredNorm());
  }

  void squared_errors(const model& m, std::size_t first, std::span<float, consensus_block> out) const {
    std::array<float, 9> f, b;
    for (int k = 0; k != 9; ++k) {
      f[static_cast<std::size_t>(k)] = static_cast<float>(m.forward(k / 3, k % 3));
      b[static_cast<std::size_t>(k)] = static_cast<float>(m.backward(k / 3, k % 3));
    }
    std::array<float, consensus_block> errors;
    const float* const x = columns_[0].data() + first;
    const float* const y = columns_[1].data() + first;
    const float* const u = columns_[2].data() + first;
    const float* const v = columns_[3].data() + first;
    for (std::size_t i = 0; i != consensus_block; ++i) {
      const float pz = 1.0F / (f[6] * x[i] + f[7] * y[i] + f[8]), qz = 1.0F / (b[6] * u[i] + b[7] * v[i] + b[8]);
      const float px = (f[0] * x[i] + f[1] * y[i] + f[2]) * pz - u[i];
      const float py = (f[3] * x[i] + f[4] * y[i] + f[5]) * pz - v[i];
      const float qx = (b[0] * u[i] + b[1] * v[i] + b[2]) * qz - x[i];
      const float qy = (b[3] * u[i] + b[4] * v[i] + b[5]) * qz - y[i];
      errors[i] = 0.5F * ((px * px + py * py) + (qx * qx + qy * qy));
    }
    std::copy(errors.begin(), errors.end(), out.begin());
  }

  /// Gauss-Newton on the transfers both ways.
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers) const {
    return refine(start, inliers, 4);
  }
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers,
                                            int steps) const {
    const auto step = [](const model& m, const equations& e) -> std::optional<model> {
      small_cholesky<8> factors;
      if (!factors.set(e.h) || !(factors.factor(1e-9) > 0.0)) return std::nullopt;
      const matrix<8, 1, S> entries = -factors.solve(e.g);
      if (!entries.allFinite()) return std::nullopt;
      mat3 d = mat3::Identity();
      for (int j = 0; j != 8; ++j) d(j / 3, j % 3) += entries[j];
      return made_of(d * m.forward);
    };
    return descend(
        start, steps, [&](const model& m) { return sum_up(m, inliers); }, step);
  }

 private:
  [[nodiscard]] static model made_of(const mat3& h) {
    model m{h / h.norm(), h.inverse()};
    m.backward /= m.backward.norm();
    return m;
  }

  /// For D in (I + D) H, its last entry held; of `h` the lower triangle. `cost`: the sum of squares of all transfers.
  struct equations {
    matrix<8, 8, S> h = matrix<8, 8, S>::Zero();
    matrix<8, 1, S> g = matrix<8, 1, S>::Zero();
    double cost = 0.0;
  };
  [[nodiscard]] equations sum_up(const model& m, std::span<const std::uint32_t> inliers) const {
    equations e;
    for (const std::uint32_t i : inliers) {
      const match& x = matches_[i];
      const auto add = [&](const vec3& p, const vec2& seen, const mat3& by_d, const vec3& moved) {
        // p moves by by_d * D * moved.
        const double inverse = 1.0 / p.z();
        const vec2 xy = p.template head<2>() * inverse;
        matrix<2, 3, S> projection;
        projection << inverse, 0.0, -xy.x() * inverse, 0.0, inverse, -xy.y() * inverse;
        const matrix<2, 3, S> a = projection * by_d;
        matrix<2, 8, S> j;
        for (int k = 0; k != 8; ++k) j.col(k) = a.col(k / 3) * moved[k % 3];
        const vec2 r = xy - seen;
        for (int k = 0; k != 8; ++k) {
          for (int l = k; l != 8; ++l) e.h(l, k) += j(0, l) * j(0, k) + j(1, l) * j(1, k);
          e.g[k] += j(0, k) * r[0] + j(1, k) * r[1];
        }
        e.cost += r.squaredNorm();
      };
      const vec3 p = m.forward * x.first.homogeneous();
      add(p, x.second, mat3::Identity(), p);
      add(m.backward * x.second.homogeneous(), x.first, -m.backward, x.second.homogeneous());
    }
    return e;
  }

  const std::vector<match>& matches_;
  std::array<std::vector<float>, 4> columns_;
};

}  // namespace detail

/// The homography that takes `first[i]` to `second[i]`; empty where three of either four are on one line, or where no
/// plane in front of a camera could do it.
template <std::same_as<double> S = double>
[[nodiscard]] std::optional<mat3> homography_of_four(const std::array<vec2, 4>& first,
                                                     const std::array<vec2, 4>& second) {
  matrix<3, 3, S> h;
  if (!detail::homography_of_four<S>(first, second, h)) return std::nullopt;
  if (h(2, 2) != 0.0) h /= S(h(2, 2));
  return h;
}

/// The homography that the most matches agree with: four points in RANSAC, each new best one refined on its inliers
/// (least squares of the transfers both ways). Matches that are not finite are outliers. Deterministic by
/// `options.seed`. For images with distortion give undistorted pixels.
/// Errors: `invalid_argument` for spans of different length or options out of range, `no_data` below four matches,
/// `degenerate` where fewer than four are finite, all points of an image lie on one line, or no homography has
/// `min_inliers` inliers; the message says which.
template <std::same_as<double> S = double>
[[nodiscard]] result<homography_estimate> estimate_homography(std::span<const vec2> first, std::span<const vec2> second,
                                                              const homography_options& options = {}) {
  using vec2 = matrix<2, 1, S>;
  using mat2 = matrix<2, 2, S>;
  using mat3 = matrix<3, 3, S>;
  constexpr const char* where = "homography";
  using estimator_type = detail::homography_estimator<S>;
  const std::size_t n = first.size();
  if (n != second.size()) return fail(errc::invalid_argument, where, "the lists of pixels differ in length");
  ransac_options asked = detail::ransac_part(options);
  if (const char* const fault = detail::fault_of(asked)) return fail(errc::invalid_argument, where, fault);
  if (n < 4) return fail(errc::no_data, where, "fewer than four matches");
  std::vector<typename estimator_type::match> matches;
  matches.reserve(n);
  vec2 first_centre = vec2::Zero(), second_centre = vec2::Zero();
  for (std::size_t i = 0; i != n; ++i) {
    if (!first[i].allFinite() || !second[i].allFinite()) continue;
    matches.push_back({first[i], second[i], static_cast<std::uint32_t>(i)});
    first_centre += first[i];
    second_centre += second[i];
  }
  if (matches.size() < 4)
    return fail(
        errc::degenerate, where,
        "of " + std::to_string(n) + " matches " + std::to_string(matches.size()) + " are finite, four are needed");
  first_centre /= static_cast<double>(matches.size());
  second_centre /= static_cast<double>(matches.size());
  // In pixels about the centres and in units of about the size of the images, so that all entries of H are of one
  // order.
  double size = 0.0;
  mat2 first_spread = mat2::Zero(), second_spread = mat2::Zero();
  for (auto& m : matches) {
    m.first -= first_centre;
    m.second -= second_centre;
    first_spread += m.first * m.first.transpose();
    second_spread += m.second * m.second.transpose();
  }
  size = std::sqrt((first_spread.trace() + second_spread.trace()) / static_cast<double>(2 * matches.size()));
  const double threshold = options.threshold / size;
  if (!(size > 0.0) || !std::isfinite(threshold))
    return fail(errc::degenerate, where, "the points all lie on one line or in one place");
  for (auto& m : matches) {
    m.first /= size;
    m.second /= size;
  }
  random_bits random(mix64(options.seed));
  shuffle(matches, random);

  const estimator_type estimator(matches);
  asked.threshold = threshold;
  auto found = ransac(estimator, asked, ransac_policies{msac{}, uniform_sampling{}, sprt{}, iterated_refinement{}});
  if (!found) {
    const auto is_line = [](const mat2& spread) {
      return !(spread.determinant() > 1e-12 * spread.trace() * spread.trace());
    };
    if (found.error().code == errc::degenerate && (is_line(first_spread) || is_line(second_spread)))
      return fail(errc::degenerate, where, "the points all lie on one line or in one place");
    return fail(found.error().code, where, found.error().message);
  }
  const typename estimator_type::model model =
      detail::polished(estimator, *found, threshold * threshold, options.min_inliers);
  homography_estimate out;
  out.iterations = found->iterations;
  double sum = 0.0;
  for (std::size_t i = 0; i != matches.size(); ++i) {
    const double e = estimator.squared_error(model, i);
    if (!(e < threshold * threshold)) continue;
    sum += e;
    out.inliers.push_back(matches[i].original);
  }
  std::sort(out.inliers.begin(), out.inliers.end());
  if (auto enough = detail::enough_inliers(where, out.inliers.size(), n, options.min_inliers, 4); !enough)
    return fail(std::move(enough.error()));
  out.rmse = size * std::sqrt(sum / static_cast<double>(out.inliers.size()));
  // Back from the centres.
  mat3 to_centre = mat3::Identity(), from_centre = mat3::Identity();
  for (int i = 0; i != 2; ++i) {
    to_centre(i, i) = 1.0 / size;
    to_centre(i, 2) = -first_centre[i] / size;
    from_centre(i, i) = size;
    from_centre(i, 2) = second_centre[i];
  }
  const mat3 whole = from_centre * model.forward * to_centre;
  out.H_second_first = whole / (whole(2, 2) != 0.0 ? whole(2, 2) : whole.norm());
  return out;
}

/// The motions that a homography between rays at z = 1 may stand for, of any scale and sign: two, or one without
/// translation. (Two more would have the plane behind the first camera.) `ray`, one of the first camera that was
/// matched, tells front from behind.
/// Errors: degenerate where H is singular or not finite.
template <std::same_as<double> S = double>
[[nodiscard]] result<std::vector<plane_motion>> decompose_homography(const mat3& homography,
                                                                     const vec3& ray = vec3::UnitZ()) {
  using vec3 = matrix<3, 1, S>;
  using mat3 = matrix<3, 3, S>;
  constexpr const char* where = "homography";
  mat3 h = homography;
  if (!h.allFinite()) return fail(errc::degenerate, where, "is not finite");
  const auto [squares, vectors] = eigen_of_symmetric<3>(mat3(h.transpose() * h));
  const double middle = std::sqrt(std::fmax(0.0, squares[1]));
  if (!(squares[0] > 1e-20 * squares[2])) return fail(errc::degenerate, where, "is singular");
  // R + t n^T has the middle singular value 1, and a positive determinant where camera and plane are on proper sides.
  h /= middle;
  if (h.determinant() < 0.0) h = -h;
  const double s1 = squares[2] / (middle * middle), s3 = squares[0] / (middle * middle);
  std::vector<plane_motion> motions;
  if (!(s1 - s3 > 1e-12)) {
    motions.push_back({so3(h), vec3::Zero(), vec3(ray).normalized()});
    return motions;
  }
  mat3 v;
  for (int k = 0; k != 3; ++k) v.col(k) = vectors.col(2 - k);
  if (v.determinant() < 0.0) v = -v;
  const double a = std::sqrt(std::fmax(0.0, 1.0 - s3) / (s1 - s3)), b = std::sqrt(std::fmax(0.0, s1 - 1.0) / (s1 - s3));
  for (const double sign : {1.0, -1.0}) {
    const vec3 u = a * v.col(0) + sign * b * v.col(2);
    mat3 before, after;
    before << v.col(1), u, v.col(1).cross(u);
    const vec3 hv = h * v.col(1), hu = h * u;
    after << hv, hu, hv.cross(hu);
    const so3 rotation(mat3(after * before.transpose()));
    vec3 normal = before.col(2);
    vec3 translation = (h - rotation.rotation_matrix()) * normal;
    if (normal.dot(ray) < 0.0) {
      normal = -normal;
      translation = -translation;
    }
    motions.push_back({rotation, translation, normal});
  }
  return motions;
}

}  // namespace orbis::optimize

// SPDX-License-Identifier: BSD-3-Clause
#include "settings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <span>

#include <orbis/cloud/detail/select/log_density.hpp>
#include <orbis/cloud/ray_evidence.hpp>

namespace orbis::bench {

namespace {

constexpr std::size_t table_width = 100;

std::string format(const char* pattern, double a, double b) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, a, b);
  return text;
}

removal beyond_mean(const std::vector<double>& score, double alpha) {
  const auto n = static_cast<double>(score.size());
  const double mean = std::accumulate(score.begin(), score.end(), 0.0) / n;
  double squares = 0;
  for (const double s : score) squares += (s - mean) * (s - mean);
  const double limit = mean + alpha * std::sqrt(squares / (n - 1));
  removal out(score.size());
  for (std::size_t i = 0; i != score.size(); ++i) out[i] = score[i] > limit;
  return out;
}

/// Above the median by `times` the deviation that the median distance to it suggests.
removal beyond_median(const std::vector<double>& score, double times) {
  std::vector<double> v = score;
  const double median = cloud::detail::quantile(v, 0.5);
  for (double& x : v) x = std::abs(x - median);
  const double limit = median + times * 1.4826 * cloud::detail::quantile(v, 0.5);
  removal out(score.size());
  for (std::size_t i = 0; i != score.size(); ++i) out[i] = score[i] > limit;
  return out;
}

std::vector<double> logarithm(std::vector<double> v) {
  for (double& x : v) x = std::log(x + 1e-9);
  return v;
}

/// The score as at 1 m, where spacing grows with a power of the range.
std::vector<double> at_one_metre(std::vector<double> score, const labelled_case& c, double power) {
  for (std::size_t i = 0; i != c.ranges.size(); ++i) score[i] /= std::pow(std::max(0.1F, c.ranges[i]), power);
  return score;
}

removal lonely(const neighborhoods& n, double times, std::size_t enough, bool by_range) {
  const auto& ranges = n.of->ranges;
  std::vector<double> sorted(ranges.begin(), ranges.end());
  const double middle = ranges.empty() ? 1 : cloud::detail::quantile(sorted, 0.5);
  removal out(n.of->points.size());
  for (std::size_t i = 0; i != out.size(); ++i) {
    const double scale = by_range && !ranges.empty() ? ranges[i] / middle : 1;
    const auto row = n.table[i];
    out[i] = row.size() < enough || row[enough - 1].distance > times * scale * n.spacing;
  }
  return out;
}

/// Points whose connected component, at a reach in units of the median spacing, is small.
removal small_components(const neighborhoods& n, double reach, std::size_t smallest) {
  std::vector<std::uint32_t> parent(n.of->points.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::uint32_t i = 0; i != parent.size(); ++i) {
    for (const auto& neighbor : n.table[i].first(std::min<std::size_t>(12, n.table.width))) {
      if (neighbor.distance <= reach * n.spacing) parent[root(i)] = root(neighbor.index);
    }
  }
  std::vector<std::size_t> size(parent.size());
  for (std::uint32_t i = 0; i != parent.size(); ++i) ++size[root(i)];
  removal out(parent.size());
  for (std::uint32_t i = 0; i != parent.size(); ++i) out[i] = size[root(i)] < smallest;
  return out;
}

removal either(removal a, const removal& b) {
  for (std::size_t i = 0; i != b.size(); ++i) a[i] = a[i] != 0 || b[i] != 0;
  return a;
}

removal rays(const neighborhoods& n) {
  return n.passed_through.empty() ? removal(n.of->points.size()) : n.passed_through;
}

}  // namespace

neighborhoods::neighborhoods(const labelled_case& c) : of{&c}, table{cloud::all_knn(par, c.points, table_width)} {
  std::vector<double> sixth;
  for (std::size_t i = 0; i != c.points.size(); ++i) sixth.push_back(table[i][5].distance);
  spacing = cloud::detail::quantile(sixth, 0.5);
  if (c.views.empty()) return;
  passed_through.assign(c.points.size(), 1);
  for (const std::uint32_t i : cloud::ray_evidence_inliers(par, c.points, c.views, c.camera)) passed_through[i] = 0;
}

std::vector<double> neighborhoods::mean_distance(std::size_t k) const {
  std::vector<double> out(of->points.size());
  for (std::size_t i = 0; i != out.size(); ++i) {
    double sum = 0;
    for (const auto& neighbor : table[i].first(k)) sum += static_cast<double>(neighbor.distance);
    out[i] = sum / static_cast<double>(k);
  }
  return out;
}

std::vector<setting> fixed_settings() {
  using N = const neighborhoods&;
  std::vector<setting> out;
  out.push_back({"none", [](N n) { return removal(n.of->points.size()); }});
  for (const std::size_t k : {8U, 20U, 30U, 50U, 100U}) {
    for (const double alpha : {0.5, 1.0, 2.0, 3.0}) {
      out.push_back({format("SOR(%g,%g)", static_cast<double>(k), alpha),
                     [=](N n) { return beyond_mean(n.mean_distance(k), alpha); }});
    }
  }
  for (const std::size_t k : {8U, 30U}) {
    for (const double alpha : {2.0, 3.0, 4.0, 6.0}) {
      out.push_back({format("log-SOR(%g,%g)", static_cast<double>(k), alpha),
                     [=](N n) { return beyond_median(logarithm(n.mean_distance(k)), alpha); }});
    }
  }
  for (const double power : {1.0, 2.0}) {
    for (const double alpha : {1.0, 2.0, 3.0}) {
      out.push_back({format("range-SOR(z^%g,%g)", power, alpha),
                     [=](N n) { return beyond_mean(at_one_metre(n.mean_distance(30), *n.of, power), alpha); }});
    }
  }
  for (const double alpha : {3.0, 5.0}) {
    out.push_back({format("range-log(%g,%g)", 8, alpha),
                   [=](N n) { return beyond_median(logarithm(at_one_metre(n.mean_distance(8), *n.of, 1)), alpha); }});
  }
  for (const double times : {2.0, 4.0, 8.0}) {
    for (const std::size_t enough : {4U, 8U, 20U}) {
      out.push_back({format("radius(%gx,%g)", times, static_cast<double>(enough)),
                     [=](N n) { return lonely(n, times, enough, false); }});
    }
    out.push_back({format("range-radius(%gx,%g)", times, 8), [=](N n) { return lonely(n, times, 8, true); }});
  }
  for (const double reach : {2.0, 4.0}) {
    for (const std::size_t smallest : {30U, 200U}) {
      out.push_back({format("cluster(%gx,%g)", reach, static_cast<double>(smallest)),
                     [=](N n) { return small_components(n, reach, smallest); }});
    }
  }
  out.push_back({"rays", rays});
  for (const double alpha : {1.0, 2.0, 3.0}) {
    for (const std::size_t k : {8U, 50U}) {
      out.push_back({format("rays+SOR(%g,%g)", static_cast<double>(k), alpha),
                     [=](N n) { return either(rays(n), beyond_mean(n.mean_distance(k), alpha)); }});
    }
  }
  out.push_back(
      {"rays+log-SOR(8,4)", [](N n) { return either(rays(n), beyond_median(logarithm(n.mean_distance(8)), 4)); }});
  out.push_back(
      {"rays+log-SOR(8,6)", [](N n) { return either(rays(n), beyond_median(logarithm(n.mean_distance(8)), 6)); }});
  out.push_back({"rays+range-log(8,5)", [](N n) {
                   return either(rays(n), beyond_median(logarithm(at_one_metre(n.mean_distance(8), *n.of, 1)), 5));
                 }});
  out.push_back({"rays+radius(4x,8)", [](N n) { return either(rays(n), lonely(n, 4, 8, false)); }});
  out.push_back({"rays+cluster(2x,30)", [](N n) { return either(rays(n), small_components(n, 2, 30)); }});
  out.push_back({"rays+cluster(4x,200)", [](N n) { return either(rays(n), small_components(n, 4, 200)); }});
  out.push_back({"SOR(50,1)+cluster(4x,200)",
                 [](N n) { return either(beyond_mean(n.mean_distance(50), 1), small_components(n, 4, 200)); }});
  return out;
}

}  // namespace orbis::bench

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The statistical filter written down plainly, from its definition, by brute force.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "clouds.hpp"

namespace orbis::test {

inline bool finite(const vec3f& p) { return std::isfinite(p.x()) && std::isfinite(p.y()) && std::isfinite(p.z()); }

inline float squared(const vec3f& a, const vec3f& b) {
  volatile float x = a.x() - b.x();
  volatile float y = a.y() - b.y();
  volatile float z = a.z() - b.z();
  x = x * x;
  y = y * y;
  z = z * z;
  volatile float sum = x + y;
  sum = sum + z;
  return sum;
}

/// Mean distances; NaN where not finite or alone.
inline std::vector<float> reference_mean_distances(const points& cloud, std::size_t k) {
  std::vector<float> out(cloud.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i != cloud.size(); ++i) {
    if (!finite(cloud[i])) continue;
    std::vector<float> distances;
    for (const vec3f& q : cloud) {
      if (finite(q)) distances.push_back(squared(cloud[i], q));
    }
    const auto wanted = static_cast<std::ptrdiff_t>(std::min(k + 1, distances.size()));
    std::partial_sort(distances.begin(), distances.begin() + wanted, distances.end());
    distances.resize(static_cast<std::size_t>(wanted));
    double sum = 0;
    for (std::size_t j = 1; j < distances.size(); ++j) sum += std::sqrt(static_cast<double>(distances[j]));
    if (distances.size() > 1) out[i] = static_cast<float>(sum / static_cast<double>(distances.size() - 1));
  }
  return out;
}

/// Mean distances to the first `k` neighbours of each row of a table; NaN where there are none.
template <class Table>
[[nodiscard]] std::vector<float> mean_distances_of(const Table& table, std::size_t k) {
  std::vector<float> means(table.points, std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i != table.points; ++i) {
    const auto row = table[i].first(std::min(k, table[i].size()));
    double sum = 0;
    for (const auto& n : row) sum += n.distance;
    if (!row.empty()) means[i] = static_cast<float>(sum / static_cast<double>(row.size()));
  }
  return means;
}

/// The decision on given mean distances.
inline std::vector<std::uint32_t> reference_decision(const points& cloud, const std::vector<float>& d, double alpha,
                                                     bool keep) {
  double sum = 0;
  double squares = 0;
  double n = 0;
  for (std::size_t i = 0; i != d.size(); ++i) {
    if (!finite(cloud[i])) continue;
    volatile float product = d[i] * d[i];
    sum += d[i];
    squares += product;
    n += 1;
  }
  const double mean = sum / n;
  const double threshold = mean + alpha * std::sqrt((squares - sum * sum / n) / (n - 1));
  std::vector<std::uint32_t> out;
  for (std::size_t i = 0; i != d.size(); ++i) {
    const bool outlier = finite(cloud[i]) ? static_cast<double>(d[i]) > threshold : !keep;
    if (!outlier) out.push_back(static_cast<std::uint32_t>(i));
  }
  return out;
}

}  // namespace orbis::test

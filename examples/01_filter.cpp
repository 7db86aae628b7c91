// SPDX-License-Identifier: BSD-3-Clause
//
// 01_filter [IN.ply|IN.pcd [OUT.ply]]: removes the outliers of a point cloud.
// Without a file it filters a synthetic wall with noise and stray points.
#include <cstdint>
#include <cstdio>
#include <utility>
#include <vector>

#include <orbis/cloud.hpp>
#include <orbis/core/random.hpp>
#include <orbis/io/cloud_file.hpp>
#include <orbis/io/ply.hpp>

int main(int argc, char** argv) {
  orbis::point_cloud cloud;
  if (argc > 1) {
    auto read = orbis::io::read_cloud(argv[1]);
    if (!read) {
      std::fprintf(stderr, "%s\n", read.error().to_string().c_str());
      return 2;
    }
    cloud = std::move(*read);
  } else {
    orbis::random_bits random{1};
    const auto uniform = [&](double low, double high) { return static_cast<float>(random.uniform(low, high)); };
    for (int i = 0; i != 20'000; ++i)
      cloud.points.push_back({uniform(-1, 1), uniform(-1, 1), 2.0F + 0.01F * static_cast<float>(random.normal())});
    for (int i = 0; i != 200; ++i) cloud.points.push_back({uniform(-1, 1), uniform(-1, 1), uniform(0, 1.8)});
  }

  // PCL's statistical filter with bit-identical results: a point is kept if the mean distance to its 50 nearest
  // neighbours is at most mu + 1.0 sigma over all points. The result contains the indices of the kept points.
  const std::vector<std::uint32_t> statistical =
      orbis::cloud::statistical_inliers(orbis::par, cloud.points, {.neighbors = 50, .sigma_multiplier = 1.0});
  std::printf("statistical filter: %zu of %zu points kept\n", statistical.size(), cloud.size());

  // The automatic filter analyses the cloud, and selects a filter and its parameters.
  const auto automatic = orbis::cloud::filter_automatically(orbis::par, cloud.points);
  std::printf("automatic filter: %zu points kept by %s; median spacing %.1f mm\n", automatic.inliers.size(),
              to_string(automatic.choice.chain).c_str(), 1e3 * automatic.choice.evidence.median_spacing);

  if (argc < 3) return 0;
  const auto written = orbis::io::write_ply(argv[2], cloud, automatic.inliers);
  if (!written) std::fprintf(stderr, "%s\n", written.error().to_string().c_str());
  return written ? 0 : 2;
}

// SPDX-License-Identifier: BSD-3-Clause
//
// The nearest neighbours of all points, beside a plain nanoflann loop.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <orbis/cloud/all_knn.hpp>
#include <orbis/core/execution.hpp>

#include "cloud/peers.hpp"

namespace orbis::bench {
namespace {

/// Row after row, nearest first, the point itself left out.
using neighbor_rows = std::vector<cloud::neighbor<float>>;

[[nodiscard]] neighbor_rows neighbors_by_nanoflann(const points& cloud, std::size_t k, unsigned threads) {
  const nanoflann_points data{&cloud};
  const nanoflann_tree index(3, data, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  neighbor_rows rows(cloud.size() * k);
  for_each_chunk(par.with(threads), cloud.size(), 4096, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> found(k + 1);
    std::vector<float> squared(k + 1);
    for (std::size_t i = begin; i != end; ++i) {
      index.knnSearch(cloud[i].data(), k + 1, found.data(), squared.data());
      for (std::size_t j = 0; j != k; ++j) rows[i * k + j] = {found[j + 1], std::sqrt(squared[j + 1])};
    }
  });
  return rows;
}

void add_neighbors(std::size_t n, std::size_t k) {
  const auto add = [&](const std::string& row, const std::function<neighbor_rows(const points&)>& search) {
    add_cloud_row<neighbor_rows>(
        "all_knn/n:" + std::to_string(n) + "/k:" + std::to_string(k) + "/" + row,
        [n]() -> const points& { return room_cloud(n); }, search,
        [k](const points& in, const neighbor_rows& rows) {
          const auto ours = cloud::all_knn(par, in, k).rows;  // the same distances; ties may go another way
          bool same = rows.size() == ours.size();
          for (std::size_t i = 0; same && i != rows.size(); ++i) same = rows[i].distance == ours[i].distance;
          return same;
        });
  };
  add("orbis", [k](const points& in) { return cloud::all_knn(seq, in, k).rows; });
  add("orbis_par2", [k](const points& in) { return cloud::all_knn(par.with(2), in, k).rows; });
  add("nanoflann", [k](const points& in) { return neighbors_by_nanoflann(in, k, 1); });
  add("nanoflann_par2", [k](const points& in) { return neighbors_by_nanoflann(in, k, 2); });
}

[[maybe_unused]] const bool registered = [] {
  for (const std::size_t k : {1U, 8U, 50U}) add_neighbors(100'000, k);
  return true;
}();

}  // namespace
}  // namespace orbis::bench

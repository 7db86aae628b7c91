// SPDX-License-Identifier: BSD-3-Clause
//
// Fixed filters, as somebody would set them once for all clouds.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <orbis/cloud/all_knn.hpp>

#include "cases.hpp"

namespace orbis::bench {

/// What all settings need of a case, worked out once.
struct neighborhoods {
  explicit neighborhoods(const labelled_case& c);
  /// Per point, metres. @pre k <= 100
  [[nodiscard]] std::vector<double> mean_distance(std::size_t k) const;

  const labelled_case* of;
  cloud::neighbor_table table;
  double spacing = 0;                ///< median distance to the sixth neighbour, metres
  std::vector<char> passed_through;  ///< what ray evidence removes; empty without views
};

/// A mask of the points to remove.
using removal = std::vector<char>;
struct setting {
  std::string name;
  std::function<removal(const neighborhoods&)> apply;
};
[[nodiscard]] std::vector<setting> fixed_settings();

}  // namespace orbis::bench

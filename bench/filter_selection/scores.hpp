// SPDX-License-Identifier: BSD-3-Clause
//
// How good a removal is, and tables of that.
#pragma once

#include <string>
#include <vector>

#include "cases.hpp"
#include "settings.hpp"

namespace orbis::bench {

struct score {
  double f1 = 0;      ///< of the removal of outliers
  double wrong = 0;   ///< share of the clean points that were removed
  double missed = 0;  ///< share of the outliers that stayed
  double rms = 0;     ///< of what stayed, metres to the true surface; NaN where that is not known
};
[[nodiscard]] score score_of(const labelled_case& c, const removal& removed);
[[nodiscard]] double outlier_share(const labelled_case& c);

struct case_scores {
  std::string name;
  trouble kind;
  std::vector<score> row;  ///< one for each setting
  score untouched;
};

/// All cases by all settings; setting 0 is the automatic one.
struct score_table {
  std::vector<std::string> settings;
  std::vector<case_scores> cases;

  /// The fixed setting with the largest mean F1 over the cases with outliers, of one kind or all.
  [[nodiscard]] std::size_t best_fixed() const;
  [[nodiscard]] std::size_t best_fixed(trouble kind) const;
  [[nodiscard]] std::size_t best_of_case(std::size_t c) const;
  /// Mean F1 of a setting over the cases of a kind; NaN where there are none.
  [[nodiscard]] double mean_f1(std::size_t setting, trouble kind) const;
  [[nodiscard]] double mean_f1(std::size_t setting) const;
  /// Share of clean points removed, mean over the clean cases.
  [[nodiscard]] double mean_wrong(std::size_t setting) const;
  /// The table by kind, and whether the targets are reached.
  [[nodiscard]] std::string report() const;
  [[nodiscard]] std::string csv() const;
};

}  // namespace orbis::bench

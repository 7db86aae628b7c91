// SPDX-License-Identifier: BSD-3-Clause
// The example at the top of core/simd.hpp.
#include <algorithm>
#include <span>
#include <vector>

#include <orbis/core/simd.hpp>

#include "support/catch.hpp"

namespace {

struct sum_of_squares {
  template <orbis::simd::target Target>
  static ORBIS_ALWAYS_INLINE double run(std::span<const double> x) {
    using lanes = orbis::simd::vec<double, 8, Target>;
    lanes sum = 0.0;
    for (std::size_t i = 0; i < x.size(); i += lanes::count) {
      const lanes v = lanes::load(x.data() + i, std::min(lanes::count, x.size() - i));
      sum += select(v > 0.0, v * v, 0.0);
    }
    return orbis::simd::sum(sum);
  }
};

}  // namespace

TEST_CASE("the example of how to write a kernel works") {
  const std::vector<double> values{1, -2, 3, 4, -5, 6, 7, 8, 9, -10, 11};
  for (const auto l : orbis::simd::available_levels()) {
    const orbis::simd::level_limit limit{l};
    const double total = orbis::simd::kernel<sum_of_squares, double(std::span<const double>)>()(values);
    CHECK(total == 1 + 9 + 16 + 36 + 49 + 64 + 81 + 121);
  }
}

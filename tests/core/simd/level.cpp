// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/simd/level.hpp>

#include "support/catch.hpp"

using orbis::simd::level;

TEST_CASE("a limit lowers what kernels run at while it lives") {
  using orbis::simd::best_level, orbis::simd::level_limit;
  CHECK(best_level() == orbis::simd::detected());
  {
    const level_limit low{level::portable};
    CHECK(best_level() == level::portable);
    {
      const level_limit none{level::avx512};
      CHECK(best_level() == orbis::simd::detected());
    }
    CHECK(best_level() == level::portable);
  }
  CHECK(best_level() == orbis::simd::detected());
  CHECK(orbis::simd::available_levels().back() == orbis::simd::detected());
}

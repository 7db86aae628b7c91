// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <orbis/core/simd/dispatch.hpp>

#include "support/catch.hpp"

using namespace orbis;
using simd::level;

namespace {

/// Adds to `x` a hundred for each level of what it was compiled for.
struct add_level {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE int run(int x) {
    return x + 100 * static_cast<int>(Target::needs);
  }
};

template <simd::target... Targets>
int level_of(level highest) {
  return simd::kernel<add_level, int(int), Targets...>(highest)(7) / 100;
}

constexpr level all[] = {level::portable, level::popcnt, level::avx2, level::avx512};

}  // namespace

TEST_CASE("the kernel chosen is never beyond the wanted level or the processor") {
  for (const level wanted : all) {
    const level best = std::min(wanted, simd::detected());
    CHECK((level_of<simd::popcnt, simd::avx2, simd::avx512>(wanted) == static_cast<int>(best)));
  }
}

TEST_CASE("a level without a kernel falls back to the one below") {
  for (const level wanted : all) {
    const level best = std::min(wanted, simd::detected());
    CHECK((level_of<simd::popcnt, simd::avx2>(wanted) == static_cast<int>(std::min(best, level::avx2))));
    CHECK(level_of<simd::popcnt>(wanted) == static_cast<int>(std::min(best, level::popcnt)));
    CHECK(level_of<simd::portable>(wanted) == 0);
    CHECK(level_of<>(wanted) == (best == level::popcnt ? 0 : static_cast<int>(best)));  // avx2 and avx512
  }
}

TEST_CASE("a limit lowers the kernel chosen while it lives") {
  {
    const simd::level_limit low{level::portable};
    CHECK(level_of<simd::popcnt, simd::avx2, simd::avx512>(level::avx512) == 0);
  }
  CHECK((level_of<simd::popcnt, simd::avx2, simd::avx512>(level::avx512) == static_cast<int>(simd::detected())));
}

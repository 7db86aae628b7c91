// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <orbis/core/simd/level.hpp>

#include "support/catch.hpp"

namespace {

using orbis::simd::level;

int portable_kernel(int x) { return x; }
ORBIS_TARGET("sse4.2,popcnt") int popcnt_kernel(int x) { return x + 100; }
ORBIS_TARGET("avx2") int avx2_kernel(int x) { return x + 200; }
ORBIS_TARGET("avx512f") int avx512_kernel(int x) { return x + 300; }

constexpr orbis::simd::variants<int(int)> all{
    .portable = portable_kernel, .popcnt = popcnt_kernel, .avx2 = avx2_kernel, .avx512 = avx512_kernel};

}  // namespace

TEST_CASE("the kernel chosen is never beyond the wanted level or the processor") {
  int (*const by_level[])(int) = {portable_kernel, popcnt_kernel, avx2_kernel, avx512_kernel};
  for (const level wanted : {level::portable, level::popcnt, level::avx2, level::avx512}) {
    const level best = std::min(wanted, orbis::simd::detected());
    CHECK(orbis::simd::select(wanted, all) == by_level[static_cast<int>(best)]);
    CHECK(orbis::simd::select(wanted, all)(7) == 7 + 100 * static_cast<int>(best));  // and it runs here
  }
}

TEST_CASE("a level without a kernel falls back to the one below") {
  orbis::simd::variants<int(int)> some = all;
  some.avx512 = nullptr;
  CHECK(orbis::simd::select(level::avx512, some) == orbis::simd::select(level::avx2, all));
  some.avx2 = nullptr;
  CHECK(orbis::simd::select(level::avx512, some) == orbis::simd::select(level::popcnt, all));
  CHECK(orbis::simd::select(level::avx512, orbis::simd::variants<int(int)>{.portable = portable_kernel}) ==
        portable_kernel);
}

TEST_CASE("a limit lowers what kernels run at while it lives") {
  using orbis::simd::best_level, orbis::simd::level_limit;
  CHECK(best_level() == orbis::simd::detected());
  {
    const level_limit low{level::portable};
    CHECK(best_level() == level::portable);
    CHECK(orbis::simd::select(level::avx512, all) == portable_kernel);
    {
      const level_limit none{level::avx512};
      CHECK(best_level() == orbis::simd::detected());
    }
    CHECK(best_level() == level::portable);
  }
  CHECK(best_level() == orbis::simd::detected());
  CHECK(orbis::simd::available_levels().back() == orbis::simd::detected());
}

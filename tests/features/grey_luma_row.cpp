// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/grey-inl.hpp>

#include "support/catch.hpp"

using namespace orbis;
using features::detail::luma_kernel;

TEST_CASE("a row of any length becomes its luma at every level, and nothing beyond it is read or written") {
  static_assert(features::detail::luma_red + features::detail::luma_green + features::detail::luma_blue == 1 << 15);
  random_bits random{1};
  for (int count = 0; count != 150; ++count) {
    std::vector<rgb8> from(static_cast<std::size_t>(count));  // of just this size, for memory checkers
    for (rgb8& c : from)
      c = {static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()),
           static_cast<std::uint8_t>(random())};
    if (count > 2) from[1] = {255, 255, 255}, from[2] = {0, 0, 0};
    for (const simd::level l : simd::available_levels()) {
      const simd::level_limit limit{l};
      std::vector<std::uint8_t> to(static_cast<std::size_t>(count) + 40, 77);
      simd::kernel<luma_kernel, luma_kernel::signature, simd::avx2>()(from.data(), count, to.data());
      int wrong = 0;
      for (std::size_t i = 0; i != to.size(); ++i) {
        // Products below 2^24 and their sums are exact.
        const int expected =
            i < from.size()
                ? static_cast<int>((9798.0 * from[i].r + 19235.0 * from[i].g + 3735.0 * from[i].b + 16384.0) / 32768.0)
                : 77;
        wrong += to[i] != expected ? 1 : 0;
      }
      CHECK(wrong == 0);
    }
  }
}

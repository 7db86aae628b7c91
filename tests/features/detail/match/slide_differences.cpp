// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/features/detail/match/slide_differences.hpp>

#include "support/catch.hpp"

using namespace orbis;
using features::detail::sliding_square;

TEST_CASE("differences of a square at each shift are those of the definition on every level") {
  random_bits random{11};
  const std::array<std::array<int, 3>, 5> cases{{{11, 11, 256}, {1, 3, 256}, {31, 31, 256}, {11, 17, 256}, {21, 9, 2}}};
  for (const auto& [side, shifts, values] : cases) {
    sliding_square s{};
    s.side = side;
    const auto pixel = [&, v = values] {
      const auto value = static_cast<int>(random.below(static_cast<std::uint64_t>(v)));
      return static_cast<std::int16_t>(4 * (v == 2 ? 255 * value : value));
    };
    for (int i = 0; i != side * side; ++i) s.square[static_cast<std::size_t>(i)] = pixel();
    const int used = side - 1 + (shifts + 15) / 16 * 16;
    for (int v = 0; v != side; ++v)
      for (int u = 0; u != used; ++u) s.strip[static_cast<std::size_t>(v * sliding_square::stride + u)] = pixel();
    for (const simd::level l : simd::available_levels()) {
      const simd::level_limit limit{l};
      std::array<std::int32_t, sliding_square::max_shifts> sums{};
      features::detail::slide_differences(s, shifts, sums.data());
      for (int k = 0; k != shifts; ++k) {
        double means = 0.0, sum = 0.0;
        const auto difference = [&](int v, int u) {
          return static_cast<double>(s.square[static_cast<std::size_t>(v * side + u)] -
                                     s.strip[static_cast<std::size_t>(v * sliding_square::stride + u + k)]);
        };
        for (int v = 0; v != side; ++v)
          for (int u = 0; u != side; ++u) means += difference(v, u) / (side * side);
        for (int v = 0; v != side; ++v)
          for (int u = 0; u != side; ++u) sum += std::abs(difference(v, u) - std::trunc(means + 1e-9 * means));
        CHECK(static_cast<double>(sums[static_cast<std::size_t>(k)]) == sum);
      }
    }
  }
}

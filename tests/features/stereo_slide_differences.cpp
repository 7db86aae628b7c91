// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/features/stereo-inl.hpp>

#include "support/catch.hpp"

using namespace orbis;
using features::detail::sliding_square;

TEST_CASE("differences of a square at each shift are those of the definition on every level") {
  random_bits random{11};
  const std::array<std::array<int, 3>, 5> cases{{{11, 11, 256}, {1, 3, 256}, {31, 31, 256}, {11, 17, 256}, {21, 9, 2}}};
  for (const auto& [square_side, shifts, values] : cases) {
    const int side = square_side;  // clang 14 captures no structured binding
    const int used = side + shifts - 1;
    std::vector<std::uint8_t> square, strip;
    const auto pixel = [&, v = values] {
      const auto value = static_cast<int>(random.below(static_cast<std::uint64_t>(v)));
      return static_cast<std::uint8_t>(v == 2 ? 255 * value : value);
    };
    for (int i = 0; i != side * side; ++i) square.push_back(pixel());
    for (int i = 0; i != side * used; ++i) strip.push_back(pixel());
    // No pixel more than is needed: the address sanitizer sees what is read beyond.
    const sliding_square s{.side = side, .square = {square.data(), side, side}, .strip = {strip.data(), used, used}};
    for (const simd::level l : simd::available_levels()) {
      const simd::level_limit limit{l};
      std::array<std::int32_t, sliding_square::max_shifts> sums{};
      features::detail::slide_differences(s, shifts, sums.data());
      for (int k = 0; k != shifts; ++k) {
        double means = 0.0, sum = 0.0;
        const auto difference = [&](int v, int u) {
          return 4.0 *
                 (square[static_cast<std::size_t>(v * side + u)] - strip[static_cast<std::size_t>(v * used + u + k)]);
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

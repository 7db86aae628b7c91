// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <tuple>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/nav/detail/floor/plane_sums.hpp>

#include "support/catch.hpp"

using namespace orbis;
using nav::detail::level_window;
using nav::detail::no_level;
using nav::detail::plane_sums;

namespace {

auto numbers(const plane_sums& s) {
  return std::tuple(s.n, s.x, s.y, s.z, s.xx, s.xy, s.yy, s.xz, s.yz, s.lowest, s.highest);
}

plane_sums one_by_one(const level_window& w) {
  plane_sums s;
  for (int row = 0; row != w.height; ++row)
    for (int column = 0; column != w.width; ++column) {
      const int x = w.x + column, y = w.y + row, level = w.levels[row * w.stride + column];
      if (level == no_level) continue;
      const int z = level - w.level;
      if (std::abs(z) > w.step * std::min(w.enough, std::max(std::abs(x), std::abs(y)))) continue;
      s.lowest = std::min(s.lowest, z);
      s.highest = std::max(s.highest, z);
      s.n += 1;
      s.x += x, s.y += y, s.z += z, s.xx += x * x, s.xy += x * y, s.yy += y * y, s.xz += x * z, s.yz += y * z;
    }
  return s;
}

}  // namespace

TEST_CASE("Sums for a plane are those of the columns one by one on every level") {
  random_bits random{7};
  const auto below = [&](int n) { return static_cast<int>(random.below(static_cast<std::uint32_t>(n))); };
  for (int round = 0; round != 300; ++round) {
    constexpr int width = 45, height = 40;
    std::vector<int> levels(std::size_t{width} * height);  // no more: what is read behind the last one shows
    const int rough = 1 + below(20), gaps = 2 + below(20);
    for (std::size_t i = 0; i != levels.size(); ++i)
      levels[i] = below(gaps) == 0 ? no_level : below(rough) + static_cast<int>(i % width) / 3 - 5;
    const int radius = 1 + below(20), x = below(width), y = below(height);
    level_window w;
    w.x = -std::min(radius, x);
    w.y = -std::min(radius, y);
    w.width = std::min(radius, width - 1 - x) - w.x + 1;
    w.height = std::min(radius, height - 1 - y) - w.y + 1;
    w.levels = levels.data() + (y + w.y) * width + x + w.x;
    w.stride = width;
    w.level = below(30) - 5;
    w.step = 1 + below(4);
    w.enough = 1 + below(25);
    const plane_sums expected = one_by_one(w);
    for (const simd::level l : simd::available_levels()) {
      INFO("level " << static_cast<int>(l));
      CHECK(numbers(simd::kernel<nav::detail::plane_sums_kernel<std::int32_t>, plane_sums(const level_window&)>(l)(
                w)) == numbers(expected));
      CHECK(numbers(simd::kernel<nav::detail::plane_sums_kernel<double>, plane_sums(const level_window&)>(l)(w)) ==
            numbers(expected));
    }
  }
}

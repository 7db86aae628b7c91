// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Choosing corners that cover the image evenly.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>

namespace orbis::features {

/// A corner of one pyramid level: integer pixel and strength.
struct corner {
  int x = 0;
  int y = 0;
  float response = 0.0F;
  friend constexpr bool operator==(const corner&, const corner&) = default;
};

/// At most `wanted` of the corners of a `width` x `height` image, evenly spread: the image is cut into
/// about `wanted` square cells; first every cell gives its strongest corner, then every cell its
/// second, and so on, stronger ones first within a round. Corners weaker than `strong` are taken in
/// the first round, where they help because there is nothing else, or when no strong ones are left.
/// Sorted by row, then column.
/// O(n log n); the order of the input does not matter.
[[nodiscard]] inline std::vector<corner> spread(std::vector<corner> corners, int wanted, int width, int height,
                                                float strong) {
  if (wanted <= 0 || corners.empty()) return {};
  const double side = std::max(1.0, std::sqrt(static_cast<double>(width) * height / wanted));
  const int columns = std::max(1, static_cast<int>(std::lround(width / side)));
  const int rows = std::max(1, static_cast<int>(std::lround(height / side)));

  constexpr std::uint32_t no_corner = std::numeric_limits<std::uint32_t>::max();
  struct ranked {
    corner c;
    int cell;
    int rank;
  };
  const auto stronger = [](const ranked& a, const ranked& b) {
    return std::tuple(-a.c.response, a.c.y, a.c.x) < std::tuple(-b.c.response, b.c.y, b.c.x);
  };
  std::vector<ranked> all;
  all.reserve(corners.size());
  for (const corner& c : corners) {
    const auto part = [](int at, int size, int parts) {
      return std::clamp(static_cast<int>(static_cast<std::int64_t>(at) * parts / std::max(1, size)), 0, parts - 1);
    };
    all.push_back({c, part(c.y, height, rows) * columns + part(c.x, width, columns), 0});
  }
  // Most corners are weak ones that will not be needed: leave them out before anything is sorted.
  std::vector<std::uint32_t> first(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), no_corner);
  for (std::uint32_t i = 0; i != all.size(); ++i) {
    std::uint32_t& best = first[static_cast<std::size_t>(all[i].cell)];
    if (best == no_corner || stronger(all[i], all[best])) best = i;
  }
  std::vector<ranked> hopeful;
  for (std::uint32_t i = 0; i != all.size(); ++i)
    if (all[i].c.response >= strong || first[static_cast<std::size_t>(all[i].cell)] == i) hopeful.push_back(all[i]);
  if (hopeful.size() >= static_cast<std::size_t>(wanted)) all = std::move(hopeful);

  std::sort(all.begin(), all.end(),
            [&](const ranked& a, const ranked& b) { return a.cell != b.cell ? a.cell < b.cell : stronger(a, b); });
  for (std::size_t i = 1; i < all.size(); ++i) all[i].rank = all[i].cell == all[i - 1].cell ? all[i - 1].rank + 1 : 0;
  const std::size_t count = std::min(all.size(), static_cast<std::size_t>(wanted));
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count), all.end(),
                    [&](const ranked& a, const ranked& b) {
                      const auto weak = [&](const ranked& r) { return r.rank > 0 && r.c.response < strong; };
                      const auto turn = [&](const ranked& r) { return std::pair(weak(r), r.rank); };
                      return turn(a) != turn(b) ? turn(a) < turn(b) : stronger(a, b);
                    });
  std::vector<corner> chosen;
  chosen.reserve(count);
  for (std::size_t i = 0; i != count; ++i) chosen.push_back(all[i].c);
  std::sort(chosen.begin(), chosen.end(),
            [](const corner& a, const corner& b) { return std::tuple(a.y, a.x) < std::tuple(b.y, b.x); });
  return chosen;
}

}  // namespace orbis::features

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/detail/path/cell_floods.hpp>

#include "support/catch.hpp"

using namespace orbis;
using key = octree::voxel_key;

namespace {

/// Cells of 1 m that are free or not, and how often that was asked.
template <int Dimensions>
struct cells {
  static constexpr int dimensions = Dimensions;
  std::uint32_t size = 0;
  std::vector<bool> free;
  mutable std::size_t asked = 0;

  cells(random_bits& random, std::uint32_t n, double share) : size{n} {
    for (std::uint32_t i = 0; i != n * n * (dimensions == 3 ? n : 1); ++i) free.push_back(random.uniform() < share);
  }
  [[nodiscard]] double resolution() const { return 1.0; }
  [[nodiscard]] bool contains(const key& k) const {
    return std::max(k.x, k.y) < size && k.z < (dimensions == 3 ? size : 1);
  }
  [[nodiscard]] vec3 center(const key& k) const { return {k.x + 0.5, k.y + 0.5, dimensions == 3 ? k.z + 0.5 : 0.0}; }
  [[nodiscard]] vec3 clamped(const vec3& p) const {
    const vec3 in = p.cwiseMax(vec3::Zero()).cwiseMin(vec3::Constant(size));
    return dimensions == 3 ? in : vec3{in.x(), in.y(), 0.0};
  }
  [[nodiscard]] std::size_t index(const key& k) const { return (k.z * size + k.y) * size + k.x; }
  [[nodiscard]] bool is_free(const key& k) const {
    ++asked;
    return free[index(k)];
  }
};

/// Of each cell, which others hang together with it: equal numbers. 0: it is not free.
template <int Dimensions>
std::vector<int> pieces_of(const cells<Dimensions>& space) {
  std::vector<int> piece(space.free.size());
  int count = 0;
  for (std::uint32_t i = 0; i != space.free.size(); ++i) {
    if (!space.free[i] || piece[i] != 0) continue;
    std::vector<key> open{{i % space.size, i / space.size % space.size, i / space.size / space.size}};
    piece[i] = ++count;
    while (!open.empty()) {
      const key k = open.back();
      open.pop_back();
      for (std::uint32_t d = 0; d != 27; ++d) {
        const key to{k.x + d % 3 - 1, k.y + d / 3 % 3 - 1, k.z + d / 9 - 1};
        if (!space.contains(to) || !space.free[space.index(to)] || piece[space.index(to)] != 0) continue;
        piece[space.index(to)] = count;
        open.push_back(to);
      }
    }
  }
  return piece;
}

template <int Dimensions>
void compare(std::uint32_t size, double share) {
  random_bits random{7};
  std::array<int, 2> seen{};
  int gave_up = 0;
  for (int round = 0; round != 30; ++round) {
    const cells<Dimensions> space{random, size, share};
    const std::vector<int> piece = pieces_of(space);
    const auto any = [&] {
      return key{random.below(size), random.below(size), Dimensions == 3 ? random.below(size) : 0};
    };
    const auto free = [&] {
      key k = any();
      while (!space.free[space.index(k)]) k = any();
      return k;
    };
    const key start = free();
    const int own = piece[space.index(start)];
    const vec3 goal = space.center(any()) + vec3{random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), 0.2};
    nav::detail::cell_floods floods{space, space.center(start), {start}, goal};
    for (int i = 0; i != 30; ++i) {  // in turn, with what is known from before
      std::vector<key> to{free()};
      if (i % 3 == 0) to.push_back(free());
      const bool expected =
          std::any_of(to.begin(), to.end(), [&](const key& k) { return piece[space.index(k)] == own; });
      if (i % 5 == 4) {  // it may give up, and says so then
        const bool may = floods.may_reach_any(to, 2);
        if (expected) CHECK(may);
        gave_up += may && !expected ? 1 : 0;
        continue;
      }
      CHECK(floods.may_reach_any(to, 100'000) == expected);
      ++seen[expected ? 1 : 0];
    }
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i != piece.size(); ++i)
      if (piece[i] == own)
        least =
            std::min(least, (space.center({i % size, i / size % size, i / size / size}) - space.clamped(goal)).norm());
    const std::optional<key> nearest = floods.nearest(100'000);
    REQUIRE(nearest);
    CHECK(piece[space.index(*nearest)] == own);
    CHECK((space.center(*nearest) - space.clamped(goal)).norm() == Approx(least));
    const std::size_t before = space.asked;
    CHECK(floods.may_reach_any({start}, 0));
    CHECK(space.asked - before < 2);  // what is known is not asked again
  }
  CHECK(seen[0] > 50);
  CHECK(seen[1] > 50);
  CHECK(gave_up > 0);
}

}  // namespace

TEST_CASE("Which cells hang together, and which of them is nearest to the goal") {
  compare<3>(14, 0.11);
  compare<2>(40, 0.42);
}

TEST_CASE("Without a door nothing hangs together with the start") {
  random_bits random{3};
  const cells<3> space{random, 10, 0.5};
  nav::detail::cell_floods floods{space, vec3::Constant(5.0), {}, vec3::Constant(2.0)};
  CHECK_FALSE(floods.may_reach_any({key{3, 3, 3}}, 1000));
  CHECK_FALSE(floods.nearest(1000));
}

TEST_CASE("Of a small enclosure and a large one, only about as many cells are asked for as the small one has") {
  random_bits random{3};
  for (const bool start_is_inside : {false, true}) {
    cells<3> space{random, 60, 1.1};
    for (std::uint32_t i = 0; i != space.free.size(); ++i) {  // the walls of a box of 5 cells
      const std::array<std::uint32_t, 3> p{i % 60, i / 60 % 60, i / 3600};
      const auto [low, high] = std::minmax_element(p.begin(), p.end());
      if (*low >= 20 && *high <= 26 && (*low == 20 || *high == 26)) space.free[i] = false;
    }
    const key inside{23, 23, 23}, outside{50, 40, 30};
    const key start = start_is_inside ? inside : outside, goal = start_is_inside ? outside : inside;
    nav::detail::cell_floods floods{space, space.center(start), {start}, space.center(goal)};
    CHECK_FALSE(floods.may_reach_any({goal}, 1'000'000));
    CHECK(space.asked < 5'000);
  }
}

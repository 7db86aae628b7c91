// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/nav/squared_distances.hpp>
#include <orbis/octree/key.hpp>

#include "support/catch.hpp"

using namespace orbis;
using nav::octant_obstacles;
using nav::squared_distances;
using octree::voxel_key;

namespace {

/// Obstacles in a box of the grid, and what a field should say about them.
class world {
 public:
  /// `size`: voxels along each axis, multiples of 4; `outside`: whether all else is an obstacle.
  world(voxel_key low, std::array<int, 3> size, bool outside)
      : low_{low}, size_{size}, outside_{outside}, obstacle_(count(), char{outside}) {}

  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]);
  }
  [[nodiscard]] char& at(int x, int y, int z) {
    return obstacle_[(static_cast<std::size_t>(z) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(y)) *
                         static_cast<std::size_t>(size_[0]) +
                     static_cast<std::size_t>(x)];
  }
  [[nodiscard]] bool is_obstacle(int x, int y, int z) {
    const bool inside = 0 <= x && x < size_[0] && 0 <= y && y < size_[1] && 0 <= z && z < size_[2];
    return inside ? at(x, y, z) != 0 : outside_;
  }
  [[nodiscard]] voxel_key key(int x, int y, int z) const {
    return {low_.x + static_cast<std::uint32_t>(x), low_.y + static_cast<std::uint32_t>(y),
            low_.z + static_cast<std::uint32_t>(z)};
  }
  [[nodiscard]] octant_obstacles octant(int x, int y, int z) {
    x &= ~3, y &= ~3, z &= ~3;
    octant_obstacles o{key(x, y, z), 0};
    for (int i = 0; i != 64; ++i) {
      const voxel_key k = octree::morton_key(static_cast<std::uint64_t>(i));
      if (is_obstacle(x + static_cast<int>(k.x), y + static_cast<int>(k.y), z + static_cast<int>(k.z)))
        o.mask |= std::uint64_t{1} << i;
    }
    return o;
  }
  [[nodiscard]] std::vector<octant_obstacles> octants() {
    std::vector<octant_obstacles> all;
    for (int z = 0; z < size_[2]; z += 4)
      for (int y = 0; y < size_[1]; y += 4)
        for (int x = 0; x < size_[0]; x += 4) all.push_back(octant(x, y, z));
    return all;
  }
  /// The first voxel whose value is wrong, as text; empty if there is none. One pass along each axis, in the plain way.
  [[nodiscard]] std::string difference(const squared_distances& field) {
    const int reach = field.reach();
    const auto stage = [&](std::size_t axis, auto&& value) {  // over the voxels that the next stage looks at
      numbers out;
      for (std::size_t i = 0; i != 3; ++i) {
        const int margin = i > axis ? 10 + reach : 10;
        out.low[i] = -margin;
        out.size[i] = size_[i] + 2 * margin;
      }
      out.for_each([&](std::array<int, 3> p, int& best) {
        best = squared_distances::far;
        for (int d = -reach; d <= reach; ++d) {
          std::array<int, 3> from = p;
          from[axis] += d;
          const int offer = value(from);
          if (offer != squared_distances::far) best = std::min(best, offer + d * d);
        }
      });
      return out;
    };
    numbers along =
        stage(0, [&](const auto& p) { return is_obstacle(p[0], p[1], p[2]) ? 0 : int{squared_distances::far}; });
    numbers plane = stage(1, [&](const auto& p) { return along.at(p); });
    numbers space = stage(2, [&](const auto& p) { return plane.at(p); });
    std::string wrong;
    space.for_each([&](const std::array<int, 3>& p, int d) {
      const int expected = d <= reach * reach ? d : int{squared_distances::far};
      const int found = field.squared(key(p[0], p[1], p[2]));
      if (wrong.empty() && found != expected)
        wrong = std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]) + ": " +
                std::to_string(found) + ", not " + std::to_string(expected);
    });
    return wrong;
  }
  [[nodiscard]] std::array<int, 3> size() const { return size_; }

 private:
  /// A number for each voxel of a box.
  struct numbers {
    std::array<int, 3> low{}, size{};
    std::vector<int> all{};

    [[nodiscard]] int& at(const std::array<int, 3>& p) {
      return all[static_cast<std::size_t>(((p[2] - low[2]) * size[1] + p[1] - low[1]) * size[0] + p[0] - low[0])];
    }
    template <class Visit>
    void for_each(Visit&& visit) {
      all.resize(static_cast<std::size_t>(size[0] * size[1] * size[2]));
      for (int z = 0; z != size[2]; ++z)
        for (int y = 0; y != size[1]; ++y)
          for (int x = 0; x != size[0]; ++x) {
            const std::array<int, 3> p{low[0] + x, low[1] + y, low[2] + z};
            visit(p, at(p));
          }
    }
  };

  voxel_key low_;
  std::array<int, 3> size_;
  bool outside_;
  std::vector<char> obstacle_;
};

constexpr std::uint32_t cells = 65536;
constexpr voxel_key somewhere{32764, 32748, 32780};  // across the borders of bricks and of blocks of bricks

/// Changes some voxels, or a box of them, and says which octants have changed.
std::vector<octant_obstacles> change(world& w, random_bits& random) {
  std::map<std::array<int, 3>, char> touched;
  const auto below = [&](int n) { return static_cast<int>(random.below(static_cast<std::uint32_t>(n))); };
  const auto set = [&](int x, int y, int z, bool obstacle) {
    w.at(x, y, z) = char{obstacle};
    touched[{x & ~3, y & ~3, z & ~3}] = 1;
  };
  const auto size = w.size();
  if (below(4) != 0) {
    for (int i = 1 + below(12); i != 0; --i) set(below(size[0]), below(size[1]), below(size[2]), below(2) != 0);
  } else {
    std::array<int, 3> from{}, to{};
    for (std::size_t i = 0; i != 3; ++i) {
      from[i] = below(size[i]);
      to[i] = std::min(size[i], from[i] + 1 + below(6));
    }
    const bool obstacle = below(2) != 0;
    for (int z = from[2]; z != to[2]; ++z)
      for (int y = from[1]; y != to[1]; ++y)
        for (int x = from[0]; x != to[0]; ++x) set(x, y, z, obstacle);
  }
  std::vector<octant_obstacles> out;
  for (const auto& [p, one] : touched) out.push_back(w.octant(p[0], p[1], p[2]));
  return out;
}

}  // namespace

TEST_CASE("Squared distances are those of all pairs after any changes") {
  const bool outside = GENERATE(false, true);
  const int reach = GENERATE(1, 2, 5, 8, 9, 17);
  CAPTURE(outside, reach);
  random_bits random{static_cast<std::uint64_t>(reach) + (outside ? 100U : 0U)};
  world w{somewhere, {20, 12, 16}, outside};
  squared_distances field{reach, cells, outside};
  CHECK(w.difference(field).empty());
  for (int round = 0; round != 10; ++round) {
    for (int i = 0; i != 5; ++i) field.update(change(w, random));
    CHECK(w.difference(field) == "");
    squared_distances afresh{reach, cells, outside};
    afresh.update(w.octants());
    CHECK(w.difference(afresh) == "");
  }
}

TEST_CASE("The nearest obstacle is as far away as the field says") {
  const bool outside = GENERATE(false, true);
  random_bits random{7};
  world w{somewhere, {20, 12, 16}, outside};
  squared_distances field{12, cells, outside};
  for (int i = 0; i != 20; ++i) field.update(change(w, random));
  for (int i = 0; i != 2000; ++i) {
    const auto somewhere_near = [&](int size) {
      return static_cast<int>(random.below(static_cast<std::uint32_t>(size + 20))) - 10;
    };
    const int x = somewhere_near(20), y = somewhere_near(12), z = somewhere_near(16);
    const voxel_key k = w.key(x, y, z);
    const auto nearest = field.nearest(k);
    REQUIRE(nearest.has_value() == (field.squared(k) != squared_distances::far));
    if (!nearest) continue;
    CHECK(field.squared(*nearest) == 0);
    const auto square = [](std::uint32_t a, std::uint32_t b) {
      const int d = static_cast<int>(a) - static_cast<int>(b);
      return d * d;
    };
    CHECK(square(nearest->x, k.x) + square(nearest->y, k.y) + square(nearest->z, k.z) == field.squared(k));
  }
}

TEST_CASE("A copy of the view stays as it was while the field goes on") {
  random_bits random{3};
  world w{somewhere, {20, 12, 16}, false};
  squared_distances field{9, cells, false};
  field.update(w.octants());
  for (int round = 0; round != 10; ++round) {
    field.update(change(w, random));
    const nav::squared_distance_view before = field.view();
    std::vector<std::uint16_t> values;
    const auto read = [&](const nav::squared_distance_view& view, auto&& visit) {
      nav::squared_distance_view::reader reader{view};
      for (int z = -4; z != 20; ++z)
        for (int y = -4; y != 16; ++y)
          for (int x = -4; x != 24; ++x) visit(reader.squared(w.key(x, y, z)));
    };
    read(before, [&](std::uint16_t v) { values.push_back(v); });
    for (int i = 0; i != 4; ++i) field.update(change(w, random));
    std::size_t at = 0, different = 0;
    read(before, [&](std::uint16_t v) { different += v != values[at++] ? 1U : 0U; });
    CHECK(different == 0);
    CHECK(w.difference(field) == "");
  }
}

TEST_CASE("Long reach and long thin worlds") {
  const bool outside = GENERATE(false, true);
  const int reach = GENERATE(60, 127, 181);
  random_bits random{11};
  world w{somewhere, {8, 4, 400}, outside};
  squared_distances field{reach, cells, outside};
  field.update(w.octants());
  for (int i = 0; i != 6; ++i) {
    field.update(change(w, random));
    std::string wrong;  // along the axis of the world, by all pairs
    for (int z = 0; z < 400; z += 7) {
      int best = squared_distances::far;
      for (int dz = -reach; dz <= reach; ++dz)
        for (int y = -reach; y <= reach; ++y) {
          if (y * y + dz * dz > reach * reach || (!outside && (y < -2 || y > 2))) continue;
          for (int x = 0; x != 8; ++x)
            if (w.is_obstacle(x, 2 + y, z + dz)) best = std::min(best, (x - 3) * (x - 3) + y * y + dz * dz);
        }
      if (outside) best = std::min({best, 4 * 4, 3 * 3});
      if (best > reach * reach) best = squared_distances::far;
      if (field.squared(w.key(3, 2, z)) != best)
        wrong += std::to_string(z) + ": " + std::to_string(field.squared(w.key(3, 2, z))) + ", not " +
                 std::to_string(best) + "\n";
    }
    CHECK(wrong == "");
  }
}

TEST_CASE("All instruction sets give the same distances") {
  const bool outside = GENERATE(false, true);
  const int reach = GENERATE(3, 17, 181);
  const auto values_at = [&](simd::level l) {
    const simd::level_limit limit{l};
    random_bits random{21};
    world w{somewhere, {20, 12, 16}, outside};
    squared_distances field{reach, cells, outside};
    field.update(w.octants());
    std::map<std::array<std::uint32_t, 3>, std::vector<std::uint16_t>> bricks;
    for (int i = 0; i != 12; ++i) field.update(change(w, random));
    field.for_each_brick([&](const voxel_key& low, auto values) {
      bricks[{low.x, low.y, low.z}].assign(values.begin(), values.end());
    });
    return bricks;
  };
  const auto expected = values_at(simd::level::portable);
  CHECK(expected.size() > 8);
  for (const simd::level l : simd::available_levels()) CHECK(values_at(l) == expected);
}

TEST_CASE("Long reach along x and along y") {
  const bool outside = GENERATE(false, true);
  const int reach = GENERATE(60, 181);
  const std::size_t axis = GENERATE(0U, 1U);
  CAPTURE(outside, reach, axis);
  // A free box that is long along the axis, and a few obstacles that come and go near its ends and in between.
  std::array<int, 3> size{8, 8, 8};
  size[axis] = 440;
  world w{somewhere, size, outside};
  for (int z = 0; z != size[2]; ++z)
    for (int y = 0; y != size[1]; ++y)
      for (int x = 0; x != size[0]; ++x) w.at(x, y, z) = 0;
  squared_distances field{reach, cells, outside};
  field.update(w.octants());
  random_bits random{12};
  std::vector<std::array<int, 3>> obstacles;
  for (const int place : {3, 190, 439, 436, 0, 220, 190, 3}) {
    std::array<int, 3> p{};
    for (std::size_t i = 0; i != 3; ++i) p[i] = static_cast<int>(random.below(8));
    p[axis] = place;
    const auto known =
        std::find_if(obstacles.begin(), obstacles.end(), [&](const auto& o) { return o[axis] == place; });
    if (known != obstacles.end()) {
      p = *known;
      obstacles.erase(known);
    } else {
      obstacles.push_back(p);
    }
    w.at(p[0], p[1], p[2]) = static_cast<char>(known == obstacles.end() || w.at(p[0], p[1], p[2]) == 0);
    field.update(std::vector{w.octant(p[0], p[1], p[2])});
    std::string wrong;
    const int margin = outside ? 4 : reach + 3;
    for (int at = -margin; at < 440 + margin; at += outside ? 1 : 3)
      for (const int side : {0, 5}) {
        std::array<int, 3> q{side, side, 3};
        q[axis] = at;
        int best = squared_distances::far;
        for (const auto& o : obstacles) {
          int d = 0;
          for (std::size_t i = 0; i != 3; ++i) d += (q[i] - o[i]) * (q[i] - o[i]);
          best = std::min(best, d);
        }
        if (outside)
          for (std::size_t i = 0; i != 3; ++i) {
            const int edge = std::max(0, std::min(q[i] + 1, size[i] - q[i]));
            best = std::min(best, edge * edge);
          }
        if (best > reach * reach) best = squared_distances::far;
        const int found = field.squared(w.key(q[0], q[1], q[2]));
        if (found != best)
          wrong += std::to_string(at) + ": " + std::to_string(found) + ", not " + std::to_string(best) + "\n";
      }
    CHECK(wrong == "");
  }
}

TEST_CASE("A large free box with a long reach") {
  // Distances to the walls of a box of 64 x 72 x 48 voxels, and to one obstacle in it that comes and goes.
  world w{somewhere, {64, 72, 48}, true};
  const auto fill = [&](char c) {
    for (int z = 0; z != 48; ++z)
      for (int y = 0; y != 72; ++y)
        for (int x = 0; x != 64; ++x) w.at(x, y, z) = c;
  };
  fill(0);
  squared_distances field{90, cells, true};
  field.update(w.octants());
  const auto check = [&] {
    const bool is_there = w.at(30, 41, 20) != 0;
    std::size_t wrong = 0;
    for (int z = -1; z != 49; ++z)
      for (int y = -1; y != 73; ++y)
        for (int x = -1; x != 65; ++x) {
          const int wall = std::max(0, std::min({x + 1, 64 - x, y + 1, 72 - y, z + 1, 48 - z}));
          const int d = (x - 30) * (x - 30) + (y - 41) * (y - 41) + (z - 20) * (z - 20);
          wrong += field.squared(w.key(x, y, z)) != (is_there ? std::min(wall * wall, d) : wall * wall) ? 1U : 0U;
        }
    CHECK(wrong == 0);
  };
  check();
  const std::size_t bricks = field.brick_count();
  for (const char c : {char{1}, char{0}}) {
    w.at(30, 41, 20) = c;
    field.update(std::vector{w.octant(30, 41, 20)});
    check();
  }
  CHECK(field.brick_count() == bricks);
  fill(1);
  field.update(w.octants());
  CHECK(field.brick_count() == 0);
}

TEST_CASE("Obstacles at the borders of the grid") {
  const bool outside = GENERATE(false, true);
  const int reach = GENERATE(5, 20);
  CAPTURE(outside, reach);
  constexpr std::uint32_t small = 32;
  // All of a small grid: beyond it is `outside`, and there is nothing to store.
  world w{{0, 0, 0}, {32, 32, 32}, outside};
  squared_distances field{reach, small, outside};
  field.update(w.octants());
  random_bits random{17};
  const auto check = [&] {
    std::string wrong;
    for (int i = 0; i != 400; ++i) {
      std::array<int, 3> q{};
      for (int& c : q) c = static_cast<int>(random.below(32));
      int best = squared_distances::far;
      for (int z = 0; z != 32; ++z)
        for (int y = 0; y != 32; ++y)
          for (int x = 0; x != 32; ++x)
            if (w.at(x, y, z) != 0)
              best = std::min(best, (x - q[0]) * (x - q[0]) + (y - q[1]) * (y - q[1]) + (z - q[2]) * (z - q[2]));
      if (outside)
        for (const int c : q) best = std::min({best, (c + 1) * (c + 1), (32 - c) * (32 - c)});
      if (best > reach * reach) best = squared_distances::far;
      const voxel_key k = w.key(q[0], q[1], q[2]);
      if (field.squared(k) != best) wrong += "wrong at " + std::to_string(q[0]) + " " + std::to_string(q[1]) + "\n";
      if (const auto nearest = field.nearest(k); nearest.has_value() != (best != squared_distances::far))
        wrong += "no nearest obstacle\n";
    }
    CHECK(wrong == "");
  };
  for (int z = 0; z != 32; ++z)
    for (int y = 0; y != 32; ++y)
      for (int x = 0; x != 32; ++x) w.at(x, y, z) = 0;
  field.update(w.octants());
  check();
  for (const std::array<int, 3> corner : {std::array{0, 0, 0}, {31, 0, 31}, {31, 31, 31}, {0, 16, 31}, {31, 15, 0}})
    for (const char c : {char{1}, char{0}, char{1}}) {
      w.at(corner[0], corner[1], corner[2]) = c;
      field.update(std::vector{w.octant(corner[0], corner[1], corner[2])});
      check();
    }
  field.for_each_brick([&](const voxel_key& low, auto&&) { CHECK(std::max({low.x, low.y, low.z}) < small); });
  // Beyond the grid is what lies elsewhere.
  CHECK(field.squared({small, 0, 0}) == field.elsewhere());
}

TEST_CASE("Memory is given back") {
  const bool outside = GENERATE(false, true);
  CAPTURE(outside);
  random_bits random{31};
  world w{somewhere, {120, 120, 120}, outside};
  squared_distances field{10, cells, outside};
  const std::size_t at_first = field.memory_bytes();
  const auto turn_some = [&] {  // something is free, something is an obstacle, everywhere
    for (int z = 0; z != 120; ++z)
      for (int y = 0; y != 120; ++y)
        for (int x = 0; x != 120; ++x)
          w.at(x, y, z) = static_cast<char>(outside ? random.below(60) == 0 : random.below(800) == 0);
    field.update(w.octants());
  };
  turn_some();
  turn_some();
  // What bricks take, with little beside them; buffers of the size of the field are gone.
  const double each = static_cast<double>(field.memory_bytes()) / static_cast<double>(field.brick_count());
  CHECK(field.brick_count() > 3000);
  CHECK(each > 2750.0);
  CHECK(each < 2950.0 + 300.0);  // buffers are an eighth at most
  const nav::squared_distance_view before = field.view();
  const std::uint16_t value = before.squared(w.key(60, 60, 60));
  for (int z = 0; z != 120; ++z)
    for (int y = 0; y != 120; ++y)
      for (int x = 0; x != 120; ++x) w.at(x, y, z) = char{outside};
  field.update(w.octants());
  CHECK(field.brick_count() == 0);
  CHECK(before.brick_count() > 3000);
  CHECK(before.squared(w.key(60, 60, 60)) == value);
  CHECK(field.squared(w.key(60, 60, 60)) == field.elsewhere());
  CHECK(field.memory_bytes() < at_first + (std::size_t{1} << 21U));
  // One obstacle, or one free voxel, that wanders: bricks follow it, across their blocks.
  std::size_t most = 0;
  for (int x = 0; x != 120; ++x) {
    std::vector<octant_obstacles> changed;
    if (x != 0) {
      w.at(x - 1, 60, 60) = char{outside};
      changed.push_back(w.octant(x - 1, 60, 60));
    }
    w.at(x, 60, 60) = char{!outside};
    if (x % 4 == 0 || changed.empty())
      changed.push_back(w.octant(x, 60, 60));
    else
      changed.back() = w.octant(x, 60, 60);
    field.update(changed);
    most = std::max(most, field.brick_count());
    CHECK(field.squared(w.key(x, 60, 60)) == (outside ? 1 : 0));
  }
  CHECK(most <= (outside ? 1U : 64U));
  CHECK(w.difference(field) == "");
}

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <orbis/core/random.hpp>
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

// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/nav/robot_shape.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/overlap.hpp>

#include "support/catch.hpp"

using namespace orbis;
using octree::occupancy;
using octree::voxel_key;

namespace elsewhere {

/// Somebody's dense grid: a byte for each voxel of a box. It cannot be copied, and knows nothing of octants.
class dense_grid {
 public:
  enum cell : char { nothing_known, empty, full };

  dense_grid(double cell_size, std::array<int, 3> first, std::array<int, 3> size)
      : cell_size_{cell_size}, first_{first}, size_{size}, cells_(count(), nothing_known) {}
  dense_grid(const dense_grid&) = delete;
  dense_grid& operator=(const dense_grid&) = delete;

  [[nodiscard]] double cell_size() const { return cell_size_; }
  [[nodiscard]] const std::array<int, 3>& first() const { return first_; }
  [[nodiscard]] const std::array<int, 3>& size() const { return size_; }
  [[nodiscard]] bool contains(const std::array<int, 3>& p) const {
    for (std::size_t i = 0; i != 3; ++i)
      if (p[i] < first_[i] || p[i] >= first_[i] + size_[i]) return false;
    return true;
  }
  [[nodiscard]] cell at(const std::array<int, 3>& p) const { return contains(p) ? cells_[place(p)] : nothing_known; }
  void set(const std::array<int, 3>& p, cell c) { cells_[place(p)] = c; }

 private:
  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(size_[0] * size_[1] * size_[2]); }
  [[nodiscard]] std::size_t place(const std::array<int, 3>& p) const {
    return static_cast<std::size_t>(((p[2] - first_[2]) * size_[1] + p[1] - first_[1]) * size_[0] + p[0] - first_[0]);
  }

  double cell_size_;
  std::array<int, 3> first_, size_;
  std::vector<cell> cells_;
};

}  // namespace elsewhere

template <>
struct orbis::nav::map_access<elsewhere::dense_grid> {
  static constexpr int middle = 32768;

  [[nodiscard]] static octree::voxel_grid grid(const elsewhere::dense_grid& map) {
    return octree::voxel_grid{map.cell_size()};
  }
  [[nodiscard]] static auto octants(const elsewhere::dense_grid& map) {
    return [&map](const octree::voxel_key& k) {
      octree::octant_states states;
      for (unsigned i = 0; i != 64; ++i) {
        const octree::voxel_key o = octree::morton_key(i);
        const auto along = [](std::uint32_t octant, std::uint32_t in) {
          return static_cast<int>((octant & ~3U) + in) - middle;
        };
        const auto c = map.at({along(k.x, o.x), along(k.y, o.y), along(k.z, o.z)});
        states.known |= std::uint64_t{c != elsewhere::dense_grid::nothing_known} << i;
        states.occupied |= std::uint64_t{c == elsewhere::dense_grid::full} << i;
      }
      return states;
    };
  }
  template <class Visit>
  static void for_each_octant(const elsewhere::dense_grid& map, Visit&& visit) {
    const auto read = octants(map);
    const auto first = [&](std::size_t i) { return static_cast<std::uint32_t>(map.first()[i] + middle) & ~3U; };
    const auto last = [&](std::size_t i) {
      return static_cast<std::uint32_t>(map.first()[i] + map.size()[i] - 1 + middle);
    };
    for (std::uint32_t z = first(2); z <= last(2); z += 4)
      for (std::uint32_t y = first(1); y <= last(1); y += 4)
        for (std::uint32_t x = first(0); x <= last(0); x += 4)
          if (const auto states = read({x, y, z}); states.known != 0) visit(octree::voxel_key{x, y, z}, 2, states);
  }
};

namespace {

using elsewhere::dense_grid;

static_assert(nav::planning_map<dense_grid>);
static_assert(nav::planning_map<octree::occupancy_octree<>>);
static_assert(!std::copy_constructible<dense_grid>);
static_assert(!nav::planning_map<std::vector<vec3>>);

/// The same in an octree.
octree::occupancy_octree<> octree_of(const dense_grid& dense) {
  octree::occupancy_octree<> map{dense.cell_size()};
  nav::map_access<dense_grid>::for_each_octant(dense,
                                               [&](const voxel_key& k, int, const octree::octant_states& states) {
                                                 map.edit_octant(k, [&](octree::block<float>& voxels) {
                                                   voxels.known = states.known;
                                                   for (unsigned i = 0; i != 64; ++i)
                                                     voxels.value[i] = (states.occupied >> i & 1U) != 0 ? 1.0F : -1.0F;
                                                 });
                                               });
  return map;
}

}  // namespace

TEST_CASE("A field of somebody's own map is that of an octree with the same content") {
  const nav::distance_field_options options{.reach = 0.6, .unknown = GENERATE(occupancy::occupied, occupancy::free)};
  random_bits random{1};
  dense_grid dense{0.1, {-13, -6, 2}, {30, 21, 17}};
  nav::distance_field field{dense, options};
  CHECK(field.voxels().brick_count() == 0);
  for (int round = 0; round != 5; ++round) {
    for (int i = 0; i != 4000; ++i) {
      std::array<int, 3> p{};
      for (std::size_t j = 0; j != 3; ++j)
        p[j] = dense.first()[j] + static_cast<int>(random.below(static_cast<std::uint32_t>(dense.size()[j])));
      const auto what = random.below(20);
      dense.set(p, what == 0 ? dense_grid::full : what == 1 ? dense_grid::nothing_known : dense_grid::empty);
    }
    field.update(dense);
    const nav::distance_field expected{octree_of(dense), options};
    CHECK(field.voxels().brick_count() == expected.voxels().brick_count());
    std::size_t compared = 0, different = 0;
    expected.voxels().for_each_brick([&](const voxel_key& low, auto values) {
      for (std::uint32_t i = 0; i != 512; ++i, ++compared)
        different += field.voxels().squared({low.x + (i & 7U), low.y + (i >> 3U & 7U), low.z + (i >> 6U)}) != values[i]
                         ? 1U
                         : 0U;
    });
    CHECK(compared > 10000);
    CHECK(different == 0);
  }
}

TEST_CASE("Planning on somebody's own map is that on an octree with the same content") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  random_bits random{2};
  dense_grid dense{0.1, {-13, -6, 2}, {30, 21, 17}};
  const auto place = [&] {
    std::array<int, 3> p{};
    for (std::size_t j = 0; j != 3; ++j)
      p[j] = dense.first()[j] + static_cast<int>(random.below(static_cast<std::uint32_t>(dense.size()[j])));
    return p;
  };
  for (int i = 0; i != 200000; ++i) dense.set(place(), dense_grid::empty);
  for (int i = 0; i != 100; ++i) dense.set(place(), i % 10 == 0 ? dense_grid::nothing_known : dense_grid::full);
  const auto map = octree_of(dense);
  const nav::distance_field field{dense, {.reach = 0.5, .unknown = unknown}};
  const auto point = [&] {
    return vec3{random.uniform(-1.6, 2.0), random.uniform(-0.9, 1.8), random.uniform(0.0, 2.1)};
  };
  std::array<int, 2> seen{};
  std::size_t found = 0, bends = 0;
  const auto compare = [&](const auto& shape, const nav::planning_options& options) {
    const nav::planning_view theirs{dense, field, shape, options};
    const nav::planning_view ours{map, field, shape, options};
    static_assert(!std::same_as<decltype(theirs), decltype(ours)>);
    for (int i = 0; i != 2000; ++i) {
      const vec3 a = point(), b = i % 2 == 0 ? point() : a;
      const bool expected = !overlaps(map, swept(shape, a, b), {.unknown = unknown});
      ++seen[expected ? 1 : 0];
      CHECK(theirs.is_free(a, b) == expected);
      const voxel_key k = *map.grid().key(a);
      CHECK(theirs.density(k) == ours.density(k));
    }
    for (int i = 0; i != 10; ++i) {
      vec3 a = point(), b = point();
      while (!ours.is_free(a) || !ours.is_free(b)) a = point(), b = point();
      const auto expected = nav::find_path(ours, a, b, {.max_expanded = 5000});
      const auto path = nav::find_path(theirs, a, b, {.max_expanded = 5000});
      CHECK(path.status == expected.status);
      CHECK(path.points == expected.points);
      if (path.status == nav::path_status::found) ++found, bends += path.points.size() - 2;
    }
  };
  compare(nav::ball{0.13}, {});
  compare(nav::vertical_cylinder{0.12, -0.05, 0.2}, {.unknown_cost = 2.0});
  CHECK(seen[0] > 400);
  CHECK(seen[1] > 400);
  CHECK(found > 5);
  CHECK(bends > 5);
  // Across the border of the grid, and beyond it.
  const nav::distance_field empty{map.grid(), {.reach = 0.5, .unknown = unknown}};
  const dense_grid nothing{0.1, {0, 0, 0}, {1, 1, 1}};
  const nav::planning_view view{nothing, empty, 0.2};
  const double edge = 0.1 * map.grid().cells() / 2;
  CHECK(view.is_free(vec3{edge - 0.1, 0.0, 0.0}) == (unknown == occupancy::free));
  CHECK(view.is_free(vec3{2 * edge, 0.0, 0.0}) == (unknown == occupancy::free));
}

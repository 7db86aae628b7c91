// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <map>
#include <tuple>

#include <orbis/core/random.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/octants.hpp>

#include "support/catch.hpp"

using namespace orbis;
using octree::octant_states;
using octree::voxel_key;

namespace {

using map_type = octree::occupancy_octree<>;

/// Voxels, octants, bricks and leaves bigger than a brick.
map_type random_map(random_bits& random) {
  map_type map{0.1};
  const auto key = [&](std::uint32_t multiple) {
    const auto along = [&] { return 32768 - 64 + random.below(128) / multiple * multiple; };
    return voxel_key{along(), along(), along()};
  };
  const auto value = [&] { return random.below(2) != 0 ? 0.85F : -0.4F; };
  map.set_unknown_node({32768, 32768, 32768}, 16 - 5, value());
  map.set_unknown_node({32768 + 32, 32768, 32768}, 16 - 4, value());
  for (int i = 0; i != 300; ++i) {
    const bool whole = random.below(3) == 0;
    map.edit_octant(key(4), [&](octree::block<float>& b) {
      b.known = whole ? ~std::uint64_t{0} : random() & random();
      const float same = value();
      for (float& v : b.value) v = whole ? same : value();
    });
  }
  return map;
}

octant_states expected_at(const map_type& map, const voxel_key& k) {
  octant_states out;
  for (unsigned i = 0; i != 64; ++i) {
    const voxel_key o = octree::morton_key(i);
    const auto state = map.state(voxel_key{(k.x & ~3U) + o.x, (k.y & ~3U) + o.y, (k.z & ~3U) + o.z});
    if (state != octree::occupancy::unknown) out.known |= std::uint64_t{1} << i;
    if (state == octree::occupancy::occupied) out.occupied |= std::uint64_t{1} << i;
  }
  return out;
}

}  // namespace

TEST_CASE("Octants say what the map says voxel by voxel") {
  random_bits random{5};
  const map_type map = random_map(random);
  octree::octant_reader read{map};
  for (int i = 0; i != 3000; ++i) {
    const auto along = [&] { return 32768 - 80 + random.below(160); };
    const voxel_key k{along(), along(), along()};
    CHECK(read(k) == expected_at(map, k));
  }
}

TEST_CASE("All octants of a map are visited once") {
  random_bits random{6};
  const map_type map = random_map(random);
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, octant_states> seen;
  octree::for_each_octant(map, [&](const voxel_key& low, int level, const octant_states& states) {
    const std::uint32_t cells = octree::node_cells(level);
    for (std::uint32_t z = 0; z != cells; z += 4)
      for (std::uint32_t y = 0; y != cells; y += 4)
        for (std::uint32_t x = 0; x != cells; x += 4)
          CHECK(seen.try_emplace({low.x + x, low.y + y, low.z + z}, states).second);
  });
  std::size_t known = 0;
  for (std::uint32_t z = 32768 - 80; z != 32768 + 80; z += 4)
    for (std::uint32_t y = 32768 - 80; y != 32768 + 80; y += 4)
      for (std::uint32_t x = 32768 - 80; x != 32768 + 80; x += 4) {
        const octant_states expected = expected_at(map, {x, y, z});
        const auto found = seen.find({x, y, z});
        if (expected.known == 0) {
          CHECK(found == seen.end());
        } else {
          ++known;
          CHECK((found != seen.end() && found->second == expected));
        }
      }
  CHECK(known == seen.size());
}

TEST_CASE("Octants in a box are those of the map that have a voxel in it") {
  random_bits random{8};
  const map_type map = random_map(random);
  using place = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, int>;
  for (int round = 0; round != 50; ++round) {
    octree::key_box box;
    const auto along = [&](std::uint32_t& low, std::uint32_t& high) {
      low = 32768 - 80 + random.below(150);
      high = low + random.below(60);
    };
    along(box.low.x, box.high.x);
    along(box.low.y, box.high.y);
    along(box.low.z, box.high.z);
    std::map<place, octant_states> expected, found;
    octree::for_each_octant(map, [&](const voxel_key& k, int level, const octant_states& states) {
      if (box.overlaps(k, level)) expected[{k.x, k.y, k.z, level}] = states;
    });
    octree::for_each_octant(map, box, [&](const voxel_key& k, int level, const octant_states& states) {
      CHECK(found.try_emplace({k.x, k.y, k.z, level}, states).second);
    });
    CHECK(found == expected);
  }
}

// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <cstdint>
#include <set>
#include <tuple>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/rays/plane_crossings.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("A mark in a plane frees the voxels on both sides, one in a layer its own voxel") {
  random_bits random{405};
  for (std::size_t axis = 0; axis != 3; ++axis)
    for (const std::int32_t step : {1, -1}) {
      stack_placement at;
      at.axis = axis;
      at.step = step;
      at.start = {1004, 1012, 1020};
      plane_stack stack;
      stack.first = 1;
      stack.count = 6;
      at.last = stack.first + stack.count - 2;
      stack.log2_width = 1;
      at.width = at.rows = 16;
      stack.low_u = -4;  // so that maps begin with a brick
      stack.low_v = -4;
      stack.size = std::size_t{at.rows} * 8 << stack.log2_width;
      stack.stride = stack.size + 64;
      std::vector<std::uint8_t> bytes(2 * static_cast<std::size_t>(stack.count) * stack.stride);
      stack.planes = bytes.data();
      stack.layers = bytes.data() + static_cast<std::size_t>(stack.count) * stack.stride;
      std::array<std::int32_t, 3> start = at.start;
      start[at.axis_u()] = at.start[at.axis_u()] = 1012;
      start[at.axis_v()] = at.start[at.axis_v()] = 1020;

      std::set<std::tuple<std::int32_t, std::int32_t, std::int32_t>> expected;
      const auto expect = [&](std::int32_t layer, std::int32_t u, std::int32_t v) {
        if (layer < stack.first || layer > at.last) return;
        std::array<std::int32_t, 3> k = start;
        k[axis] += step * layer;
        k[at.axis_u()] += u;
        k[at.axis_v()] += v;
        expected.emplace(k[0], k[1], k[2]);
      };
      for (int i = 0; i != 40; ++i) {
        const auto plane = static_cast<std::int32_t>(random.below(5));
        const auto u = static_cast<std::int32_t>(random.below(16)) - 4,
                   v = static_cast<std::int32_t>(random.below(16)) - 4;
        const std::size_t cell = static_cast<std::size_t>(plane) * stack.stride + stack.cell(u, v);
        if (i % 2 == 0) {
          stack.planes[cell] = plane_stack::marked;  // between the layers before and behind it
          expect(stack.first + plane - 1, u, v);
          expect(stack.first + plane, u, v);
        } else {
          stack.layers[cell] = plane_stack::marked;
          expect(stack.first + plane, u, v);
        }
      }
      scan_masks masks;
      move_to_masks(stack, at, masks);
      std::set<std::tuple<std::int32_t, std::int32_t, std::int32_t>> found;
      for (const scan_brick& b : masks.bricks())
        for_each_place(b.free, [&](std::uint32_t place) {
          const voxel_key low = named_key(b.name), in = voxel_in_brick(place);
          found.emplace(low.x + in.x, low.y + in.y, low.z + in.z);
        });
      CHECK(found == expected);
    }
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>

#include <orbis/camera/any.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/mapping/detail/moving/depth_cells.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::mapping::detail;

TEST_CASE("rays of a view pass through every cell that is nearer, and the view shows those at its depth") {
  for (const int width : {1, 4, 33, 259, 260}) {  // rows of 1 to 65 cells
    const camera::intrinsics k{.width = width, .height = 21, .fx = 250.0, .fy = 250.0, .cx = 0.5 * width, .cy = 10.0};
    for (const camera::any_camera& camera :
         {camera::any_camera{camera::pinhole{k}},
          camera::any_camera{camera::radial_tangential{k, {.k1 = -0.1, .k2 = 0.02, .p1 = 1e-3}}},
          camera::any_camera{camera::kannala_brandt{k, {.k1 = 0.02}}}}) {
      const cell_grid grid{camera};
      const auto wall = [&](std::uint16_t millimetres) {
        const image<std::uint16_t> depth(width, 21, millimetres);
        depth_cells cells;
        cells.take(seq, camera::depth_view{depth, 1000.0}, grid);
        return cells;
      };
      const depth_cells near = wall(1000), far = wall(2000);
      for (const simd::level level : simd::available_levels()) {
        const simd::level_limit limit{level};
        CAPTURE(width, camera.model_name());
        const auto count = [&](const depth_cells& of, const depth_cells& by, visibility wanted) {
          std::size_t found = 0, other = 0;
          of.ask(
              seq, by, grid, camera, se3{}, 1.0F, [](float) { return 0.05F; },
              [&](std::size_t, visibility v) { (v == wanted ? found : other) += 1; });
          CHECK(other == 0);
          return found;
        };
        CHECK(count(near, near, visibility::shown) == grid.size());
        CHECK(count(near, far, visibility::through) == grid.size());
        CHECK(count(far, near, visibility::shown) == 0);
      }
    }
  }
}

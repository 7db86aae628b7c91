// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Type-erased access to the rows of a depth image.
#pragma once

#include <orbis/camera/depth.hpp>

namespace orbis::cloud::detail {

/// Reads a row of a depth image in metres.
struct depth_row_reader {
  const void* depth = nullptr;
  void (*read)(const void* depth, int y, int width, float* out) = nullptr;
};
template <camera::depth_source Depth>
[[nodiscard]] depth_row_reader make_row_reader(const Depth& depth) noexcept {
  return {&depth, [](const void* from, int y, int width, float* out) {
            const Depth& image = *static_cast<const Depth*>(from);
            for (int x = 0; x != width; ++x) out[x] = image(x, y);
          }};
}

}  // namespace orbis::cloud::detail

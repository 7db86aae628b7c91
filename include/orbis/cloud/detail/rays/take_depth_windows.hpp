// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Definition of `depth_windows::take`.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/cloud/detail/rays/depth_rows.hpp>
#include <orbis/cloud/detail/rays/depth_windows.hpp>
#include <orbis/core/execution.hpp>

namespace orbis::cloud::detail {

template <execution_policy Policy, camera::depth_source Depth>
void depth_windows::take(const Policy& policy, const Depth& depth, int radius) {
  assert(radius >= 0);
  width_ = depth.width();
  height_ = depth.height();
  const auto width = static_cast<std::size_t>(width_);
  const auto height = static_cast<std::size_t>(height_);
  const auto r = static_cast<std::size_t>(radius);
  for (auto* plane : {&nearest_, &farthest_, &middle_, &row_nearest_, &row_farthest_}) plane->resize(width * height);
  const depth_row_kernels kernels;
  for_each_chunk(policy, height, 32, [&](std::size_t begin, std::size_t end) {
    std::vector<float> padded(width + 2 * r, 0.0F);  // no depth outside the image
    for (std::size_t y = begin; y != end; ++y) {
      read_depth_row(kernels, depth, static_cast<int>(y), padded.data() + r);
      float* const low = row_nearest_.data() + y * width;
      float* const high = row_farthest_.data() + y * width;
      std::copy_n(padded.data(), width, low);
      std::copy_n(padded.data(), width, high);
      for (std::size_t d = 1; d <= 2 * r; ++d)
        kernels.widen_range(low, high, padded.data() + d, padded.data() + d, width);
      float* const middle = middle_.data() + y * width;
      std::copy_n(padded.data() + r, width, middle);
      kernels.replace_zeros(middle, none, width);
    }
  });
  tiles_across_ = (width_ + tile - 1) / tile;
  const int tiles_down = (height_ + tile - 1) / tile;
  tile_farthest_.assign(static_cast<std::size_t>(tiles_across_ * tiles_down), none);
  static_assert(tile == 16, "a chunk of rows is a row of tiles");
  for_each_chunk(policy, height, tile, [&](std::size_t begin, std::size_t end) {
    std::vector<float> farthest(width, none);  // per column
    std::vector<float> unused(width, none);
    for (std::size_t y = begin; y != end; ++y) {
      float* const low = nearest_.data() + y * width;
      float* const high = farthest_.data() + y * width;
      const std::size_t top = y >= r ? y - r : 0;
      const std::size_t bottom = std::min(height - 1, y + r);
      std::copy_n(row_nearest_.data() + top * width, width, low);
      std::copy_n(row_farthest_.data() + top * width, width, high);
      for (std::size_t from = top + 1; from <= bottom; ++from) {
        kernels.widen_range(low, high, row_nearest_.data() + from * width, row_farthest_.data() + from * width, width);
      }
      const bool whole = y >= r && y + r < height;
      if (!whole) std::fill_n(low, width, 0.0F);
      kernels.replace_zeros(low, none, width);
      kernels.replace_zeros(high, none, width);
      kernels.widen_range(unused.data(), farthest.data(), high, high, width);
    }
    float* const tiles = tile_farthest_.data() + begin / tile * static_cast<std::size_t>(tiles_across_);
    for (std::size_t x = 0; x != width; ++x) tiles[x / tile] = std::max(tiles[x / tile], farthest[x]);
  });
}

}  // namespace orbis::cloud::detail

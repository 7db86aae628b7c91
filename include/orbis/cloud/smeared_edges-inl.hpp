// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of smeared_edges.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>

#include <orbis/cloud/smeared_edges.hpp>

namespace orbis::cloud::detail {

template <execution_policy Policy>
std::size_t read_without_smeared_edges(const Policy& policy, const depth_row_reader& depth, image_view<float> out,
                                       const smeared_edge_options& options, smeared_edge_workspace& workspace) {
  constexpr int size = smeared_edge_workspace::block_size;
  const int width = out.width(), height = out.height();
  const int across = (width + size - 1) / size, down = (height + size - 1) / size;
  const bool is_smeared =
      std::any_of(workspace.blocks.begin(), workspace.blocks.end(), [](const auto& b) { return b.length() >= 2; });
  image<std::uint8_t>& signs = workspace.signs;
  const int padded_width = (across + 2) * size, padded_height = (down + 2) * size;
  // The border stays 0. It is as wide as the longest motion, so that no access needs a test.
  if (is_smeared && (signs.width() != padded_width || signs.height() != padded_height))
    signs = image<std::uint8_t>(padded_width, padded_height);
  for_each_index(policy, static_cast<std::size_t>(height), size, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    float* const z = out.row(y).data();
    depth.read(depth.depth, y, width, z);  // the output may overwrite the input
    for (int x = 0; x != width; ++x)
      if (!(z[x] > 0.0F && z[x] <= std::numeric_limits<float>::max())) z[x] = 0.0F;
  });
  if (!is_smeared) return 0;

  const double of_difference = std::sqrt(6.0) * options.sigmas;
  const auto noise = static_cast<float>(of_difference * options.noise);
  const auto resolution = static_cast<float>(of_difference * 0.5 * options.resolution);  // rounded by half a step
  const std::ptrdiff_t stride = padded_width;
  // Calls f(block, at, x0, y) for each row of each block, also outside the image; `at`: its offset in the padded image.
  const auto for_each_row = [&](const auto& f) {
    for_each_index(policy, workspace.blocks.size(), 1, [&](std::size_t number) {
      const int x0 = static_cast<int>(number) % across * size, y0 = static_cast<int>(number) / across * size;
      for (int y = y0; y != y0 + size; ++y) f(workspace.blocks[number], (y + size) * stride + x0 + size, x0, y);
    });
  };
  // No sum contains a product, so no operations are fused, and the signs are the same on every processor.
  for_each_row([&](smeared_edge_workspace::block& b, std::ptrdiff_t at, int x0, int y) {
    std::array<std::uint8_t, size> found{};
    const int first = std::max(x0, std::abs(b.x)), last = std::min({width, x0 + size, width - std::abs(b.x)});
    if (b.length() >= 2 && first < last && std::min(y - b.y, y + b.y) >= 0 && std::max(y - b.y, y + b.y) < height) {
      const float* const here = &out(first, y);
      const float* const before = &out(first - b.x, y - b.y);
      const float* const after = &out(first + b.x, y + b.y);
      const int offset = first - x0, count = last - first;
      for (int i = 0; i != count; ++i) {
        const bool is_known = (here[i] > 0.0F) & (before[i] > 0.0F) & (after[i] > 0.0F);
        const float w = 1.0F / here[i], difference = (1.0F / before[i] + 1.0F / after[i]) - (w + w);
        const float quantised = resolution * (w * w), least = quantised < noise ? noise : quantised;
        const int sign = (difference > least ? 1 : 0) | (difference < -least ? 2 : 0);
        found[static_cast<std::size_t>(offset + i)] = static_cast<std::uint8_t>(is_known ? sign : 0);
      }
    }
    std::copy(found.begin(), found.end(), signs.pixels().data() + at);
  });
  for_each_row([&](smeared_edge_workspace::block& b, std::ptrdiff_t at, int x0, int y) {
    const int length = b.length(), reach = length / 2 + 1;  // the ends of a ramp are rounded to pixels
    if (length < 2 || y >= height) return;
    std::array<std::uint8_t, size> near{};
    for (int i = -reach; i <= reach; ++i) {
      const std::uint8_t* const there = signs.pixels().data() + at + (b.y * i / length * stride + b.x * i / length);
      for (std::size_t k = 0; k != size; ++k) near[k] |= there[k];
    }
    for (int x = x0; x != std::min(width, x0 + size); ++x) {
      if (near[static_cast<std::size_t>(x - x0)] != 3 || out(x, y) == 0.0F) continue;
      out(x, y) = 0.0F;
      ++b.removed;
    }
  });
  std::size_t removed = 0;
  for (const smeared_edge_workspace::block& b : workspace.blocks) removed += b.removed;
  return removed;
}

}  // namespace orbis::cloud::detail

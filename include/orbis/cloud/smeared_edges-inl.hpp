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
  const int width = out.width(), height = out.height();
  image<float>& inverse = workspace.inverse;
  image<std::int8_t>& signs = workspace.signs;
  if (inverse.width() != width || inverse.height() != height) {
    inverse = image<float>(width, height);
    signs = image<std::int8_t>(width, height);
  }
  const bool is_smeared =
      std::any_of(workspace.blocks.begin(), workspace.blocks.end(), [](const auto& b) { return b.length() >= 2; });
  for_each_index(policy, static_cast<std::size_t>(height), 32, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    float* const z = out.row(y).data();
    depth.read(depth.depth, y, width, z);  // the output may overwrite the input
    for (int x = 0; x != width; ++x)
      if (!(z[x] > 0.0F && z[x] <= std::numeric_limits<float>::max())) z[x] = 0.0F;
    if (!is_smeared) return;
    for (int x = 0; x != width; ++x) inverse(x, y) = z[x] > 0.0F ? 1.0F / z[x] : 0.0F;
    std::ranges::fill(signs.row(y), std::int8_t{0});
  });
  if (!is_smeared) return 0;

  constexpr int edge = smeared_edge_workspace::edge;
  const int across = (width + edge - 1) / edge, down = (height + edge - 1) / edge;
  const auto is_inside = [&](int x, int y) { return x >= 0 && x < width && y >= 0 && y < height; };
  const auto for_each_pixel = [&](std::size_t block, const auto& f) {
    const int x0 = static_cast<int>(block) % across * edge, y0 = static_cast<int>(block) / across * edge;
    for (int y = y0; y != std::min(height, y0 + edge); ++y)
      for (int x = x0; x != std::min(width, x0 + edge); ++x) f(x, y);
  };
  const double of_difference = std::sqrt(6.0) * options.sigmas;
  const auto noise = static_cast<float>(of_difference * options.noise);
  const auto resolution = static_cast<float>(of_difference * 0.5 * options.resolution);  // rounded by half a step
  for_each_index(policy, workspace.blocks.size(), 1, [&](std::size_t number) {
    smeared_edge_workspace::block& b = workspace.blocks[number];
    if (b.length() < 2) return;
    for_each_pixel(number, [&](int x, int y) {
      if (!is_inside(x - b.x, y - b.y) || !is_inside(x + b.x, y + b.y)) return;
      const float w = inverse(x, y), before = inverse(x - b.x, y - b.y), after = inverse(x + b.x, y + b.y);
      const float difference = (before + after) - (w + w);
      if (!(w > 0.0F && before > 0.0F && after > 0.0F) ||
          !(std::abs(difference) > std::max(noise, resolution * (w * w))))
        return;
      signs(x, y) = difference > 0.0F ? 1 : -1;
      (difference > 0.0F ? b.has_positive : b.has_negative) = true;
    });
  });

  for_each_index(policy, workspace.blocks.size(), 1, [&](std::size_t number) {
    smeared_edge_workspace::block& b = workspace.blocks[number];
    const int length = b.length();
    if (length < 2) return;
    bool has_positive = false, has_negative = false;
    const int column = static_cast<int>(number) % across, row = static_cast<int>(number) / across;
    for (int r = std::max(0, row - 1); r <= std::min(down - 1, row + 1); ++r)
      for (int c = std::max(0, column - 1); c <= std::min(across - 1, column + 1); ++c) {
        const smeared_edge_workspace::block& near = workspace.blocks[static_cast<std::size_t>(r * across + c)];
        has_positive = has_positive || near.has_positive;
        has_negative = has_negative || near.has_negative;
      }
    if (!has_positive || !has_negative) return;
    const int reach = length / 2 + 1;
    for_each_pixel(number, [&](int x, int y) {
      bool positive = false, negative = false;
      for (int i = -reach; i <= reach && !(positive && negative); ++i) {
        const int u = x + b.x * i / length, v = y + b.y * i / length;
        if (!is_inside(u, v)) continue;
        positive = positive || signs(u, v) > 0;
        negative = negative || signs(u, v) < 0;
      }
      if (out(x, y) == 0.0F || !positive || !negative) return;
      out(x, y) = 0.0F;
      ++b.removed;
    });
  });
  std::size_t removed = 0;
  for (const smeared_edge_workspace::block& b : workspace.blocks) removed += b.removed;
  return removed;
}

}  // namespace orbis::cloud::detail

// SPDX-License-Identifier: BSD-3-Clause
#include "voxel_colors.hpp"

#include <cmath>

namespace app {
namespace {

std::uint64_t packed_key(const orbis::octree::voxel_key& k) {
  return std::uint64_t{k.x} << 42U | std::uint64_t{k.y} << 21U | k.z;
}

}  // namespace

void voxel_colors::add(const orbis::vec3f& point, orbis::rgb8 color) {
  const auto key = grid_.key(point);
  if (!key) return;
  std::uint32_t at = index_.find(packed_key(*key));
  if (at == orbis::hash_index::none) {
    if (unused_.empty()) {
      unused_.push_back(static_cast<std::uint32_t>(sums_.size()));
      sums_.emplace_back();
    }
    at = unused_.back();
    index_.set(packed_key(*key), at);
    unused_.pop_back();
  }
  sum& s = sums_[at];
  s = {s.r + color.r, s.g + color.g, s.b + color.b, s.n + 1};
}

void voxel_colors::remove(const orbis::vec3f& point, orbis::rgb8 color) {
  const auto key = grid_.key(point);
  if (!key) return;
  const std::uint32_t at = index_.find(packed_key(*key));
  if (at == orbis::hash_index::none) return;
  sum& s = sums_[at];
  s = {s.r - color.r, s.g - color.g, s.b - color.b, s.n - 1};
  if (s.n != 0) return;
  index_.erase(packed_key(*key));
  unused_.push_back(at);
}

std::optional<orbis::rgb8> voxel_colors::mean_color(const voxel& cube) const {
  const auto cells = static_cast<int>(std::lround(static_cast<double>(cube.size) / grid_.resolution()));
  const double to_lowest = 0.5 * (cells - 1) * grid_.resolution();
  const auto lowest = grid_.key(orbis::vec3(cube.center.cast<double>().array() - to_lowest));
  if (!lowest) return std::nullopt;
  std::uint64_t r = 0, g = 0, b = 0, n = 0;
  const auto take = [&](int x, int y, int z) {
    const auto beside = [](std::uint32_t k, int by) { return k + static_cast<std::uint32_t>(by); };
    const std::uint32_t at =
        index_.find(packed_key({beside(lowest->x, x), beside(lowest->y, y), beside(lowest->z, z)}));
    if (at == orbis::hash_index::none) return;
    const sum& s = sums_[at];
    r += s.r, g += s.g, b += s.b, n += s.n;
  };
  // A large cube uses the voxels along its diagonal.
  for (int i = 0; i != cells; ++i) take(i, i, i);
  // The points, which are means or a subset of the pixels, may be in a neighbour of the voxel that the pixels occupy.
  if (n == 0)
    for (int i = 0; i != 27; ++i) take(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
  if (n == 0) return std::nullopt;
  return orbis::rgb8{static_cast<std::uint8_t>(r / n), static_cast<std::uint8_t>(g / n),
                     static_cast<std::uint8_t>(b / n)};
}

}  // namespace app

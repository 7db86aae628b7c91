// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images in memory as they are, which can be made to fail.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/mapping/depth_history.hpp>

namespace orbis::test {

struct memory_depths {
  std::map<std::uint64_t, image<std::uint16_t>> images;
  std::set<std::uint64_t> lost;  ///< frames that cannot be read
  bool full = false;             ///< `put` keeps the image and fails

  result<void> put(std::uint64_t frame, image_view<const std::uint16_t> pixels) {
    copy_pixels(pixels, images[frame]);
    if (full) return fail(errc::write_failed, "frame " + std::to_string(frame), "the disk is full");
    return {};
  }
  result<void> get(std::uint64_t frame, image<std::uint16_t>& out) const {
    const auto at = images.find(frame);
    if (at == images.end() || lost.contains(frame))
      return fail(errc::not_found, "frame " + std::to_string(frame), "no depth image is stored for this frame");
    out = at->second;
    return {};
  }
  void erase(std::uint64_t frame) { images.erase(frame); }
};
static_assert(mapping::depth_history<memory_depths>);

}  // namespace orbis::test

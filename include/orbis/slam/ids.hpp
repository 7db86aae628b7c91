// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What names the keyframes and landmarks of a map.
#pragma once

#include <cstdint>
#include <limits>

namespace orbis::slam {

/// Landmarks and keyframes are numbered in the order of their creation; numbers are never used again.
using landmark_id = std::uint32_t;
using keyframe_id = std::uint32_t;
inline constexpr std::uint32_t no_id = std::numeric_limits<std::uint32_t>::max();

}  // namespace orbis::slam

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The profiles of the option `--profile`: sets of defaults.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/slam/options.hpp>

namespace app {

/// The names of the profiles. "small" is for boards with four small cores, such as the Raspberry Pi 4.
[[nodiscard]] inline std::vector<std::string> profile_names() { return {"default", "small"}; }

/// The defaults of command-line options with `--profile small`.
struct small_settings {
  static constexpr double resolution = 0.1;       ///< --resolution, metres
  static constexpr std::size_t depth_memory = 8;  ///< --depth-memory, MB
};

/// Applies a profile to the options of SLAM. The benchmark bench/board estimates the computing time on a small board.
inline void set_profile(std::string_view profile, orbis::slam::options& o) {
  if (profile != "small") return;
  o.features.max_features = 600;
  o.features.levels = 6;
  o.local_keyframes = 20;
  o.adjustment.keyframes = 8;
  o.depth_term.points = 200;
  o.depth_term.surfaces = 8;
  o.triangulation.neighbors = 6;
  o.fusion.neighbors = 6;
  o.fusion.second_order = 3;
}

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// `--profile`: settings that go together.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/slam/options.hpp>

namespace app {

/// The default and, for boards with four small cores, such as the Raspberry Pi 4, "small".
[[nodiscard]] inline std::vector<std::string> profile_names() { return {"default", "small"}; }

/// What `--profile small` says of options of the command line that are not given.
struct small_settings {
  static constexpr double resolution = 0.1;       ///< --resolution, metres
  static constexpr std::size_t depth_memory = 8;  ///< --depth-memory, MB
};

/// What a profile says of SLAM. bench/board counts what these cost.
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

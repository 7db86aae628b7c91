// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The pictures: trajectory.png, map.png, map_unfiltered.png and filter.png (both maps side by side).
#pragma once

#include <orbis/core/result.hpp>

#include "results.hpp"
#include "view_frame.hpp"

namespace app {

/// Writes the pictures of the available results into `r.folder`.
[[nodiscard]] orbis::result<void> write_pictures(const results& r, const view_frame& frame);

}  // namespace app

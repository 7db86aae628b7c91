// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The pictures: trajectory.png, map.png and map_unfiltered.png.
#pragma once

#include <orbis/core/result.hpp>

#include "results.hpp"
#include "view_frame.hpp"

namespace app {

/// Writes what there is to draw into `r.out`.
[[nodiscard]] orbis::result<void> write_pictures(const results& r, const view_frame& frame);

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Writes report.html, a self-contained page.
#pragma once

#include <orbis/core/result.hpp>

#include "results.hpp"
#include "view_frame.hpp"

namespace app {

/// Writes report.html into `r.folder`. Browsers without WebGL 2 show map.png, if it exists.
[[nodiscard]] orbis::result<void> write_report(const results& r, const view_frame& frame);

/// The page template, report_page.html.
extern const char* const report_page;

}  // namespace app

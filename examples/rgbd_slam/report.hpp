// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// report.html: one page that needs nothing but itself.
#pragma once

#include <orbis/core/result.hpp>

#include "results.hpp"
#include "view_frame.hpp"

namespace app {

/// Writes report.html into `r.out`; shows map.png, if it is there, where a browser cannot draw.
[[nodiscard]] orbis::result<void> write_report(const results& r, const view_frame& frame);

/// The page with gaps, see report_page.html.
extern const char* const report_page;

}  // namespace app

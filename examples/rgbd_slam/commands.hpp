// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The commands of the program.
#pragma once

#include "console.hpp"
#include "settings.hpp"

namespace app {

[[nodiscard]] exit_code run_slam(const settings& s, console& console);          ///< run, demo, live
[[nodiscard]] exit_code evaluate(const settings& s, console& console);          ///< eval
[[nodiscard]] exit_code map_without_slam(const settings& s, console& console);  ///< map
[[nodiscard]] exit_code plan(const settings& s, console& console);              ///< plan
[[nodiscard]] exit_code calibrate(const settings& s, console& console);         ///< calibrate
[[nodiscard]] exit_code benchmark(const settings& s, console& console);         ///< benchmark

}  // namespace app

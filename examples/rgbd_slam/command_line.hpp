// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The command line and `--config FILE.toml`.
#pragma once

#include <variant>

#include "settings.hpp"

namespace app {

/// What is asked for, or the code to leave with: after `--help`, or after a line on stderr that
/// says what is wrong. Options on the command line override those in the file.
[[nodiscard]] std::variant<settings, exit_code> read_command_line(int argc, char** argv);

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The command line and `--config FILE.toml`.
#pragma once

#include <variant>

#include "settings.hpp"

namespace app {

/// Returns the settings, or the exit code after `--help` or after an error was printed on stderr. Options on the
/// command line override those in the file.
[[nodiscard]] std::variant<settings, exit_code> read_command_line(int argc, char** argv);

}  // namespace app

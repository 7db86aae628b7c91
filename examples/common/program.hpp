// SPDX-License-Identifier: BSD-3-Clause
//
// Start and end of a program: exit codes, one-line error messages, and handling of exceptions and signals.
#pragma once

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#if __has_include(<fcntl.h>)
#include <fcntl.h>
#endif

#include <CLI/App.hpp>

#include <orbis/core/quote.hpp>

#include "memory.hpp"
#include "report_error.hpp"

namespace examples {

/// One-line description of a command-line error. If there is an unknown option, reports it, because it may be the cause
/// of other errors, such as a missing argument.
[[nodiscard]] inline std::string describe_usage(const CLI::App& cli, const CLI::ParseError& e) {
  std::string what = e.what();
  const bool is_extra = dynamic_cast<const CLI::ExtrasError*>(&e) != nullptr;
  if (is_extra || dynamic_cast<const CLI::RequiredError*>(&e) != nullptr) {
    const std::vector<std::string> rest = cli.remaining(true);
    const auto option = std::ranges::find_if(rest, [](const std::string& word) {
      return word.size() > 1 && word[0] == '-' && !std::isdigit(static_cast<unsigned char>(word[1]));
    });
    if (option != rest.end())
      what = "unknown option " + orbis::in_quotes(*option);
    else if (is_extra && !rest.empty())
      what = "unexpected argument " + orbis::in_quotes(rest.front());
  }
  return orbis::shortened(what) + " (--help shows the usage)";
}

/// Throws if an option of the program or of the chosen commands has an invalid value that CLI11 accepts: an empty text
/// (usually a variable that is not set) where a value is required, NaN, which passes range checks, or an integer that
/// is negative or too large for its unsigned type.
inline void check_values(const CLI::App& cli) {
  for (const CLI::Option* option : cli.get_options())
    for (const std::string& text : option->results()) {
      if (text.empty() && option->get_expected_min() > 0)
        throw CLI::ValidationError{option->get_name(), "must not be empty"};
      const std::string type = option->get_type_name();
      if (double value = 0; type.starts_with("FLOAT") && CLI::detail::lexical_cast(text, value) && std::isnan(value))
        throw CLI::ValidationError{option->get_name(), orbis::in_quotes(text) + " is not a number"};
      if (!type.starts_with("UINT")) continue;
      errno = 0;
      static_cast<void>(std::strtoull(text.c_str(), nullptr, 0));
      if (text.find('-') != std::string::npos || errno == ERANGE)
        throw CLI::ValidationError{option->get_name(), orbis::in_quotes(text) + " is out of range"};
    }
  for (const CLI::App* command : cli.get_subcommands()) check_values(*command);
}

/// Parses the command line. Returns the exit code if the program must end: 0 after --help, 1 after a usage error.
[[nodiscard]] inline std::optional<int> parse(CLI::App& cli, int argc, char** argv) {
  try {
    cli.parse(argc, argv);
    check_values(cli);
    return std::nullopt;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return cli.exit(e);
    return report_error(cli.get_name().c_str(), 1, describe_usage(cli, e));
  }
}

/// Opens /dev/null in place of closed standard streams: otherwise the next files that are opened would become standard
/// streams, and messages would be written into them. Reading from and writing to these streams still fail.
inline void occupy_standard_streams() {
#if __has_include(<fcntl.h>)
  for (const int stream : {0, 1, 2})
    if (::fcntl(stream, F_GETFD) < 0) static_cast<void>(::open("/dev/null", stream == 0 ? O_WRONLY : O_RDONLY));
#endif
}

/// Runs `body`, which returns the exit code of the program. The code is 2 if the body throws, for example because no
/// memory or no thread is available, or if standard output cannot be written. A closed pipe or an exceeded file size
/// limit does not end the program. The memory of the program is limited (`limit_memory`).
template <class Body>
[[nodiscard]] int run_program(const char* program, Body&& body) {
  occupy_standard_streams();
#ifdef SIGPIPE
  std::signal(SIGPIPE, SIG_IGN);
#endif
#ifdef SIGXFSZ
  std::signal(SIGXFSZ, SIG_IGN);
#endif
  int code = 2;
  try {
    limit_memory();
    code = body();
  } catch (const std::exception& e) {
    return report_error(program, 2, describe_exception(e));
  }
  const bool is_written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  return code == 0 && !is_written ? report_error(program, 2, "standard output: cannot be written") : code;
}

}  // namespace examples

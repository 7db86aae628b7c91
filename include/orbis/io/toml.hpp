// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Settings in TOML from bytes that nobody has looked at, by toml++.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include <toml++/toml.h>

#include <orbis/core/result.hpp>

namespace orbis::io {

/// The largest text that is read. toml++ works its way down nested tables by recursion, as deep as there are dots in
/// the text; this much does not use up a stack.
inline constexpr std::size_t max_toml_bytes = 16384;

/// The table that `text` is. `where` names the source in errors. Errors: malformed, with the line where it is known (no
/// TOML; more than `max_toml_bytes`; a list of lists over several lines, whose lines could be heads of tables).
[[nodiscard]] result<toml::table> parse_toml(std::string_view text, const std::filesystem::path& where = {});

/// Reads a file of settings; see `parse_toml`. Errors: not_found, unreadable, malformed.
[[nodiscard]] result<toml::table> read_toml(const std::filesystem::path& path);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/toml-inl.hpp>
#endif

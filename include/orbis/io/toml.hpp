// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Settings in TOML from untrusted bytes, parsed by toml++.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include <toml++/toml.h>

#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>

namespace orbis::io {

/// Maximum size of a settings text in bytes. toml++ recurses into nested tables, up to one level per dot in the text;
/// texts up to this size do not overflow the stack.
inline constexpr std::size_t max_toml_bytes = 16384;

/// Parses `text` as a table. `where` names the source in errors. Errors: malformed, with the line number if known (not
/// TOML; more than `max_toml_bytes`; a list of lists over several lines that look like table headers).
/// Because of defects in toml++, two forms of valid TOML are rejected, too: keys with quotes after a dot in inline
/// tables (`x = {a."b" = 1}`), and bare keys that contain a date followed by "T" or a blank, but no time
/// (`2024-01-01Tx = 1`, `2024-01-01 = 1`).
ORBIS_LAZY [[nodiscard]] result<toml::table> parse_toml(std::string_view text, const std::filesystem::path& where = {});

/// Reads a settings file; see `parse_toml`. Errors: not_found, unreadable, malformed.
ORBIS_LAZY [[nodiscard]] result<toml::table> read_toml(const std::filesystem::path& path);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/toml-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment problems in the text format of "Bundle Adjustment in the Large". A file contains the numbers of
/// cameras, points and observations; the camera index, point index and pixel of each observation; nine numbers per
/// camera; and three numbers per point. Numbers are separated by any white space.
///
/// Source: S. Agarwal, N. Snavely, S. M. Seitz, R. Szeliski, "Bundle adjustment in the large", ECCV 2010,
/// and https://grail.cs.washington.edu/projects/bal.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>

#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/bal_problem.hpp>

namespace orbis::io {

/// Parses a problem; `where` names the source in errors. Time and memory are proportional to the length of the text,
/// regardless of the numbers in the first line. Errors, with the line number: malformed; unsupported (compressed, as
/// are the files on the project's website).
ORBIS_LAZY [[nodiscard]] result<bal_problem> parse_bal(std::string_view text, const std::filesystem::path& where = {});

/// Reads a whole stream; see `parse_bal`. Errors: unreadable, malformed, unsupported.
ORBIS_LAZY [[nodiscard]] result<bal_problem> read_bal(std::istream& in, const std::filesystem::path& where = {});

/// Reads a BAL file; see `parse_bal`. Errors: not_found, unreadable, malformed, unsupported.
ORBIS_LAZY [[nodiscard]] result<bal_problem> read_bal(const std::filesystem::path& path);

/// The problem as text, with enough digits to recover the same numbers.
/// @pre the observations' indices are in range
ORBIS_LAZY [[nodiscard]] std::string format_bal(const bal_problem& problem);

/// Writes a BAL file atomically. Errors: write_failed.
ORBIS_LAZY result<void> write_bal(const std::filesystem::path& path, const bal_problem& problem);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/bal-inl.hpp>
#endif

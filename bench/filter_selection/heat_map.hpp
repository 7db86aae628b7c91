// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "scores.hpp"

namespace orbis::bench {

/// A picture of mean F1: a row for each kind of case, a column for each setting, the automatic one first.
bool write_heat_map(const score_table& table, const std::filesystem::path& path);

}  // namespace orbis::bench

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The filters that can be asked for by name.
#pragma once

#include <string>
#include <vector>

#include <orbis/mapping/filter.hpp>

#include "settings.hpp"

namespace app {

/// What `--filter` takes.
[[nodiscard]] std::vector<std::string> filter_names();
/// The filter that was asked for. @pre s.filter is one of the names
[[nodiscard]] orbis::mapping::filter_options filter_options(const settings& s);
/// The filter that was asked for, in words.
[[nodiscard]] std::string filter_in_words(const settings& s);

}  // namespace app

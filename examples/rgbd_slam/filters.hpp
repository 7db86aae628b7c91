// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The filters of the option `--filter`.
#pragma once

#include <string>
#include <vector>

#include <orbis/mapping/filter.hpp>

#include "settings.hpp"

namespace app {

/// The values of the option `--filter`.
[[nodiscard]] std::vector<std::string> filter_names();
/// The options of the requested filter. @pre s.filter is one of the names
[[nodiscard]] orbis::mapping::filter_options filter_options(const settings& s);
/// A description of the requested filter.
[[nodiscard]] std::string describe_filter(const settings& s);

}  // namespace app

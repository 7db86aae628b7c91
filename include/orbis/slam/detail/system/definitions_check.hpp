// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whether the functions of a template can be found: in the library orbis::compiled, or because they are included.
#pragma once

namespace orbis::slam::detail {

struct of_system;       ///< the functions of `rgbd_system`
struct of_calibration;  ///< those of `calibrate`

/// Complete where the functions are included (`*_functions.hpp`), as they always are in header-only programs.
template <class Of, class...>
struct included_definitions;

/// Whether orbis::compiled holds the functions for these template arguments (detail/compiled).
template <class Of, class...>
inline constexpr bool is_compiled = false;

template <class Of, class... Ts>
concept has_definitions = is_compiled<Of, Ts...> || requires {
  sizeof(included_definitions<Of, Ts...>);
};

}  // namespace orbis::slam::detail

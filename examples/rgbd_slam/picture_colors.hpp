// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The colours of the pictures.
#pragma once

#include <orbis/core/types.hpp>

namespace app {

inline constexpr orbis::rgb8 paper{250, 250, 249}, ink{28, 32, 40}, faint{150, 155, 163}, grid{228, 230, 234};
inline constexpr orbis::rgb8 truth_color{150, 155, 163}, estimate_color{37, 99, 235}, error_color{200, 60, 50},
    start_color{22, 140, 80};

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of the recognition of loops; cmake/compiled/slam_loop_verification.cpp
/// instantiates it.
#pragma once

#include <vector>

#include <orbis/slam/detail/compiled/mapping.hpp>
#include <orbis/slam/detail/loops/loop_fusion.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

extern template loop_check loop_verification::verify(const loop_verification::snapshot<compiled_descriptor>&,
                                                     const compiled_rig&, const loop_options&);
extern template std::vector<loop_fusion::pair> loop_fusion::find_pairs(
    const loop_fusion::snapshot<compiled_descriptor>&, const compiled_rig&, const loop_fusion_options&);

}  // namespace orbis::slam::detail

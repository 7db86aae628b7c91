// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of mapping; cmake/compiled/slam_mapping.cpp instantiates it.
#pragma once

#include <cstddef>
#include <span>

#include <orbis/camera/any.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/detail/mapping/landmark_triangulation.hpp>
#include <orbis/slam/detail/mapping/map_bundle.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

using compiled_rig = camera_rig<camera::any_camera>;
using compiled_descriptor = features::binary_descriptor<256>;
using compiled_map = basic_map<compiled_descriptor>;

extern template std::size_t triangulate_landmarks(compiled_map&, keyframe_id, const compiled_rig&,
                                                  const triangulation_options&);
extern template fusion_counts fuse_into(compiled_map&, keyframe_id, std::span<const landmark_id>, const compiled_rig&,
                                        const fusion_options&);
extern template fusion_counts fuse_with_neighbors(compiled_map&, keyframe_id, const compiled_rig&,
                                                  const fusion_options&);
extern template bundle_solution bundle_solver<camera::any_camera>::solve(const bundle_snapshot&, const bundle_schedule&,
                                                                         const progress&, bundle_solution,
                                                                         const sequential_policy&);

}  // namespace orbis::slam::detail

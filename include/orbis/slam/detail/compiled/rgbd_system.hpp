// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of the SLAM system: that of a camera whose model is known at run time, with
/// the default extractor, matchers and places. cmake/compiled/slam_*.cpp instantiate it, part by part, so that none of
/// them takes much time and memory.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/loops/loop_fusion.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/detail/mapping/landmark_triangulation.hpp>
#include <orbis/slam/detail/mapping/map_bundle.hpp>
#include <orbis/slam/detail/system/back_end.hpp>
#include <orbis/slam/detail/tracking/front_end.hpp>
#include <orbis/slam/detail/tracking/tracker.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/rgbd_system.hpp>
#include <orbis/slam/sensor.hpp>

namespace orbis::slam {

extern template class basic_map<features::binary_descriptor<256>>;
extern template class rgbd_system<camera::any_camera>;

namespace detail {

using compiled_rig = camera_rig<camera::any_camera>;
using compiled_descriptor = features::binary_descriptor<256>;
using compiled_map = basic_map<compiled_descriptor>;

extern template class tracker<camera::any_camera, compiled_descriptor, orb_matchers>;
extern template class front_end<camera::any_camera, compiled_descriptor, orb_matchers, rgbd>;
extern template class local_mapper<camera::any_camera, compiled_descriptor, bag_of_words_places>;
extern template class loop_closer<camera::any_camera, compiled_descriptor, bag_of_words_places>;
extern template class back_end<camera::any_camera, compiled_descriptor, bag_of_words_places>;

extern template std::size_t triangulate_landmarks(compiled_map&, keyframe_id, const compiled_rig&,
                                                  const triangulation_options&);
extern template fusion_counts fuse_into(compiled_map&, keyframe_id, std::span<const landmark_id>, const compiled_rig&,
                                        const fusion_options&);
extern template fusion_counts fuse_with_neighbors(compiled_map&, keyframe_id, const compiled_rig&,
                                                  const fusion_options&);
extern template bundle_solution bundle_solver<camera::any_camera>::solve(const bundle_snapshot&, const bundle_schedule&,
                                                                         const progress&, bundle_solution,
                                                                         const sequential_policy&);
extern template loop_check loop_verification::verify(const loop_verification::snapshot<compiled_descriptor>&,
                                                     const compiled_rig&, const loop_options&);
extern template std::vector<loop_fusion::pair> loop_fusion::find_pairs(
    const loop_fusion::snapshot<compiled_descriptor>&, const compiled_rig&, const loop_fusion_options&);

}  // namespace detail
}  // namespace orbis::slam

// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/detail/compiled/mapping.hpp>
#include <orbis/slam/detail/mapping/local_mapper.hpp>

namespace orbis::slam::detail {

template class local_mapper<camera::any_camera, compiled_descriptor, bag_of_words_places>;
template std::size_t triangulate_landmarks(compiled_map&, keyframe_id, const compiled_rig&,
                                           const triangulation_options&);
template fusion_counts fuse_into(compiled_map&, keyframe_id, std::span<const landmark_id>, const compiled_rig&,
                                 const fusion_options&);
template fusion_counts fuse_with_neighbors(compiled_map&, keyframe_id, const compiled_rig&, const fusion_options&);
template bundle_solution bundle_solver<camera::any_camera>::solve(const bundle_snapshot&, const bundle_schedule&,
                                                                  const progress&, bundle_solution,
                                                                  const sequential_policy&);

}  // namespace orbis::slam::detail

# SPDX-License-Identifier: BSD-3-Clause
#
# The quick tier, ORBIS_TEST_TIER=quick: what `./run test` builds. Of each component the tests of the headers that the
# others stand on, as far as they compile fast with orbis::compiled: two cores build and run them in ten minutes, of which
# the library takes four. The rest is in the whole suite, `./run test all`: kernels against plain code, most recordings, the
# other readers and file formats, every header alone, tutorials, fuzz inputs, consumers.
set(ORBIS_QUICK_TESTS
  camera/allocations.cpp camera/depth.cpp camera/intrinsics.cpp camera/kannala_brandt.cpp camera/parameters.cpp
  camera/pinhole.cpp camera/presets.cpp camera/radial_tangential.cpp camera/rays.cpp camera/rgbd_frame.cpp camera/shutter.cpp
  camera/stereo.cpp camera/world_point.cpp
  cloud/allocations.cpp cloud/filter_chain.cpp cloud/filters.cpp cloud/neighbors.cpp cloud/statistical.cpp
  cloud/voxel_grid.cpp
  core/bits.cpp core/bytes.cpp core/cow_pages.cpp core/execution.cpp core/file.cpp core/hash_index.cpp core/image.cpp
  core/point.cpp core/random.cpp core/result.cpp core/se3.cpp core/sim3.cpp core/so3.cpp core/thread_pool.cpp
  core/trajectory.cpp core/types.cpp core/utf8.cpp
  eval/alignment.cpp eval/ate.cpp eval/cloud_error.cpp eval/rpe.cpp eval/scale.cpp eval/statistics.cpp
  features/allocations.cpp features/brute_force.cpp features/depth.cpp features/extractor.cpp features/hamming.cpp
  features/match.cpp features/matcher.cpp features/orb.cpp features/stages.cpp
  interop/strided_points.cpp
  io/camera_file.cpp io/image.cpp io/ply.cpp io/pcd.cpp io/png.cpp io/recording.cpp io/trajectory_file.cpp
  mapping/allocations.cpp mapping/dense_cloud.cpp mapping/depth_store.cpp mapping/keyframe.cpp mapping/live_map.cpp
  nav/path_search.cpp nav/planning_view.cpp
  octree/allocations.cpp octree/cast_ray.cpp octree/files.cpp octree/key.cpp octree/occupancy_octree.cpp
  octree/occupancy_octree_depth.cpp octree/sensor_model.cpp
  optimize/alignment.cpp optimize/allocations.cpp optimize/pnp.cpp optimize/pose_graph.cpp optimize/ransac.cpp
  optimize/robust_loss.cpp optimize/triangulation.cpp
  places/allocations.cpp places/bag_of_words.cpp places/inverted_index.cpp places/keyframe_database.cpp
  places/vocabulary.cpp places/vocabulary_tree.cpp
  slam/allocations.cpp slam/covisibility_graph.cpp slam/events.cpp slam/frame.cpp slam/ids.cpp slam/landmark.cpp
  slam/map.cpp slam/map_file.cpp slam/system.cpp slam/measure.cpp slam/spanning_tree.cpp slam/tested_system.cpp)

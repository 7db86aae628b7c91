// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Collision tests between FCL geometries (`fcl::Box`, `fcl::Convex`, a mesh as `fcl::BVHModel`, ...) and orbis
/// octrees.
///
/// Without conversion: an `fcl_shape` is a shape for `octree::overlaps`, which descends the octree and calls FCL only
/// for single boxes. The caller chooses the state of unknown space:
///
/// @code
///   const orbis::interop::fcl_shape arm{std::make_shared<fcl::Capsuled>(0.05, 0.4), T_world_arm};
///   const bool hits = orbis::octree::overlaps(map, arm, {.unknown = orbis::octree::occupancy::occupied});
/// @endcode
///
/// With conversion: `to_fcl` returns an `fcl::OcTree` for FCL's own functions and managers. It contains a copy of the
/// map as an octomap::OcTree, and FCL treats unknown space as free.
///
/// J. Pan, S. Chitta, D. Manocha, "FCL: A general purpose library for collision and proximity queries", ICRA 2012.
#pragma once

#include <cmath>
#include <memory>
#include <utility>

#include <fcl/config.h>
#include <fcl/geometry/collision_geometry.h>
#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/collision_object.h>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/interop/octomap.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/overlap.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::interop {

/// A geometry at a pose, as an `octree::overlap_shape`. A mesh consists of its triangles only: voxels entirely inside a
/// closed mesh do not overlap it. For each box, the result is that of FCL, within FCL's tolerance (1e-6 for most
/// pairs). The geometry is shared, not copied.
class fcl_shape {
 public:
  /// @pre geometry != nullptr; the pose is finite
  template <class Geometry>
  fcl_shape(std::shared_ptr<Geometry> geometry, const se3& T_world_geometry)
      : object_{std::move(geometry), to_fcl_transform(T_world_geometry)} {}

  void set_pose(const se3& T_world_geometry) {
    object_.setTransform(to_fcl_transform(T_world_geometry));
    object_.computeAABB();
  }
  [[nodiscard]] const fcl::CollisionObjectd& object() const noexcept { return object_; }

  [[nodiscard]] friend octree::bounding_box bounds_of(const fcl_shape& s) {
    return {s.object_.getAABB().min_, s.object_.getAABB().max_};
  }
  [[nodiscard]] friend bool touches(const fcl_shape& s, const octree::bounding_box& box) {
    if (!octree::touches(bounds_of(s), box)) return false;
    const fcl::Boxd theirs{vec3{box.max - box.min}};
    fcl::Transform3d pose = fcl::Transform3d::Identity();
    pose.translation() = 0.5 * (box.min + box.max);
    fcl::CollisionResultd result;
    return fcl::collide(s.object_.collisionGeometry().get(), s.object_.getTransform(), &theirs, pose,
                        fcl::CollisionRequestd{}, result) != 0;
  }

 private:
  [[nodiscard]] static fcl::Transform3d to_fcl_transform(const se3& T) {
    fcl::Transform3d out = fcl::Transform3d::Identity();
    out.linear() = T.rotation_matrix();
    out.translation() = T.translation();
    return out;
  }

  fcl::CollisionObjectd object_;
};

#if FCL_HAVE_OCTOMAP
/// Copies the map for FCL's own functions: voxels that the sensor model classifies as occupied are occupied; all other
/// space, including unknown space, is free. O(voxels); uses as much memory as an OctoMap map. Requires FCL built with
/// OctoMap.
template <octree::octomap_model Model>
[[nodiscard]] std::shared_ptr<fcl::OcTreed> to_fcl(const octree::occupancy_octree<Model>& map) {
  const std::shared_ptr<const octomap::OcTree> tree = to_octomap(map);
  auto out = std::make_shared<fcl::OcTreed>(tree);
  // A probability equal to the threshold is occupied, but FCL tests for free first and would treat it as free.
  out->setFreeThres(std::nextafter(tree->getOccupancyThres(), 0.0));
  out->computeLocalAABB();
  return out;
}
#endif

}  // namespace orbis::interop

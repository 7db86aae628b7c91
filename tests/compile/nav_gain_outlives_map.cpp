// error: deleted
// It reads the map later.
#include <orbis/camera/pinhole.hpp>
#include <orbis/nav/view_gain.hpp>
#include <orbis/octree/occupancy_octree.hpp>

void refused(const orbis::camera::pinhole& camera) {
  orbis::nav::view_gain gain{orbis::octree::occupancy_octree<>{0.1}, camera};
}

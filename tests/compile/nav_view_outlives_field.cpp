// error: deleted
// The field is kept by reference, too.
#include <orbis/nav/planning_view.hpp>
#include <orbis/octree/occupancy_octree.hpp>

void refused(const orbis::octree::occupancy_octree<>& map) {
  const orbis::nav::planning_view view{map, orbis::nav::distance_field{map}, orbis::nav::vertical_capsule{}};
}

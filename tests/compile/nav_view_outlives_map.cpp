// error: deleted
// A view of a temporary map would be left with nothing to ask.
#include <orbis/nav/planning_view.hpp>
#include <orbis/octree/occupancy_octree.hpp>

void refused(const orbis::nav::distance_field& field) {
  const orbis::nav::planning_view view{orbis::octree::occupancy_octree<>{0.1}, field, 0.2, {.clearance_weight = 1.0}};
}

// error: deleted
// A view of a temporary floor map would be left with nothing to ask.
#include <orbis/nav/floor_map.hpp>
#include <orbis/nav/floor_view.hpp>
#include <orbis/octree/occupancy_octree.hpp>

void refused(const orbis::octree::occupancy_octree<>& map) {
  const orbis::nav::floor_view view{*orbis::nav::make_floor_map(map), 0.2};
}

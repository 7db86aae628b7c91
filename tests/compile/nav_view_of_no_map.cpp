// error: planning_map
// Points are no map.
#include <vector>

#include <orbis/nav/planning_view.hpp>

void refused(const std::vector<orbis::vec3>& points, const orbis::nav::distance_field& field) {
  const orbis::nav::planning_view view{points, field, 0.2};
}

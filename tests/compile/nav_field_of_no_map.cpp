// error: planning_map
// What is no map is refused by name.
#include <vector>

#include <orbis/nav/distance_field.hpp>

void refused(orbis::nav::distance_field& field, const std::vector<orbis::vec3>& points) { field.update(points); }

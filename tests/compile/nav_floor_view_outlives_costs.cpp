// error: deleted
// The costs are kept by reference, too.
#include <orbis/nav/floor_cost.hpp>
#include <orbis/nav/floor_view.hpp>

void refused(const orbis::nav::floor_map& floor) {
  const orbis::nav::floor_view view{floor, orbis::nav::inflate(floor), {.clearance_weight = 1.0}};
}

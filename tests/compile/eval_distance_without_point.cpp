// error: distance_function
// A distance that cannot be asked about a point is refused by name.
#include <vector>

#include <orbis/eval/cloud_error.hpp>

void refused(const std::vector<orbis::vec3>& points) {
  (void)orbis::eval::cloud_to_surface(orbis::seq, points, [](int, int) { return 0.0; });
}

// error: point_range
#include <vector>

#include <orbis/octree.hpp>

int main() {
  orbis::octree::occupancy_octree<> map{0.1};
  map.integrate(std::vector<int>{1, 2, 3}, orbis::vec3{0.0, 0.0, 0.0});
}

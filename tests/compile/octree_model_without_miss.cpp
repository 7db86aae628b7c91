// error: has_constants_of_its_value_type
#include <orbis/octree.hpp>

struct no_miss {
  using value_type = float;
  static constexpr float hit = 0.8F, clamp_min = -2.0F, clamp_max = 3.5F, occupancy_threshold = 0.0F;
};
orbis::octree::occupancy_octree<no_miss> map{0.1};

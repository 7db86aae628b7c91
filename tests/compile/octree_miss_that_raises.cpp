// error: sensor_model
#include <orbis/octree.hpp>

struct upside_down : orbis::octree::log_odds<> {
  static constexpr float miss = 0.4F;
};
orbis::octree::occupancy_octree<upside_down> map{0.1};

// error: threshold_is_between_clamps
#include <orbis/octree/sensor_model.hpp>

struct never_occupied : orbis::octree::log_odds<> {
  static constexpr float occupancy_threshold = 4.0F;
};
const float v = orbis::octree::after_hit<never_occupied>(0.0F);

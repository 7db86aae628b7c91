// error: clamps_are_ordered
#include <orbis/octree/sensor_model.hpp>

struct swapped : orbis::octree::log_odds<> {
  static constexpr float clamp_min = 3.5F, clamp_max = -2.0F;
};
const float v = orbis::octree::after_hit<swapped>(0.0F);

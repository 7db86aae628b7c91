// error: hit_raises_and_miss_lowers
#include <orbis/octree/sensor_model.hpp>

struct upside_down : orbis::octree::log_odds<> {
  static constexpr float miss = 0.4F;
};
const float v = orbis::octree::after_miss<upside_down>(0.0F);

// error: has_constants_of_its_value_type
#include <orbis/octree/sensor_model.hpp>

struct mixed : orbis::octree::log_odds<> {
  static constexpr double hit = 0.85;  // where a float is meant
};
const float v = orbis::octree::after_hit<mixed>(0.0F);

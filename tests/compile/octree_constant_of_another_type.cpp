// error: has_constants_of_its_value_type
#include <orbis/octree/sensor_model.hpp>

struct mixed : orbis::octree::log_odds<std::int16_t> {
  static constexpr double hit = 0.85;  // log-odds, where units are meant
};
const std::int16_t v = orbis::octree::after_hit<mixed>(0);

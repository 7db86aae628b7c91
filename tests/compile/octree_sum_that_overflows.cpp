// error: sums_fit_value_type
// 120 + 23 is more than an int8_t holds.
#include <orbis/octree/sensor_model.hpp>

struct far_reaching : orbis::octree::log_odds<std::int8_t> {
  static constexpr std::int8_t clamp_max = 120;
};
const std::int8_t v = orbis::octree::after_hit<far_reaching>(0);

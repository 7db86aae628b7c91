// error: scale_is_positive
#include <orbis/octree/sensor_model.hpp>

struct no_scale {
  using value_type = std::int16_t;
  static constexpr std::int16_t hit = 8, miss = -4, clamp_min = -20, clamp_max = 35, occupancy_threshold = 0;
};
const std::int16_t v = orbis::octree::after_hit<no_scale>(0);

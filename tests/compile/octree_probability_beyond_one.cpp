// error: sensor_probabilities
#include <orbis/octree/sensor_model.hpp>

struct percent : orbis::octree::octomap_probabilities {
  static constexpr double hit = 70.0;
};
const float hit = orbis::octree::sensor_model_from<percent>::hit;

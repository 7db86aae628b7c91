// error: model_decay_policy
#include <orbis/octree/decay.hpp>

struct halving {
  float operator()(float v) const { return v / 2; }
};
orbis::octree::occupied_only<halving> policy;

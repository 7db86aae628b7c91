// error: robust_loss[<']
// A loss that has a cost but no weight is refused by name.
#include <orbis/optimize/pose_graph.hpp>

struct costly {
  double cost(double squared) const { return squared; }
};

using refused = orbis::optimize::pose_graph_solver<orbis::se3, costly>;
refused* made();

// error: satisf[a-z]+( of)? [^a-z ]+damping_policy
// A way to step that keeps no state between its steps says so.
#include <orbis/optimize/pose_graph.hpp>

struct stateless {
  template <class Problem>
  orbis::optimize::step_outcome advance(int&, Problem&, orbis::optimize::step_workspace&) const;
};

using refused = orbis::optimize::pose_graph_solver<orbis::se3, orbis::optimize::huber, stateless>;
refused* made();

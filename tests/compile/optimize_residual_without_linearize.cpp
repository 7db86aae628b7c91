// error: satisf[a-z]+( of)? [^a-z ]+bundle_residual
// A residual that cannot be linearised is refused by name.
#include <orbis/optimize/bundle_adjustment.hpp>

struct only_a_value {
  using camera_state = orbis::se3;
  using camera_manifold = orbis::optimize::lie_group<orbis::se3>;
  using observation = orbis::optimize::bundle_observation;
  using view = orbis::se3;
  static constexpr int dimension = 2;
  static view prepare(const camera_state& s) { return s; }
  static bool is_usable(const observation&) { return true; }
  std::optional<orbis::vec2> residual(const view&, const orbis::vec3&, const observation&) const;
};

using refused = orbis::optimize::bundle_adjuster<only_a_value>;
refused* made();

// error: robust_loss[<']
// A loss that has a cost but no weight is refused by name.
#include <orbis/camera/pinhole.hpp>
#include <orbis/optimize/pose_refinement.hpp>

struct costly {
  double cost(double squared) const { return squared; }
};

void refused(const orbis::camera::pinhole& camera) {
  const orbis::optimize::reprojection model{camera, 40.0};
  (void)orbis::optimize::refine_pose({}, model, {}, {}, {}, costly{});
}

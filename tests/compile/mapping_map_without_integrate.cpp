// error: depth_map
// A map that takes in no depth images cannot be built of keyframes.
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/mapping/batch.hpp>

struct no_map {
  explicit no_map(double) {}
};

void refused(const std::vector<orbis::mapping::keyframe<>>& keyframes, const orbis::camera::pinhole& camera) {
  (void)orbis::mapping::build_map<no_map>(orbis::seq, keyframes, camera);
}

// error: keyframe_range|keyframe_like
// A keyframe that does not say where it was cannot be mapped.
#include <cstdint>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/mapping/batch.hpp>

struct unposed {
  orbis::camera::depth_view<std::uint16_t> depth;
  orbis::image_view<const orbis::rgb8> color;
};

void refused(const std::vector<unposed>& keyframes, const orbis::camera::pinhole& camera) {
  (void)orbis::mapping::build_map(orbis::seq, keyframes, camera);
}

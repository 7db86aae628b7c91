// error: feature_extractor[<']
// An extractor that does not give features is refused by name.
#include <orbis/camera/pinhole.hpp>
#include <orbis/slam/system.hpp>

struct empty_handed {
  int operator()(orbis::image_view<const orbis::rgb8>) const { return 0; }
};

void refused(const orbis::camera::pinhole& camera) {
  orbis::slam::rgbd_system<orbis::camera::pinhole, empty_handed> slam{camera, {}, {}};
}

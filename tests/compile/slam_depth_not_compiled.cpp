// error: does not hold `track` for this type of depth: include <orbis/slam/definitions\.hpp>
// With orbis::compiled, depth of a type that the library does not hold needs the functions of the system.
#include <orbis/camera/any.hpp>
#include <orbis/slam/rgbd_system.hpp>

struct plane {
  [[nodiscard]] int width() const { return 640; }
  [[nodiscard]] int height() const { return 480; }
  float operator()(int, int) const { return 1.0F; }
};

void refused(orbis::slam::rgbd_system<orbis::camera::any_camera>& slam, orbis::image_view<const orbis::rgb8> color) {
  slam.track(0.0, color, plane{});
}

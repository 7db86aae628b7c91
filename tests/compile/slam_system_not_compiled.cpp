// error: include <orbis/slam/definitions\.hpp>
// With orbis::compiled, a system of types that the library does not hold needs its functions.
#include <orbis/camera/pinhole.hpp>
#include <orbis/slam/rgbd_system.hpp>

void refused(const orbis::camera::pinhole& camera) { orbis::slam::rgbd_system slam{camera}; }

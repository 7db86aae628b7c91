// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/backend.hpp"

namespace app {

bool has_viewer(const std::string& name) {
#ifdef RGBD_SLAM_WINDOW
  if (name == "window") return true;
#endif
#ifdef RGBD_SLAM_WEB
  if (name == "web") return true;
#endif
  return name.empty();
}

std::string missing_viewer_message(const std::string& name) {
  return "--viewer " + name + ": this program was built without it; " +
         (name == "window" ? "install libglfw3-dev, libimgui-dev and libgl-dev, configure and build again"
                           : "configure with -DORBIS_VIEWER=ON and build again");
}

#ifndef RGBD_SLAM_WINDOW
orbis::result<std::unique_ptr<viewer_backend>> open_window() {
  return orbis::fail(orbis::errc::unsupported, {}, missing_viewer_message("window"));
}
#endif
#ifndef RGBD_SLAM_WEB
orbis::result<std::unique_ptr<viewer_backend>> open_web(unsigned) {
  return orbis::fail(orbis::errc::unsupported, {}, missing_viewer_message("web"));
}
#endif

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/video_module.hpp"

#include <string>

#ifdef RGBD_SLAM_VIDEO
#include <dlfcn.h>

namespace app {
namespace {

using orbis::errc;
using orbis::fail;

/// Finds a function in the module, which remains loaded.
template <class Function>
orbis::result<Function*> find(const char* name) {
  std::error_code ignored;
  const auto file = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path() / "rgbd_slam_video.so";
  void* const module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const function = module == nullptr ? nullptr : dlsym(module, name);
  if (function != nullptr) return reinterpret_cast<Function*>(function);
  const char* const why = dlerror();
  return fail(errc::unsupported, file.string(),
              std::string{"cannot load the video module: "} + (why != nullptr ? why : "a function is missing"));
}

}  // namespace

bool has_videos() { return true; }
bool has_video_cameras() { return true; }

orbis::result<std::unique_ptr<file_recording>> open_video(const std::filesystem::path& path,
                                                          const file_recording_options& options) {
  const auto open = find<decltype(rgbd_slam_open_video)>("rgbd_slam_open_video");
  if (!open) return fail(open.error());
  orbis::result<std::unique_ptr<file_recording>> opened;
  (*open)(path, options, opened);
  return opened;
}

orbis::result<std::unique_ptr<camera_device>> open_video_camera(const device_options& options) {
  const auto open = find<decltype(rgbd_slam_open_video_camera)>("rgbd_slam_open_video_camera");
  if (!open) return fail(open.error());
  orbis::result<std::unique_ptr<camera_device>> opened;
  (*open)(options, opened);
  return opened;
}

}  // namespace app

#else

namespace app {

using orbis::errc;
using orbis::fail;

bool has_videos() { return false; }
bool has_video_cameras() { return false; }

orbis::result<std::unique_ptr<file_recording>> open_video(const std::filesystem::path& path,
                                                          const file_recording_options&) {
  return fail(errc::unsupported, path.string(),
              "is not a folder, and this build has no support for videos: it was built without OpenCV's videoio "
              "(libopencv-videoio-dev)");
}

orbis::result<std::unique_ptr<camera_device>> open_video_camera(const device_options& options) {
  return fail(errc::unsupported, options.name.empty() ? "video camera" : options.name,
              "this build has no support for video cameras: it was built without OpenCV's videoio "
              "(libopencv-videoio-dev)");
}

}  // namespace app

#endif

// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/file_recording.hpp"

#include <algorithm>
#include <cassert>

namespace app {

using orbis::errc;
using orbis::fail;

source_frame side_by_side(double timestamp, const orbis::image<orbis::rgb8>& both) {
  assert(both.width() % 2 == 0);
  source_frame f;
  f.timestamp = timestamp;
  f.color = orbis::image<orbis::rgb8>(both.width() / 2, both.height());
  f.right = f.color;
  for (int y = 0; y != both.height(); ++y) {
    const auto* const row = &both(0, y);
    std::copy(row, row + f.color.width(), &f.color(0, y));
    std::copy(row + f.color.width(), row + both.width(), &f.right(0, y));
  }
  return f;
}

orbis::result<void> check_camera(const orbis::camera::camera_settings& camera, orbis::slam::sensor_kind sensor,
                                 int width, int height, const std::string& where) {
  const bool two = sensor == orbis::slam::sensor_kind::stereo;
  if (two && !camera.baseline)
    return fail(errc::invalid_argument, where, "two images side by side need a camera with a baseline");
  if (two && camera.model.model_name() != "pinhole")
    return fail(errc::invalid_argument, where, "two images side by side must be rectified, with a pinhole camera");
  const int columns = two ? 2 * camera.model.width() : camera.model.width();
  if (width == columns && height == camera.model.height()) return {};
  return fail(errc::malformed, where,
              "the image has " + std::to_string(width) + "x" + std::to_string(height) + " pixels, but the camera has " +
                  std::to_string(camera.model.width()) + "x" + std::to_string(camera.model.height()) +
                  (two ? ", twice" : ""));
}

}  // namespace app

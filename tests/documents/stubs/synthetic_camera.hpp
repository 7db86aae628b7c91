// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The camera behind the stubs: ten frames of a synthetic room, with depth in millimetres.
#pragma once

#include <orbis/io/synthetic.hpp>

namespace stubs {

inline const orbis::io::synthetic_recording& camera() {
  static const orbis::io::synthetic_recording recording{
      {.frames = 10, .width = 320, .height = 240, .depth_scale = 1000, .frames_around = 360}};
  return recording;
}
inline const orbis::camera::intrinsics& intrinsics() {
  static const orbis::camera::any_camera model = camera().camera().model;
  return model.k();
}

}  // namespace stubs

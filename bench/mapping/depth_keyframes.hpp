// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keyframes of a furnished room at 640x480, as a depth camera in the hand sees it.
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/mapping/keyframe.hpp>

namespace orbis::bench {

struct depth_keyframes {
  camera::pinhole camera;
  std::vector<camera::rgbd_frame> frames;

  [[nodiscard]] std::size_t size() const { return frames.size(); }
  [[nodiscard]] mapping::keyframe<> keyframe(std::size_t i) const {
    const camera::rgbd_frame& f = frames[i];
    return {f.depth_metres(), f.color.view(), *f.T_world_camera};
  }
  [[nodiscard]] std::vector<mapping::keyframe<>> keyframes() const {
    std::vector<mapping::keyframe<>> out;
    for (std::size_t i = 0; i != size(); ++i) out.push_back(keyframe(i));
    return out;
  }

  /// Forty keyframes, twice round.
  static const depth_keyframes& room() {
    static const depth_keyframes made = [] {
      const io::synthetic_recording recording{{.frames = 40, .fps = 5.0, .seed = 3, .frames_around = 20}};
      depth_keyframes out{*recording.camera().model.get_if<camera::pinhole>(), {}};
      for (std::size_t i = 0; i != recording.size(); ++i) out.frames.push_back(recording.frame(i).value());
      return out;
    }();
    return made;
  }
};

}  // namespace orbis::bench

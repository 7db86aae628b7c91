// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of synthetic.hpp: inline, or, with ORBIS_COMPILED_IO, compiled once, by
/// cmake/compiled_io/synthetic.cpp.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/camera/stereo_frame.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/detail/compiled_once.hpp>
#include <orbis/io/detail/synthetic/camera_path.hpp>
#include <orbis/io/detail/synthetic/looks.hpp>
#include <orbis/io/detail/synthetic/scene.hpp>
#include <orbis/io/detail/synthetic/sensor.hpp>
#include <orbis/io/detail/synthetic/simulator.hpp>
#include <orbis/io/detail/synthetic/texture.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/io/synthetic_options.hpp>

namespace orbis::io {

ORBIS_COMPILED_IO_ONCE synthetic_recording::synthetic_recording(const synthetic_options& options)
    : options_{options},
      path_{options.path, options.seed,
            (options.frames_around > 0 ? options.frames_around : options.frames) / options.fps},
      k_{detail::synthetic::usual_intrinsics(options.width, options.height)},
      scene_{std::make_shared<detail::synthetic::scene>(options.scene, options.seed)},
      simulator_{std::make_shared<detail::synthetic::texture_set>(detail::synthetic::painted(*scene_), texel(k_)), k_,
                 options.depth_scale, options.sensor, options.seed} {
  assert(options.frames >= 0 && options.fps > 0.0);
}

ORBIS_COMPILED_IO_ONCE trajectory synthetic_recording::ground_truth() const {
  trajectory all;
  all.reserve(size());
  for (std::size_t i = 0; i != size(); ++i) all.push_back({timestamp(i), T_world_camera(i)});
  return all;
}

ORBIS_COMPILED_IO_ONCE result<camera::rgbd_frame> synthetic_recording::frame(std::size_t i) const {
  return render(par, i);
}

ORBIS_COMPILED_IO_ONCE result<camera::stereo_frame> synthetic_recording::stereo_frame(std::size_t i) const {
  return render_stereo(par, i);
}

ORBIS_COMPILED_IO_ONCE detail::synthetic::moment synthetic_recording::moment_at(double time) const {
  return {scene_->solids_at(time), path_.at(time)};
}

ORBIS_COMPILED_IO_ONCE tl::unexpected<error> synthetic_recording::no_such_frame(std::size_t i) const {
  return fail(errc::invalid_argument, "frame",
              "there is no frame " + std::to_string(i) + " among " + std::to_string(size()));
}

ORBIS_COMPILED_IO_ONCE void synthetic_recording::iterator::load() {
  frame_ = index_ < recording_->size() ? std::make_shared<const camera::rgbd_frame>(recording_->frame(index_).value())
                                       : nullptr;
}

}  // namespace orbis::io

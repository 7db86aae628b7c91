// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of synthetic.hpp.
#pragma once

#include <cassert>
#include <string>

#include <orbis/io/detail/synthetic/camera_path.hpp>
#include <orbis/io/detail/synthetic/looks.hpp>
#include <orbis/io/detail/synthetic/scene.hpp>
#include <orbis/io/detail/synthetic/simulator.hpp>
#include <orbis/io/detail/synthetic/texture.hpp>
#include <orbis/io/synthetic.hpp>

namespace orbis::io {

namespace detail::synthetic {

/// Data that does not change between frames.
struct recorded_room {
  recorded_room(const synthetic_options& options, const camera::intrinsics& k)
      : path{options.path, options.seed,
             (options.frames_around > 0 ? options.path.rounds() * options.frames_around : options.frames) /
                 options.fps},
        surfaces{options.scene, options.seed},
        camera{std::make_shared<texture_set>(painted(surfaces), std::max(0.003, 2.0 / k.fx)),  // size of a pixel at 2 m
               k, options.depth_scale, exposed(options.sensor, options.scene.light), options.seed} {}

  [[nodiscard]] moment at(double time) const { return {surfaces.solids_at(time), path.at(time)}; }

  camera_path path;
  scene surfaces;
  simulator camera;
};

template <class = void>
[[nodiscard]] tl::unexpected<error> no_such_frame(std::size_t i, std::size_t count) {
  return fail(errc::invalid_argument, "frame",
              "frame " + std::to_string(i) + " does not exist; the recording has " + std::to_string(count) + " frames");
}

}  // namespace detail::synthetic

ORBIS_LAZY_INLINE synthetic_recording::synthetic_recording(const synthetic_options& options)
    : options_{options},
      k_{detail::synthetic::usual_intrinsics(options.width, options.height)},
      room_{std::make_shared<const detail::synthetic::recorded_room>(options, k_)} {
  assert(options.frames >= 0 && options.fps > 0.0 && options.scene.light > 0.0);
}

ORBIS_LAZY_INLINE double synthetic_recording::surface_distance(const vec3& p_world) const noexcept {
  return room_->surfaces.distance(p_world);
}

ORBIS_INLINE const detail::synthetic::scene& synthetic_recording::scene() const noexcept { return room_->surfaces; }

ORBIS_LAZY_INLINE se3 synthetic_recording::T_world_camera(std::size_t i) const {
  return room_->path.at(timestamp(i)).T_world_camera();
}

ORBIS_LAZY_INLINE trajectory synthetic_recording::ground_truth() const {
  trajectory all;
  all.reserve(size());
  for (std::size_t i = 0; i != size(); ++i) all.push_back({timestamp(i), T_world_camera(i)});
  return all;
}

ORBIS_LAZY_INLINE result<camera::rgbd_frame> synthetic_recording::frame(std::size_t i) const {
  return render_on(par, i);
}

ORBIS_LAZY_INLINE result<camera::stereo_frame> synthetic_recording::stereo_frame(std::size_t i) const {
  return render_stereo_on(par, i);
}

ORBIS_LAZY_INLINE result<camera::rgbd_frame> synthetic_recording::render_on(const parallel_policy& policy,
                                                                            std::size_t i) const {
  if (i >= size()) return detail::synthetic::no_such_frame(i, size());
  return room_->camera.frame(
      policy, [this](double time) { return room_->at(time); }, timestamp(i), i);
}

ORBIS_LAZY_INLINE result<camera::stereo_frame> synthetic_recording::render_stereo_on(const parallel_policy& policy,
                                                                                     std::size_t i) const {
  if (i >= size()) return detail::synthetic::no_such_frame(i, size());
  return room_->camera.stereo(
      policy, [this](double time) { return room_->at(time); }, timestamp(i), i, options_.sensor.stereo_baseline);
}

ORBIS_LAZY_INLINE result<detail::synthetic::exact_view> synthetic_recording::exact_on(const parallel_policy& policy,
                                                                                      std::size_t i) const {
  if (i >= size()) return detail::synthetic::no_such_frame(i, size());
  return room_->camera.exact(policy, room_->at(timestamp(i)));
}

ORBIS_LAZY_INLINE double synthetic_recording::depth_along(const vec3& origin, const vec3& ray) const {
  return room_->surfaces.cast(origin, ray).value_or(0.0);
}

ORBIS_LAZY_INLINE synthetic_recording::iterator synthetic_recording::begin() const { return {*this, 0}; }
ORBIS_LAZY_INLINE synthetic_recording::iterator synthetic_recording::end() const { return {*this, size()}; }

ORBIS_LAZY_INLINE void synthetic_recording::iterator::load() {
  frame_ = index_ < recording_->size() ? std::make_shared<const camera::rgbd_frame>(recording_->frame(index_).value())
                                       : nullptr;
}

}  // namespace orbis::io

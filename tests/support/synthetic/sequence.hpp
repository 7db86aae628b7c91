// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sequences of frames that are made when asked for: of a world and a camera's way through it.
///
/// @code
///   namespace syn = orbis::test;
///   const auto loop = syn::corridor_loop({.sequence = {.width = 320, .height = 240, .fps = 15.0}});
///   for (std::size_t i = 0; i != loop.size(); ++i) slam.track(loop.frame(i).value());
/// @endcode
#pragma once

#include <algorithm>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/synthetic/camera_path.hpp>
#include <orbis/io/detail/synthetic/scene.hpp>
#include <orbis/io/detail/synthetic/sensor.hpp>
#include <orbis/io/detail/synthetic/simulator.hpp>
#include <orbis/io/detail/synthetic/texture.hpp>

#include "support/synthetic/building.hpp"
#include "support/synthetic/walk.hpp"
#include "support/synthetic/world.hpp"

namespace orbis::test {

/// Frames by index, read or made when asked for, from several threads if need be: `recording`, `synthetic_recording`,
/// `sequence` below and everything in `synthetic/effects.hpp`.
template <class S>
concept frame_sequence = std::copy_constructible<S> && requires(const S& s, std::size_t i) {
  { s.size() } -> std::convertible_to<std::size_t>;
  { s.timestamp(i) } -> std::convertible_to<double>;
  { s.camera() } -> std::convertible_to<camera::camera_settings>;
  { s.frame(i) } -> std::convertible_to<result<camera::rgbd_frame>>;
};
/// One that knows the exact pose of every frame.
template <class S>
concept posed_sequence = frame_sequence<S> && requires(const S& s, std::size_t i) {
  { s.T_world_camera(i) } -> std::convertible_to<se3>;
};

/// The exact poses of all frames.
template <posed_sequence S>
[[nodiscard]] trajectory ground_truth_of(const S& frames) {
  trajectory all;
  all.reserve(frames.size());
  for (std::size_t i = 0; i != frames.size(); ++i) all.push_back({frames.timestamp(i), frames.T_world_camera(i)});
  return all;
}

/// How a way through a world is recorded.
struct sequence_options {
  int width = 640;            ///< pixels
  int height = 480;           ///< pixels
  double fps = 30.0;          ///< frames per second
  int frames = 0;             ///< how many; 0: to the end of the way
  double depth_scale = 5000;  ///< stored depth / depth_scale = metres; 5000 reaches 13 m
  std::uint64_t seed = 1;     ///< of the sensor's noise
  synthetic_sensor_options sensor{};
  double texel = 0.0;  ///< of the textures, metres; 0: about the size of a pixel at 2 m, but no less than 4 mm
};

/// The frame rate at which `frames` frames are spread over the whole of a way. @pre frames > 1, duration > 0
template <camera_motion Path>
[[nodiscard]] double rate_for(const Path& path, int frames) {
  return (frames - 1) / path.duration();
}

/// What a camera sees of a world on its way. Frames are independent: each can be asked for in any order, from several
/// threads, and is the same bytes on every machine (the pose apart, whose last bit may differ). Construction paints
/// the textures, on all threads; copies share them.
template <camera_motion Path>
class sequence {
 public:
  /// @pre width, height, fps and depth_scale > 0, frames >= 0
  sequence(world place, Path path, const sequence_options& options = {})
      : options_{options},
        path_{std::move(path)},
        k_{usual_intrinsics(options.width, options.height)},
        place_{std::make_shared<const world>(std::move(place))},
        simulator_{std::make_shared<const texture_set>(place_->painted(), texel(options, k_)), k_, options.depth_scale,
                   options.sensor, options.seed} {
    assert(options.fps > 0.0 && options.frames >= 0);
    if (options.frames == 0) options_.frames = static_cast<int>(path_.duration() * options.fps + 1e-6) + 1;
  }

  [[nodiscard]] std::size_t size() const noexcept { return static_cast<std::size_t>(options_.frames); }
  /// Seconds.
  [[nodiscard]] double timestamp(std::size_t i) const noexcept { return static_cast<double>(i) / options_.fps; }
  [[nodiscard]] camera::camera_settings camera() const {
    return {.model = camera::pinhole{k_},
            .depth_scale = options_.depth_scale,
            .fps = options_.fps,
            .baseline = options_.sensor.baseline};
  }
  [[nodiscard]] const sequence_options& options() const noexcept { return options_; }
  [[nodiscard]] const Path& path() const noexcept { return path_; }
  /// What there is to see; its `distance` is the error of a map's point.
  [[nodiscard]] const world& place() const noexcept { return *place_; }
  /// The exact pose of frame `i`.
  [[nodiscard]] se3 T_world_camera(std::size_t i) const { return path_.at(timestamp(i)).T_world_camera(); }

  /// Frame `i` as the sensor sees it. Errors: invalid_argument if there is no frame `i`.
  [[nodiscard]] result<camera::rgbd_frame> frame(std::size_t i) const { return render(par, i); }
  /// The same, on the policy's threads.
  template <execution_policy Policy>
  [[nodiscard]] result<camera::rgbd_frame> render(const Policy& policy, std::size_t i) const {
    if (i >= size()) return no_such_frame(i);
    return simulator_.frame(
        policy, [this](double time) { return moment_at(time); }, timestamp(i), i);
  }
  /// Colour, depth (metres) and angles of frame `i` without any error of the sensor.
  /// Errors: invalid_argument if there is no frame `i`.
  template <execution_policy Policy>
  [[nodiscard]] result<exact_view> exact(const Policy& policy, std::size_t i) const {
    if (i >= size()) return no_such_frame(i);
    return simulator_.exact(policy, moment_at(timestamp(i)));
  }

 private:
  [[nodiscard]] static double texel(const sequence_options& o, const camera::intrinsics& k) noexcept {
    return o.texel > 0.0 ? o.texel : std::max(0.004, 2.0 / k.fx);
  }
  [[nodiscard]] moment moment_at(double time) const { return {place_->solids_at(time), path_.at(time)}; }
  [[nodiscard]] tl::unexpected<error> no_such_frame(std::size_t i) const {
    return fail(errc::invalid_argument, "frame",
                "there is no frame " + std::to_string(i) + " among " + std::to_string(size()));
  }

  sequence_options options_;
  Path path_;
  camera::intrinsics k_;
  std::shared_ptr<const world> place_;
  simulator simulator_;
};

/// A loop through a building: see `corridor_loop`.
struct loop_options {
  building_options building{};
  walk_options walk{.look_aside = -0.35};  ///< towards the outer walls
  sequence_options sequence{};
  std::vector<crossing> people{};  ///< each of them crosses the view once
  std::uint64_t seed = 1;          ///< of building, textures and way
};

/// Once round the corridor of a building and a little further: 28 m in 50 s. The first view comes into sight again
/// after the last corner only.
[[nodiscard]] inline sequence<walk> corridor_loop(const loop_options& o = {}) {
  const walk way{o.walk, corridor_corners(o.building), o.seed};
  world place = corridor_building(o.building, o.seed);
  for (std::size_t i = 0; i != o.people.size(); ++i) place.add(person(way_across(way, o.people[i]), mix64(o.seed) + i));
  return {std::move(place), way, o.sequence};
}

/// Once round a furnished room: see `room_round`.
struct room_options {
  synthetic_scene_options scene{};
  synthetic_path_options path{};
  double duration = 13.0;  ///< seconds
  sequence_options sequence{};
  std::vector<crossing> people{};  ///< each of them crosses the view once
  std::uint64_t seed = 1;          ///< of room, textures and way
};

/// What `synthetic_recording` records, without its moving object but with people.
[[nodiscard]] inline sequence<camera_path> room_round(const room_options& o = {}) {
  const camera_path way{o.path, o.seed, o.duration};
  world place{scene{o.scene, o.seed}};
  for (std::size_t i = 0; i != o.people.size(); ++i) place.add(person(way_across(way, o.people[i]), mix64(o.seed) + i));
  return {std::move(place), way, o.sequence};
}

}  // namespace orbis::test

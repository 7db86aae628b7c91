// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sources of descriptors: synthetic textures, synthetic rooms, recordings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/synthetic.hpp>

#include "textures.hpp"

namespace sources {

using descriptors = std::vector<orbis::features::binary_descriptor<256>>;

/// A view of a place, with its descriptors.
struct view {
  std::size_t place = 0;  ///< views of different places never overlap
  orbis::se3 T_world_camera;
  std::vector<orbis::vec3> surface{};  ///< some visible points, in the world frame
  descriptors found{};
};

/// Creates the view of a frame.
[[nodiscard]] inline view make_view(const orbis::features::orb_extractor& extract,
                                    const orbis::camera::rgbd_frame& frame,
                                    const orbis::camera::camera_settings& camera, std::size_t place) {
  view v{.place = place, .T_world_camera = frame.T_world_camera.value_or(orbis::se3{})};
  const auto depth = frame.depth_metres();
  constexpr int step = 32;
  for (int y = step / 2; y < frame.depth.height(); y += step)
    for (int x = step / 2; x < frame.depth.width(); x += step) {
      const auto z = static_cast<double>(depth(x, y));
      const auto ray = camera.model.unproject(orbis::vec2(x, y));
      if (ray && z > 0.0 && z < 10.0) v.surface.push_back(v.T_world_camera * (z * *ray));
    }
  v.found = extract(orbis::image_view<const orbis::rgb8>{frame.color.view()}).descriptors;
  return v;
}

/// The share of the surface points of `a` that are visible in the image of `b`.
[[nodiscard]] inline double overlap(const view& a, const view& b, const orbis::camera::camera_settings& camera) {
  if (a.surface.empty()) return 0.0;
  const orbis::se3 T_b_world = b.T_world_camera.inverse();
  std::size_t inside = 0;
  for (const orbis::vec3& p : a.surface) {
    const auto pixel = camera.model.project(T_b_world * p);
    inside += pixel && pixel->x() >= 0.0 && pixel->y() >= 0.0 && pixel->x() < camera.model.width() &&
                      pixel->y() < camera.model.height()
                  ? 1
                  : 0;
  }
  return static_cast<double>(inside) / static_cast<double>(a.surface.size());
}

/// A camera and the views that it captured.
struct tour {
  orbis::camera::camera_settings camera;
  std::vector<view> views{};
};

/// The descriptors of `count` synthetic textures.
[[nodiscard]] inline std::vector<descriptors> of_textures(std::size_t count, std::uint64_t seed, int features) {
  const orbis::features::orb_extractor extract{{.max_features = features}};
  std::vector<descriptors> images(count);
  orbis::for_each_index(orbis::par, count, 1, [&](std::size_t i) {
    images[i] = extract(textures::paint(640, 480, orbis::mix64(seed) + i)).descriptors;
  });
  return images;
}

/// `views` views of the room with the seed `seed`, along a path around it. If `again` is true, the path differs and
/// the images are darker.
[[nodiscard]] inline tour of_room(std::uint64_t seed, int views, int features, std::size_t place, bool again = false) {
  orbis::io::synthetic_options options{.frames = views, .seed = seed};
  if (again) {
    options.path.semi_axis_x = 0.55;
    options.path.semi_axis_y = 0.75;
    options.path.height = 1.5;
    options.path.pitch = -0.27;
    options.path.wobble = -1.0;
  }
  const orbis::io::synthetic_recording room{options};
  const orbis::features::orb_extractor extract{{.max_features = features}};
  tour seen{.camera = room.camera()};
  seen.views.resize(room.size());
  orbis::for_each_index(orbis::par, room.size(), 1, [&](std::size_t i) {
    auto frame = room.render(orbis::seq, i).value();
    if (again)  // makes the image darker
      for (orbis::rgb8& c : frame.color.pixels())
        c = {static_cast<std::uint8_t>(c.r * 3 / 4), static_cast<std::uint8_t>(c.g * 3 / 4),
             static_cast<std::uint8_t>(c.b * 3 / 4)};
    seen.views[i] = make_view(extract, frame, seen.camera, place);
  });
  return seen;
}

/// The views of every `stride`-th frame of a recording, with ground-truth poses if available.
[[nodiscard]] inline orbis::result<tour> of_recording(const std::string& folder, std::size_t stride, int features,
                                                      std::size_t place) {
  const auto recording = orbis::io::open_recording(folder);
  if (!recording) return orbis::fail(recording.error());
  const orbis::features::orb_extractor extract{{.max_features = features}};
  tour seen{.camera = recording->camera()};
  for (std::size_t i = 0; i < recording->size(); i += stride) {
    const auto frame = recording->frame(i);
    if (!frame) return orbis::fail(frame.error());
    seen.views.push_back(make_view(extract, *frame, seen.camera, place));
  }
  return seen;
}

}  // namespace sources

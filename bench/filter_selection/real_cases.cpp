// SPDX-License-Identifier: BSD-3-Clause
//
// Surfaces out of real recordings: what several views agree on.
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include <orbis/cloud/nanoflann.hpp>
#include <orbis/io/recording.hpp>

#include "cases.hpp"

namespace orbis::bench {

namespace {

struct posed_frame {
  camera::rgbd_frame frame;
  se3 T_world_camera;
};

/// How many of the frames measured a surface where this point is.
int confirmations(const vec3& world, const std::vector<posed_frame>& frames, std::size_t own,
                  const camera::any_camera& camera) {
  int count = 0;
  for (std::size_t i = 0; i != frames.size(); ++i) {
    if (i == own) continue;
    const vec3 p = frames[i].T_world_camera.inverse() * world;
    const auto pixel = camera.project(p);
    if (!pixel) continue;
    const int x = static_cast<int>(std::lround(pixel->x())), y = static_cast<int>(std::lround(pixel->y()));
    if (x < 0 || y < 0 || x >= camera.width() || y >= camera.height()) continue;
    const camera::depth_view<std::uint16_t> depth{frames[i].frame.depth.view(), frames[i].frame.depth_scale};
    const double z = depth(x, y);
    if (z > 0 && std::abs(z - p.z()) < 0.012 + 0.004 * z * z) ++count;
  }
  return count;
}

}  // namespace

std::vector<surface> real_surface(const std::filesystem::path& data, const real_source& source) {
  const auto recording = io::open_recording(data / source.folder);
  if (!recording) {
    std::printf("[skipped] no %s\n", (data / source.folder).string().c_str());
    return {};
  }
  surface s;
  s.name = source.folder + " " + std::to_string(source.first);
  s.context = source.context;
  s.exact = false;
  s.seed = 1000 + source.first;
  // The pixels of an undistorted image of a quarter of the size, each with the measurement of the nearest pixel.
  const camera::any_camera& camera = recording->camera().model;
  s.sensor = {.width = 160, .height = 120, .focal = 0.25 * camera.k().fx, .noise_square = 0.003, .max_depth = 4.0};
  const camera::pinhole small = s.sensor.camera();

  std::vector<posed_frame> frames;  // those asked for, and between each two of them another one that can confirm
  std::vector<std::size_t> chosen;
  const std::size_t half = std::max<std::size_t>(1, source.step / 2);
  for (std::size_t n = 0; n != source.count; ++n) {
    for (const std::size_t i : {source.first + n * source.step, source.first + n * source.step + half}) {
      if (i >= recording->size()) continue;
      auto frame = recording->frame(i);
      if (!frame || !frame->T_world_camera) continue;
      if (i == source.first + n * source.step) chosen.push_back(frames.size());
      const se3 pose = *frame->T_world_camera;
      frames.push_back({*std::move(frame), pose});
    }
  }
  auto clean = std::make_shared<std::vector<vec3f>>();
  for (const std::size_t i : chosen) {
    surface::shot shot{image<float>(small.width(), small.height()), frames[i].T_world_camera};
    const camera::depth_view<std::uint16_t> depth{frames[i].frame.depth.view(), frames[i].frame.depth_scale};
    for (int y = 0; y != small.height(); ++y)
      for (int x = 0; x != small.width(); ++x) {
        const vec3 ray = *small.unproject({x, y});
        const auto pixel = camera.project(ray);
        if (!pixel) continue;
        const int u = static_cast<int>(std::lround(pixel->x())), v = static_cast<int>(std::lround(pixel->y()));
        if (u < 0 || v < 0 || u >= camera.width() || v >= camera.height()) continue;
        const float z = depth(u, v);
        if (z <= 0.3F || z > 4.0F) continue;
        const vec3 world = shot.T_world_camera * (static_cast<double>(z) * ray);
        if (confirmations(world, frames, i, camera) < 2) continue;
        shot.depth(x, y) = z;
        clean->push_back(world.cast<float>());
      }
    s.shots.push_back(std::move(shot));
  }
  if (clean->size() < 1000) {
    std::printf("[skipped] %s: too few points that several views confirm\n", s.name.c_str());
    return {};
  }
  const auto search = std::make_shared<cloud::nanoflann_search<std::vector<vec3f>>>(*clean);
  s.distance = [clean, search](const vec3& p) {
    std::vector<cloud::neighbor<float>> nearest;
    const vec3f q = p.cast<float>();
    search->knn({q.x(), q.y(), q.z()}, 1, nearest);
    return static_cast<double>(nearest.front().distance);
  };
  return {std::move(s)};
}

}  // namespace orbis::bench

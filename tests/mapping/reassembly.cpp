// SPDX-License-Identifier: BSD-3-Clause
//
// A recording whose poses drift and are corrected afterwards, as loop closing does it; and how much of a
// real kitchen is left when the rays have had their say.
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include <orbis/cloud/ray_evidence-inl.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/mapping/dense_cloud.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"

using orbis::mapping::dense_cloud;
using orbis::mapping::dense_options;

namespace {

struct frames {
  std::vector<orbis::camera::rgbd_frame> all;
  std::vector<orbis::se3> poses;

  [[nodiscard]] std::vector<orbis::mapping::keyframe<>> keyframes() const {
    std::vector<orbis::mapping::keyframe<>> out;
    for (std::size_t i = 0; i != all.size(); ++i) out.push_back({all[i].depth_metres(), all[i].color.view(), poses[i]});
    return out;
  }
};

}  // namespace

TEST_CASE("a map whose drift is corrected is the map without drift") {
  const orbis::io::synthetic_recording recording{
      {.frames = 24, .seed = 5, .width = 160, .height = 120, .scene = {.texture_density = 0.2}}};
  frames right;
  for (std::size_t i = 0; i < recording.size(); i += 2) {
    right.all.push_back(recording.frame(i).value());
    right.poses.push_back(recording.T_world_camera(i));
  }
  frames wrong{right.all, {}};
  orbis::se3 drift;
  for (std::size_t i = 0; i != right.poses.size(); ++i) {
    const orbis::vec6 step = orbis::vec6{{0.004, -0.002, 0.003, 0.002, -0.003, 0.004}};
    wrong.poses.push_back(drift * right.poses[i]);
    drift = drift * orbis::se3::exp(step);
  }
  const orbis::camera::ray_table rays{recording.camera().model};
  for (const dense_options& options :
       {dense_options{.stride = 2}, dense_options{.stride = 1, .voxel_size = 0.02},
        dense_options{.stride = 1, .voxel_size = 0.05, .flying_pixels = orbis::cloud::flying_pixel_options{}}}) {
    dense_cloud wanted{rays, options};
    for (const auto& k : right.keyframes()) wanted.add_keyframe(orbis::seq, k);
    dense_cloud live{rays, options};
    std::size_t number = 0;
    for (const auto& k : wrong.keyframes()) {
      live.add_keyframe(orbis::par.with(2), k);
      // Half-way the first half is corrected for the first time, a little.
      if (++number == 6) {
        auto half = wrong.keyframes();
        half.resize(6);
        for (auto& h : half) h.T_world_camera = h.T_world_camera * orbis::se3{orbis::so3{}, orbis::vec3{0.01, 0, 0}};
        CHECK(live.reassemble(orbis::par, half) == 6);
      }
    }
    CHECK(live.cloud().points != wanted.cloud().points);
    CHECK(live.reassemble(orbis::par.with(3), right.keyframes()) == right.poses.size());
    CHECK(live.cloud().points == wanted.cloud().points);
    CHECK(live.cloud().colors == wanted.cloud().colors);
    CHECK(live.ranges() == wanted.ranges());
  }
}

TEST_CASE("rays leave a real kitchen its surfaces") {
  ORBIS_NEEDS_DATA("kitchen");
  const auto recording = orbis::io::open_recording(orbis::test::data_dir() / "kitchen").value();
  frames kitchen;
  for (std::size_t i = 0; i < recording.size(); i += 25) {
    kitchen.all.push_back(recording.frame(i).value());
    kitchen.poses.push_back(*kitchen.all.back().T_world_camera);
  }
  const auto keyframes = kitchen.keyframes();
  const auto camera = recording.camera().model;
  const orbis::camera::ray_table rays{camera};
  dense_cloud dense{rays, {.voxel_size = 0.01}};
  for (const auto& k : keyframes) dense.add_keyframe(orbis::par, k);
  const auto cloud = dense.cloud();
  const auto inliers = orbis::cloud::ray_evidence_inliers(orbis::par, cloud.points, keyframes, camera);
  // What goes lies along the edges of things, where the sensor makes them wider than they are.
  const double removed = 1.0 - static_cast<double>(inliers.size()) / static_cast<double>(cloud.size());
  CHECK(removed > 0.005);
  CHECK(removed < 0.05);

  const auto key_of = [](const orbis::vec3& p) {
    const auto cell = [](double c) { return static_cast<int>(std::floor(c * (1.0 / 0.02))); };
    return std::array{cell(p.x()), cell(p.y()), cell(p.z())};
  };
  std::set<std::array<int, 3>> left;
  for (const std::uint32_t i : inliers) left.insert(key_of(cloud.points[i].cast<double>()));
  const auto is_covered = [&](const orbis::vec3& p) {
    const auto key = key_of(p);
    for (int d = 0; d != 27; ++d) {
      if (left.contains({key[0] + d % 3 - 1, key[1] + d / 3 % 3 - 1, key[2] + d / 9 - 1})) return true;
    }
    return false;
  };
  std::size_t measured = 0, lost = 0, inside = 0, lost_inside = 0;
  for (const auto& k : keyframes) {
    for (int y = 8; y < 472; y += 8) {
      for (int x = 8; x < 632; x += 8) {
        const float z = k.depth(x, y);
        if (!(z > 0 && z <= 4)) continue;
        const bool covered = is_covered(k.T_world_camera * rays.at(x, y, z).cast<double>());
        bool smooth = true;
        for (const auto& [u, v] : {std::pair{-4, 0}, {4, 0}, {0, -4}, {0, 4}})
          smooth = smooth && std::abs(k.depth(x + u, y + v) - z) < 0.03F * z;
        ++measured;
        lost += covered ? 0 : 1;
        inside += smooth ? 1 : 0;
        lost_inside += smooth && !covered ? 1 : 0;
      }
    }
  }
  REQUIRE(inside > 50'000);
  CHECK(static_cast<double>(lost) < 0.003 * static_cast<double>(measured));
  CHECK(static_cast<double>(lost_inside) < 0.0005 * static_cast<double>(inside));
}

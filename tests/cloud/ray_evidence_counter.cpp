// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/camera/cloud.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/cloud/ray_evidence_counter-inl.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/simd/level.hpp>

#include "cloud/posed_scene.hpp"
#include "support/catch.hpp"

using orbis::cloud::ray_evidence;
using orbis::test::box_scene;
using orbis::test::views_of;

TEST_CASE("a view that is taken back has never been counted") {
  const auto scene = box_scene::room();
  const orbis::camera::pinhole camera{{.width = 64, .height = 48, .fx = 50, .fy = 50, .cx = 31.5, .cy = 23.5}};
  auto views = views_of(scene, camera, 6, {});
  views[4].T_world_camera = orbis::se3{orbis::so3{}, orbis::vec3{std::numeric_limits<double>::quiet_NaN(), 0, 0}};
  std::vector<orbis::vec3f> points;
  for (const auto& v : {views[0], views[1], views[2]})
    for (const auto& p : orbis::camera::unproject_depth(orbis::seq, v.depth, camera, {}, v.T_world_camera).points)
      points.push_back(p);
  for (const auto level : {orbis::simd::level::portable, orbis::simd::level::avx2, orbis::simd::level::avx512}) {
    const orbis::simd::level_limit limit{level};
    orbis::cloud::ray_evidence_counter<orbis::camera::pinhole> all{orbis::seq, points, camera};
    orbis::cloud::ray_evidence_counter<orbis::camera::pinhole> some{orbis::seq, points, camera};
    for (const auto& v : views) all.add(orbis::seq, v);
    const auto whole = all.scores();
    for (const std::size_t i : {0U, 2U, 5U}) some.add(orbis::seq, views[i]);
    for (const std::size_t i : {4U, 1U, 3U}) all.remove(orbis::par.with(3), views[i]);
    CHECK(all.scores() == some.scores());
    CHECK(all.scores() != whole);
    for (const std::size_t i : {5U, 0U, 2U}) all.remove(orbis::seq, views[i]);
    CHECK(all.scores() == std::vector<ray_evidence>(points.size()));
  }
}

TEST_CASE("counts end at their largest number") {
  for (const auto level : {orbis::simd::level::portable, orbis::simd::level::avx2, orbis::simd::level::avx512}) {
    std::vector<std::uint16_t> counters(orbis::cloud::detail::point_blocks::block_size, 65534);
    std::array<std::uint16_t, orbis::cloud::detail::block_verdict::words> words{};
    words.fill(0xa5c3);
    const orbis::simd::level_limit limit{level};
    const orbis::cloud::detail::ray_kernels kernels;
    for (int again = 0; again != 3; ++again) kernels.count(words, counters.data());
    for (std::size_t i = 0; i != counters.size(); ++i)
      CHECK(counters[i] == ((0xa5c3U >> (i % 16) & 1U) != 0 ? 65535 : 65534));
  }
}

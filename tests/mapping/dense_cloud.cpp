// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/mapping/dense_cloud.hpp>

#include "mapping/keyframes.hpp"
#include "support/catch.hpp"

using orbis::mapping::dense_cloud;
using orbis::mapping::dense_options;

namespace {

bool same(const dense_cloud& a, const dense_cloud& b) {
  const orbis::point_cloud p = a.cloud();
  const orbis::point_cloud q = b.cloud();
  return p.points == q.points && p.colors == q.colors && a.ranges() == b.ranges() && a.size() == b.size();
}

/// The scene with poses that have drifted, more and more.
orbis::test::seen_scene drifted(orbis::test::seen_scene scene) {
  for (std::size_t i = 0; i != scene.poses.size(); ++i) {
    const double t = 0.01 * static_cast<double>(i);
    const orbis::vec6 xi = orbis::vec6{{t, -0.7 * t, 0.4 * t, 0.3 * t, 0.2 * t, -t}};
    scene.poses[i] = scene.poses[i] * orbis::se3::exp(xi);
  }
  return scene;
}

}  // namespace

TEST_CASE("every valid depth becomes a coloured point in the world") {
  const auto scene = orbis::test::wall_scene(1);
  const orbis::camera::ray_table rays{scene.camera};
  dense_cloud dense{rays, {.stride = 1}};
  const auto k = scene.keyframe(0);
  const std::size_t measured = dense.add_keyframe(orbis::seq, k);
  CHECK(measured == dense.size());
  const orbis::point_cloud cloud = dense.cloud();
  std::size_t i = 0;
  for (int y = 0; y != scene.camera.height(); ++y) {
    for (int x = 0; x != scene.camera.width(); ++x) {
      const float z = k.depth(x, y);
      if (z == 0 || z > 4) continue;
      const orbis::vec3 p = k.T_world_camera * (*scene.camera.unproject({x, y}) * z);
      REQUIRE(i < cloud.size());
      CHECK((cloud.points[i].cast<double>() - p).norm() < 1e-5);
      CHECK(cloud.colors[i] == k.color(x, y));
      CHECK(dense.ranges()[i] == Approx((p - k.T_world_camera.translation()).norm()).epsilon(1e-5));
      ++i;
    }
  }
  CHECK(i == cloud.size());
}

TEST_CASE("with a voxel size the cloud follows the surface and not the frames") {
  const auto scene = orbis::test::wall_scene(1);
  const orbis::camera::ray_table rays{scene.camera};
  dense_cloud dense{rays, {.stride = 1, .voxel_size = 0.05}};
  for (int again = 0; again != 5; ++again) dense.add_keyframe(orbis::par, scene.keyframe(0));
  dense_cloud once{rays, {.stride = 1, .voxel_size = 0.05}};
  once.add_keyframe(orbis::seq, scene.keyframe(0));
  CHECK(dense.size() == once.size());
  const auto all_points = dense.cloud().points;
  const auto once_points = once.cloud().points;
  for (std::size_t i = 0; i != once.size(); ++i) {
    CHECK((all_points[i] - once_points[i]).norm() < 1e-5F);
  }
}

TEST_CASE("keyframes that moved by less than a tolerance stay where they are") {
  auto scene = orbis::test::wall_scene(4);
  const orbis::camera::ray_table rays{scene.camera};
  dense_cloud dense{rays, {.stride = 2, .max_depth = 2.5F, .voxel_size = 0.02}};
  for (std::size_t i = 0; i != 4; ++i) dense.add_keyframe(orbis::seq, scene.keyframe(i));
  const auto put = scene.poses;
  const auto turn = [](double angle) {
    return orbis::se3{orbis::so3::exp(orbis::vec3{0, angle, 0}), orbis::vec3::Zero()};
  };
  scene.poses[1] = orbis::se3{orbis::so3{}, orbis::vec3{0.009, 0, 0}} * scene.poses[1];
  scene.poses[2] = scene.poses[2] * turn(0.002);  // 5 mm at the far end
  scene.poses[3] = scene.poses[3] * turn(0.006);  // 15 mm: a turn alone counts
  CHECK(dense.reassemble(orbis::seq, scene.keyframes(), 0.012) == 1);
  dense_cloud expected{rays, {.stride = 2, .max_depth = 2.5F, .voxel_size = 0.02}};
  auto there = scene;
  there.poses = {put[0], put[1], put[2], scene.poses[3]};
  for (std::size_t i = 0; i != 4; ++i) expected.add_keyframe(orbis::seq, there.keyframe(i));
  CHECK(dense.cloud().points == expected.cloud().points);
  // Small steps add up, because the pose that a keyframe was put to is what counts.
  scene.poses[1] = orbis::se3{orbis::so3{}, orbis::vec3{0.009, 0, 0}} * scene.poses[1];
  CHECK(dense.reassemble(orbis::seq, scene.keyframes(), 0.012) == 1);
  CHECK(dense.reassemble(orbis::seq, scene.keyframes()) == 1);
  CHECK(dense.reassemble(orbis::seq, scene.keyframes()) == 0);
}

TEST_CASE("without a largest depth any change of a pose counts, whatever the tolerance") {
  auto scene = orbis::test::wall_scene(2);
  const orbis::camera::ray_table rays{scene.camera};
  for (const float limit : {2.5F, std::numeric_limits<float>::infinity()}) {
    dense_cloud dense{rays, {.stride = 2, .max_depth = limit, .voxel_size = 0.02}};
    for (std::size_t i = 0; i != 2; ++i) dense.add_keyframe(orbis::seq, scene.keyframe(i));
    CHECK(dense.reassemble(orbis::seq, scene.keyframes(), 0.05) == 0);
    auto turned = scene;
    turned.poses[1] = scene.poses[1] * orbis::se3{orbis::so3::exp(orbis::vec3{0, 1e-4, 0}), orbis::vec3::Zero()};
    CHECK(dense.reassemble(orbis::seq, turned.keyframes(), 0.05) == (std::isinf(limit) ? 1 : 0));
  }
}

TEST_CASE("a keyframe's measurements are those whose point of the cloud is kept") {
  const auto scene = orbis::test::wall_scene(3);
  const orbis::camera::ray_table rays{scene.camera};
  for (const double voxel : {0.0, 0.04}) {
    dense_cloud dense{rays, {.stride = 2, .voxel_size = voxel}};
    std::size_t measured = 0;
    for (std::size_t i = 0; i != 3; ++i) measured += dense.add_keyframe(orbis::par.with(2), scene.keyframe(i));
    const orbis::point_cloud cloud = dense.cloud();
    const auto all = orbis::cloud::pass_through_inliers(cloud.points);
    const auto half = orbis::cloud::pass_through_inliers(cloud.points, {.high = {0.0, 9.0, 9.0}});
    REQUIRE(all.size() == dense.size());
    std::size_t found = 0;
    for (std::size_t i = 0; i != 3; ++i) {
      const auto every = dense.measurements(orbis::seq, scene.keyframe(i), i);
      CHECK(dense.measurements(orbis::seq, scene.keyframe(i), i, dense.select(all)) == every);
      CHECK(dense.measurements(orbis::par.with(3), scene.keyframe(i), i, dense.select(all)) == every);
      CHECK(dense.measurements(orbis::seq, scene.keyframe(i), i, dense.select({})).empty());
      const auto left = dense.measurements(orbis::seq, scene.keyframe(i), i, dense.select(half));
      CHECK(left.size() > every.size() / 4);
      CHECK(left.size() < every.size());
      for (const auto& p : left) CHECK(p.x() < 0.04F);
      found += every.size();
    }
    CHECK(found == measured);
  }
}

TEST_CASE("without colour images the cloud has no colours") {
  const auto scene = orbis::test::wall_scene(2);
  dense_cloud dense{orbis::camera::ray_table{scene.camera}};
  auto k = scene.keyframe(0);
  dense.add_keyframe(orbis::seq, k);
  CHECK(dense.cloud().has_colors());
  k.color = {};
  dense.add_keyframe(orbis::seq, k);
  CHECK_FALSE(dense.cloud().has_colors());
  dense.remove(orbis::seq, k, 1);
  CHECK(dense.cloud().has_colors());
}

TEST_CASE("keyframes that are moved leave no trace where they were") {
  const auto right = orbis::test::wall_scene(6, 20);
  const auto wrong = drifted(right);
  const orbis::camera::ray_table rays{right.camera};
  for (const dense_options& options :
       {dense_options{.stride = 1}, dense_options{.stride = 2, .voxel_size = 0.02},
        dense_options{.stride = 1, .voxel_size = 0.3},
        dense_options{.stride = 1, .voxel_size = 0.01, .flying_pixels = orbis::cloud::flying_pixel_options{}}}) {
    INFO("voxel size " << options.voxel_size);
    dense_cloud wanted{rays, options};
    for (std::size_t i = 0; i != 6; ++i) wanted.add_keyframe(orbis::seq, right.keyframe(i));
    REQUIRE(wanted.size() > 0);

    for (const unsigned threads : {1U, 2U, 5U}) {
      const auto policy = orbis::par.with(threads);
      dense_cloud dense{rays, options};
      for (std::size_t i = 0; i != 6; ++i) dense.add_keyframe(policy, wrong.keyframe(i));
      CHECK_FALSE(same(dense, wanted));
      CHECK(dense.reassemble(policy, right.keyframes()) == 5);  // the first had not drifted
      CHECK(same(dense, wanted));
      CHECK(dense.reassemble(policy, right.keyframes()) == 0);

      // There and back again.
      const auto k = wrong.keyframe(3);
      dense.move(policy, k, 3);
      CHECK_FALSE(same(dense, wanted));
      CHECK(dense.measurements(policy, k, 3) != wanted.measurements(policy, k, 3));
      dense.move(policy, right.keyframe(3), 3);
      CHECK(same(dense, wanted));
      CHECK(dense.measurements(policy, k, 3) == wanted.measurements(policy, k, 3));

      // All of them gone.
      for (const std::size_t i : {4U, 0U, 5U, 2U, 1U, 3U}) {
        CHECK(dense.contains(i));
        dense.remove(policy, wrong.keyframe(i), i);
        CHECK_FALSE(dense.contains(i));
      }
      CHECK(dense.size() == 0);
      CHECK(dense.cloud().empty());
      CHECK(same(dense, dense_cloud{rays, options}));
      CHECK(dense.reassemble(policy, right.keyframes()) == 0);
      for (std::size_t i = 0; i != 6; ++i) dense.add_keyframe(policy, right.keyframe(i));
      CHECK(same(dense, wanted));
    }
  }
}

TEST_CASE("with a voxel size the order of the keyframes does not matter") {
  const auto scene = orbis::test::wall_scene(4, 20);
  const orbis::camera::ray_table rays{scene.camera};
  const dense_options options{.stride = 1, .voxel_size = 0.03};
  dense_cloud forth{rays, options};
  dense_cloud back{rays, options};
  for (std::size_t i = 0; i != 4; ++i) forth.add_keyframe(orbis::par, scene.keyframe(i));
  for (std::size_t i = 4; i-- > 0;) back.add_keyframe(orbis::seq, scene.keyframe(i));
  CHECK(same(forth, back));
}

TEST_CASE("a removed keyframe is as if it had never been there") {
  const auto scene = orbis::test::wall_scene(4, 20);
  const orbis::camera::ray_table rays{scene.camera};
  for (const double voxel : {0.0, 0.02}) {
    const dense_options options{.stride = 1, .voxel_size = voxel};
    dense_cloud without{rays, options};
    dense_cloud dense{rays, options};
    for (std::size_t i = 0; i != 4; ++i) dense.add_keyframe(orbis::seq, scene.keyframe(i));
    for (std::size_t i = 0; i != 4; ++i) {
      if (i != 1) without.add_keyframe(orbis::seq, scene.keyframe(i));
    }
    dense.remove(orbis::seq, scene.keyframe(1), 1);
    CHECK(same(dense, without));
    // Numbers stay what they were.
    CHECK(dense.measurements(orbis::seq, scene.keyframe(2), 2) ==
          without.measurements(orbis::seq, scene.keyframe(2), 1));
    dense.add_keyframe(orbis::seq, scene.keyframe(1));
    CHECK(dense.contains(4));
  }
}

TEST_CASE("memory follows the surface, whatever moves over it") {
  const auto scene = orbis::test::wall_scene(8);
  const auto elsewhere = drifted(drifted(drifted(scene)));
  const orbis::camera::ray_table rays{scene.camera};
  dense_cloud dense{rays, {.stride = 1, .voxel_size = 0.01}};
  for (std::size_t i = 0; i != 8; ++i) dense.add_keyframe(orbis::seq, scene.keyframe(i));
  dense.reassemble(orbis::seq, elsewhere.keyframes());
  dense.reassemble(orbis::seq, scene.keyframes());
  const std::size_t voxels = dense.size();
  const std::size_t before = dense.memory_bytes();
  for (int pass = 0; pass != 50; ++pass) {
    dense.reassemble(orbis::par.with(2), elsewhere.keyframes());
    dense.reassemble(orbis::par.with(2), scene.keyframes());
  }
  CHECK(dense.size() == voxels);
  CHECK(dense.memory_bytes() <= before + before / 20);
  // And whatever is added on top.
  for (int pass = 0; pass != 50; ++pass) dense.add_keyframe(orbis::seq, scene.keyframe(0));
  CHECK(dense.size() == voxels);
  CHECK(dense.memory_bytes() <= before + before / 10);
}

TEST_CASE("a voxel holds the mean of what was measured in it") {
  const auto scene = orbis::test::wall_scene(3, 20);
  const orbis::camera::ray_table rays{scene.camera};
  const double size = 0.05;
  dense_cloud every{rays, {.stride = 1}};
  dense_cloud merged{rays, {.stride = 1, .voxel_size = size}};
  struct sum {
    orbis::vec3 position = orbis::vec3::Zero();
    double r = 0, range = 0, n = 0;
  };
  std::map<std::array<int, 3>, sum> voxels;
  for (std::size_t i = 0; i != 3; ++i) {
    CHECK(every.add_keyframe(orbis::seq, scene.keyframe(i)) == merged.add_keyframe(orbis::seq, scene.keyframe(i)));
  }
  const auto cell = [&](const orbis::vec3f& p) {
    std::array<int, 3> out{};
    for (Eigen::Index a = 0; a != 3; ++a)
      out[static_cast<std::size_t>(a)] = static_cast<int>(std::floor(double{p[a]} / size));
    return out;
  };
  const auto points = every.cloud();
  const auto ranges = every.ranges();
  for (std::size_t i = 0; i != points.size(); ++i) {
    sum& s = voxels[cell(points.points[i])];
    s.position += points.points[i].cast<double>();
    s.r += points.colors[i].r;
    s.range += double{ranges[i]};
    s.n += 1;
  }
  const auto means = merged.cloud();
  const auto mean_ranges = merged.ranges();
  std::size_t compared = 0;
  for (std::size_t i = 0; i != means.size(); ++i) {
    const auto found = voxels.find(cell(means.points[i]));
    if (found == voxels.end()) continue;  // rounded across a border
    const sum& s = found->second;
    if ((means.points[i].cast<double>() - s.position / s.n).norm() > 1e-4) continue;  // a point there was, too
    ++compared;
    CHECK(std::abs(means.colors[i].r - s.r / s.n) < 0.51);
    CHECK(std::abs(double{mean_ranges[i]} - s.range / s.n) < 1e-3);
  }
  CHECK(merged.size() + 2 >= voxels.size());
  CHECK(compared + 5 >= voxels.size());
}

TEST_CASE("flying pixels never become points") {
  const auto scene = orbis::test::edge_scene(2);
  const orbis::camera::ray_table rays{scene.camera};
  for (const double voxel : {0.0, 0.02}) {
    dense_cloud all{rays, {.stride = 1, .voxel_size = voxel}};
    dense_cloud fewer{rays, {.stride = 1, .voxel_size = voxel, .flying_pixels = orbis::cloud::flying_pixel_options{}}};
    const auto k = scene.keyframe(0);
    orbis::image<float> filtered{64, 48};
    const auto count = orbis::cloud::remove_flying_pixels(orbis::seq, k.depth, filtered.view());
    const std::size_t measured = all.add_keyframe(orbis::seq, k);
    CHECK(measured == count.valid);
    CHECK(fewer.add_keyframe(orbis::par, k) == count.valid - count.removed);
    CHECK(fewer.measurements(orbis::seq, k, 0).size() == count.valid - count.removed);
    CHECK(count.removed > 50);
    CHECK(fewer.flying_pixels() == count);
    CHECK(all.flying_pixels() == orbis::cloud::flying_pixel_count{});
    fewer.remove(orbis::seq, k, 0);
    CHECK(fewer.flying_pixels() == orbis::cloud::flying_pixel_count{});
  }
}

TEST_CASE("an image without depth adds nothing") {
  auto scene = orbis::test::wall_scene(1);
  scene.depth[0] = orbis::image<std::uint16_t>(64, 48, 0);
  for (const double voxel : {0.0, 0.02}) {
    dense_cloud dense{orbis::camera::ray_table{scene.camera}, {.voxel_size = voxel}};
    CHECK(dense.add_keyframe(orbis::par, scene.keyframe(0)) == 0);
    CHECK(dense.size() == 0);
    CHECK(dense.measurements(orbis::par, scene.keyframe(0), 0).empty());
    dense.remove(orbis::par, scene.keyframe(0), 0);
    CHECK(dense.cloud().empty());
  }
}

TEST_CASE("a masked depth image holds the pixels whose point of the cloud is kept") {
  const auto scene = orbis::test::wall_scene(3, 20);
  for (const double voxel : {0.0, 0.03}) {
    for (const int stride : {1, 3}) {
      INFO("voxel " << voxel << ", stride " << stride);
      orbis::mapping::dense_cloud dense{orbis::camera::ray_table{scene.camera},
                                        {.stride = stride, .voxel_size = voxel}};
      for (std::size_t i = 0; i != 3; ++i) dense.add_keyframe(orbis::seq, scene.keyframe(i));
      // Kept: what lies left of the middle.
      const auto points = dense.cloud().points;
      const auto selection = dense.select(orbis::cloud::pass_through_inliers(points, {.high = {0.0, 9.0, 9.0}}));
      std::size_t kept = 0;
      for (std::size_t i = 0; i != 3; ++i) {
        const auto k = scene.keyframe(i);
        const auto all = dense.masked_depth(orbis::seq, k, i);
        const auto some = dense.masked_depth(orbis::par.with(3), k, i, selection);
        const auto none = dense.masked_depth(orbis::seq, k, i, dense.select({}));
        std::size_t measured = 0, wrong = 0, left_over = 0;
        const orbis::camera::ray_table rays{scene.camera};
        const orbis::camera::float_pose pose{k.T_world_camera};
        for (int y = 0; y != all.height(); ++y)
          for (int x = 0; x != all.width(); ++x) {
            const float z = k.depth(x, y);
            const bool valid = z > 0.0F && z <= 4.0F;
            wrong += all(x, y) != (valid ? scene.depth[i](x, y) : 0);
            measured += valid ? 1U : 0U;
            wrong += some(x, y) != 0 && some(x, y) != scene.depth[i](x, y);
            kept += some(x, y) != 0 ? 1U : 0U;
            left_over += none(x, y) != 0 ? 1U : 0U;
            const auto p = orbis::camera::world_point(pose, rays(x, y).x(), rays(x, y).y(), z);
            // Well away from the middle a pixel's point, or that of its voxel or block, is on its own side.
            if (valid && stride == 1) wrong += p[0] < -0.1F && some(x, y) == 0;
            if (valid) wrong += p[0] > 0.2F && some(x, y) != 0;
          }
        CHECK(wrong == 0);
        CHECK(measured > 1000);
        CHECK(left_over == 0);
        if (stride == 1 && voxel == 0.0) {
          const auto wanted = dense.measurements(orbis::seq, k, i, selection).size();
          CHECK(static_cast<std::size_t>(std::ranges::count_if(some.pixels(), [](auto z) { return z != 0; })) ==
                wanted);
        }
      }
      CHECK(kept > 1000);
    }
  }
}

TEST_CASE("a cloud that is read for the last time frees its sums, and masks images as before") {
  const auto scene = orbis::test::wall_scene(3, 20);
  orbis::mapping::dense_cloud dense{orbis::camera::ray_table{scene.camera}, {.stride = 1, .voxel_size = 0.03}};
  for (std::size_t i = 0; i != 3; ++i) dense.add_keyframe(orbis::seq, scene.keyframe(i));
  const std::size_t size = dense.size();
  std::vector<std::uint32_t> kept;
  for (std::uint32_t i = 0; i != size; ++i)
    if (i % 3 != 0) kept.push_back(i);
  std::vector<decltype(dense.masked_depth(orbis::seq, scene.keyframe(0), 0))> before;
  for (std::size_t i = 0; i != 3; ++i)
    before.push_back(dense.masked_depth(orbis::seq, scene.keyframe(i), i, dense.select(kept)));
  const std::size_t bytes = dense.memory_bytes();
  dense.finish();
  CHECK(dense.memory_bytes() + 36 * size <= bytes);
  CHECK(dense.size() == size);
  for (std::size_t i = 0; i != 3; ++i) {
    const auto after = dense.masked_depth(orbis::seq, scene.keyframe(i), i, dense.select(kept));
    CHECK(std::ranges::equal(after.pixels(), before[i].pixels()));
  }
}

TEST_CASE("a stray pixel between the strides does not follow the point of its block") {
  for (const double voxel : {0.0, 0.03}) {
    auto scene = orbis::test::wall_scene(1, 20);
    auto& stored = scene.depth[0];
    const int x = stored.width() / 2 / 2 * 2 + 1, y = stored.height() / 2 / 2 * 2 + 1;
    REQUIRE(stored(x, y) != 0);
    stored(x, y) = static_cast<std::uint16_t>(stored(x, y) / 3);
    orbis::mapping::dense_cloud dense{orbis::camera::ray_table{scene.camera}, {.stride = 2, .voxel_size = voxel}};
    dense.add_keyframe(orbis::seq, scene.keyframe(0));
    std::vector<std::uint32_t> kept(dense.size() - 1);
    std::iota(kept.begin(), kept.end(), 1U);  // without the first, so that the selection is not everything
    const auto masked = dense.masked_depth(orbis::seq, scene.keyframe(0), 0, dense.select(kept));
    CHECK(masked(x, y) == 0);
    CHECK(masked(x - 1, y) != 0);
    CHECK(masked(x - 1, y - 1) != 0);
  }
}

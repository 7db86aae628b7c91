// SPDX-License-Identifier: BSD-3-Clause
//
// 04_bundle_adjustment: refines the poses of eight RGB-D keyframes and 400 landmarks; every twentieth observation is an
// outlier.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>

int main() {
  using namespace orbis::optimize;
  const reprojection model{orbis::camera::pinhole{640, 480, 525.0, 525.0, 319.5, 239.5}, 40.0};  // fx * 7.6 cm

  // The scene: true poses and points, and observations with a noise of half a pixel.
  orbis::random_bits random{3};
  std::vector<orbis::se3> truth;
  for (int i = 0; i != 8; ++i) truth.push_back(orbis::se3::exp({0.1 * i, 0.0, 0.0, 0.0, 0.02 * i, 0.0}));
  std::vector<orbis::vec3> points;
  std::vector<bundle_observation> observations;
  for (std::uint32_t n = 0; n != 400; ++n) {
    const orbis::vec3 p{random.uniform(-2, 3), random.uniform(-1.5, 1.5), random.uniform(3, 6)};
    for (std::uint32_t i = 0; i != truth.size(); ++i) {
      const orbis::vec3 in_camera = truth[i].inverse() * p;
      const auto pixel = model.camera.project(in_camera);
      if (!pixel) continue;
      const double u = pixel->x() + 0.5 * random.normal(), v = pixel->y() + 0.5 * random.normal();
      const double outlier = observations.size() % 20 == 0 ? 30.0 : 0.0;
      observations.push_back({.pose = i,
                              .point = n,
                              .pixel = {u + outlier, v},
                              .right = model.right(u, in_camera.z()) + 0.5 * random.normal(),  // measured depth
                              .information = 4.0});                                            // 1 / sigma^2
    }
    points.push_back(p + 0.05 * orbis::vec3{random.normal(), random.normal(), random.normal()});
  }
  std::vector<orbis::se3> poses;
  for (const orbis::se3& T : truth) poses.push_back(T * orbis::se3::exp(orbis::vec6::Constant(0.01 * random.normal())));
  poses[0] = truth[0];
  const auto worst_error = [&] {
    double worst = 0.0;
    for (std::size_t i = 0; i != poses.size(); ++i)
      worst = std::max(worst, (poses[i].translation() - truth[i].translation()).norm());
    return worst;
  };

  std::printf("largest position error of a keyframe: %.1f mm before\n", 1e3 * worst_error());
  const std::vector<std::uint8_t> fixed{1, 0, 0, 0, 0, 0, 0, 0};  // the first pose defines the world frame
  bundle_adjuster adjuster{model, huber{2.8}};
  const bundle_summary summary = adjuster.solve(orbis::par, poses, points, observations, {.fixed_poses = fixed});
  std::printf("%.1f mm after %d iterations; cost %.0f -> %.0f\n", 1e3 * worst_error(), summary.iterations,
              summary.initial_cost, summary.final_cost);
  return worst_error() < 0.02 ? 0 : 1;
}

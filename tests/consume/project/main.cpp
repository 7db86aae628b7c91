// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <vector>

#include <orbis/cloud.hpp>
#include <orbis/octree.hpp>

#ifdef WITH_IO
#include <orbis/io/jpeg.hpp>
#include <orbis/io/synthetic.hpp>
#endif

#ifdef MIXED
std::size_t occupied_leaves_of_other_unit();  // other_unit.cpp
#endif

int main() {
  std::vector<std::array<float, 3>> points;
  for (int i = 0; i != 100; ++i)
    points.push_back({1.0F + 0.001F * static_cast<float>(i % 10), 0.001F * static_cast<float>(i / 10), 0.0F});
  points.push_back({9.0F, 9.0F, 9.0F});
  const auto keep = orbis::cloud::statistical_inliers(orbis::seq, points, {.neighbors = 8, .sigma_multiplier = 1.0});
  orbis::octree::occupancy_octree<> map{0.05};
  map.integrate(points, std::array<float, 3>{0.0F, 0.0F, 0.0F}, {.max_range = 5.0});
  const bool right = !keep.empty() && keep.back() != 100 &&
                     map.state(std::array<float, 3>{1.001F, 0.001F, 0.0F}) == orbis::octree::occupancy::occupied;
#ifdef MIXED
  if (map.num_occupied_leaves() != occupied_leaves_of_other_unit()) return 2;
#endif
#ifdef WITH_IO
  const auto frame = orbis::io::synthetic_recording{{.frames = 1, .width = 32, .height = 24}}.frame(0);
  if (!frame || !orbis::io::encode_jpeg(frame->color.view())) return 3;
#endif
  return right ? 0 : 1;
}

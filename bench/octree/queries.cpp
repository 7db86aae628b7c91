// SPDX-License-Identifier: BSD-3-Clause
//
// Search, rays and leaves in the map of 50 frames. Both sides answer the same questions, and a row whose
// answers differ from ours fails.
#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include <orbis/core/random.hpp>

#include "octree/peers.hpp"

namespace orbis::bench {
namespace {

/// Points all over the part of the room that has been seen, in random order or along lines.
std::vector<vec3f> query_points(bool coherent) {
  random_bits random{1};
  const octree::bounding_box seen = room_map(0.05).bounds().value();
  const auto any = [&] {
    vec3f p;
    for (int i = 0; i != 3; ++i) p[i] = static_cast<float>(random.uniform(seen.min[i], seen.max[i]));
    return p;
  };
  std::vector<vec3f> points;
  while (points.size() < 100000) {
    const vec3f a = any(), b = any();
    const int steps = coherent ? 100 : 1;
    for (int i = 0; i != steps; ++i) points.emplace_back(a + (b - a) * (static_cast<float>(i) * 0.01F));
  }
  return points;
}

struct answer {
  std::size_t count = 0;
  double sum = 0.0;
  friend bool operator==(const answer&, const answer&) = default;
};

answer search(const map& m, const std::vector<vec3f>& points) {
  answer all;
  for (const vec3f& p : points)
    if (const auto value = m.log_odds(p)) {
      ++all.count;
      all.sum += static_cast<double>(*value);
    }
  return all;
}
/// Through an accessor, which remembers where it looked last.
answer search_with_accessor(const map& m, const std::vector<vec3f>& points) {
  answer all;
  auto look = m.accessor();
  for (const vec3f& p : points)
    if (const auto value = look.log_odds(p)) {
      ++all.count;
      all.sum += static_cast<double>(*value);
    }
  return all;
}
answer search(const octomap::OcTree& m, const std::vector<vec3f>& points) {
  answer all;
  for (const vec3f& p : points)
    if (const auto* node = m.search(to_octomap(p))) {
      ++all.count;
      all.sum += static_cast<double>(node->getLogOdds());
    }
  return all;
}

/// Rays from a frame's camera through every 97th pixel or so, unknown voxels ignored.
answer cast_rays(const map& m, const vec3f& origin, const std::vector<vec3f>& directions) {
  answer all;
  for (const vec3f& d : directions)
    if (const auto hit = m.cast_ray(origin, d, 5.0, true)) {
      ++all.count;
      all.sum += static_cast<double>(static_cast<float>(hit.point.x()));
    }
  return all;
}
/// All of them in one call.
answer cast_batch(const map& m, const vec3f& origin, const std::vector<vec3f>& directions,
                  std::vector<octree::ray_hit>& hits) {
  answer all;
  hits.resize(directions.size());
  octree::cast_rays(seq, m, origin, directions, {.max_range = 5.0, .ignore_unknown = true}, hits);
  for (const octree::ray_hit& hit : hits)
    if (hit) {
      ++all.count;
      all.sum += static_cast<double>(static_cast<float>(hit.point.x()));
    }
  return all;
}
answer cast_rays(const octomap::OcTree& m, const vec3f& origin, const std::vector<vec3f>& directions) {
  answer all;
  octomap::point3d end;
  for (const vec3f& d : directions)
    if (m.castRay(to_octomap(origin), to_octomap(d), end, true, 5.0)) {
      ++all.count;
      all.sum += static_cast<double>(end.x());
    }
  return all;
}

/// The number of leaves, and the volume of the occupied ones.
answer leaves(const map& m) {
  answer all;
  m.for_each_leaf([&](const auto& leaf) {
    ++all.count;
    all.sum += leaf.occupied ? leaf.size * leaf.size * leaf.size : 0.0;
  });
  return all;
}
answer leaves(const octomap::OcTree& m) {
  answer all;
  for (auto it = m.begin_leafs(), end = m.end_leafs(); it != end; ++it) {
    const double size = it.getSize();
    ++all.count;
    all.sum += m.isNodeOccupied(*it) ? size * size * size : 0.0;
  }
  return all;
}

/// The sum of the coordinates of the centres of all leaves.
answer centers(const map& m) {
  answer all;
  m.for_each_leaf([&](const auto& leaf) {
    ++all.count;
    all.sum += leaf.center.x() + leaf.center.y() + leaf.center.z();
  });
  return all;
}
answer centers(const octomap::OcTree& m) {
  answer all;
  for (auto it = m.begin_leafs(), end = m.end_leafs(); it != end; ++it) {
    ++all.count;
    all.sum += it.getX() + it.getY() + it.getZ();
  }
  return all;
}

/// The number of nodes of the pruned tree.
answer count(const map& m) { return {m.size(), 0.0}; }
answer count(const octomap::OcTree& m) { return {m.calcNumNodes(), 0.0}; }

std::vector<vec3f> ray_directions() {
  const scan& s = room().front();
  const auto points = s.points();
  std::vector<vec3f> directions;
  for (std::size_t i = 0; i < points.size(); i += 97) directions.push_back(points[i] - s.origin());
  return directions;
}

/// Times `ask(map)` and compares the answer with that of our map.
template <class Map, class Ask>
void bench_query(benchmark::State& state, double resolution, Ask&& ask) {
  const Map& m = room_as<Map>(resolution);
  const answer expected = ask(room_map(resolution));
  answer got;
  for (auto _ : state) {
    got = ask(m);
    benchmark::DoNotOptimize(got);
  }
  if (!(got == expected) || got.count == 0) state.SkipWithError("not our answer");
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(got.count));
}

template <class Map>
void add_rows(const std::string& who, double r) {
  const std::string size = in_centimetres(r) + "/";
  for (const bool coherent : {false, true})
    add_row("octree_search/" + size + (coherent ? "coherent/" : "random/") + who, [=](auto& state) {
      const auto points = query_points(coherent);
      bench_query<Map>(state, r, [&](const auto& m) { return search(m, points); });
    });
  add_row("octree_cast_ray/" + size + who, [=](auto& state) {
    const auto directions = ray_directions();
    bench_query<Map>(state, r, [&](const auto& m) { return cast_rays(m, room().front().origin(), directions); });
  });
  add_row("octree_leaves/" + size + who,
          [=](auto& state) { bench_query<Map>(state, r, [](const auto& m) { return leaves(m); }); });
  add_row("octree_leaf_centers/" + size + who,
          [=](auto& state) { bench_query<Map>(state, r, [](const auto& m) { return centers(m); }); });
  add_row("octree_size/" + size + who,
          [=](auto& state) { bench_query<Map>(state, r, [](const auto& m) { return count(m); }); });
}
/// What OctoMap has no second way for.
void add_own_rows(double r) {
  const std::string size = in_centimetres(r) + "/";
  for (const bool coherent : {false, true})
    add_row("octree_search/" + size + (coherent ? "coherent/" : "random/") + "orbis_accessor", [=](auto& state) {
      const auto points = query_points(coherent);
      bench_query<map>(state, r, [&](const map& m) { return search_with_accessor(m, points); });
    });
  add_row("octree_cast_ray/" + size + "orbis_batch", [=](auto& state) {
    const auto directions = ray_directions();
    std::vector<octree::ray_hit> hits;
    bench_query<map>(state, r, [&](const map& m) { return cast_batch(m, room().front().origin(), directions, hits); });
  });
}

[[maybe_unused]] const bool registered = [] {
  for (const double resolution : {0.10, 0.05, 0.02}) {
    add_rows<map>("orbis", resolution);
    add_own_rows(resolution);
    add_rows<octomap::OcTree>("octomap", resolution);
  }
  return true;
}();

}  // namespace
}  // namespace orbis::bench

// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a few scans: resolution, then for each scan options, origin and points, among them NaN,
// infinities, points far outside the grid and points on the faces of voxels. The map must be OctoMap's,
// whatever the order of the points, their number of copies, and the number of threads.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/thread_pool.hpp>

#include "fuzz/octree.hpp"
#include "fuzz/source.hpp"
#include "octree/support.hpp"

namespace {

using namespace orbis;
using fuzz::source;
using octree::ray_mode;

struct scan {
  octree::integration_options options;
  vec3f origin;
  std::vector<vec3f> points;
  bool tame = true;   ///< everything is near, so that many copies can be afforded
  bool many = false;  ///< enough copies for several threads
};

[[nodiscard]] scan next_scan(source& from, double resolution, fuzz::ray_budget& rays) {
  constexpr double ranges[] = {std::numeric_limits<double>::infinity(), 0.0, 1.0, 7.25};  // voxels
  constexpr int most_points = 48, most_wild_points = 4;
  const unsigned flags = from.byte();
  scan s;
  s.options.mode = (flags & 1U) != 0 ? ray_mode::every_ray : ray_mode::discretized;
  s.options.max_range = ranges[flags >> 1U & 3U] * resolution;
  s.tame = (flags & 8U) == 0;
  s.many = s.tame && (flags & 192U) == 64U;
  s.origin = from.point(resolution, (flags & 24U) == 24U);
  // Everything in a far corner of OctoMap's grid, and beyond it.
  const vec3f corner = vec3f::Constant((flags & 32U) != 0 ? static_cast<float>(32760.0 * resolution) : 0.0F);
  s.origin += corner;
  int wild = 0;
  for (unsigned count = from.byte() % most_points; count != 0 && !from.empty(); --count) {
    const bool is_wild = !s.tame && (from.byte() & 3U) == 0 && ++wild <= most_wild_points;
    vec3f p = from.point(resolution, is_wild) + corner;
    // Many long rays take OctoMap, and what looks at the map, too long.
    if (octree::voxel_grid{resolution}.key(p)) {
      const double length = std::min<double>((p - s.origin).cast<double>().norm(), s.options.max_range);
      if (!rays.take(length, resolution)) p = s.origin;
    }
    s.points.push_back(p);
  }
  return s;
}

[[nodiscard]] std::string octomap_file(const octomap::OcTree& tree) {
  const fuzz::octomap_silence silence;
  return test::ot_of(tree);
}

/// OctoMap casts coordinates to int unchecked, knows no NaN, and runs away along a ray that is too short
/// for a float to tell its direction: it gets what we do not reject. False if it cannot be asked.
[[nodiscard]] bool insert_into_octomap(octomap::OcTree& tree, const scan& s) {
  const octree::voxel_grid grid{tree.getResolution()};
  const auto castable = [&](const vec3f& p) {
    return p.allFinite() && (p.cast<double>() / tree.getResolution()).cwiseAbs().maxCoeff() < 1e9;
  };
  if (!s.origin.allFinite()) return true;  // every point is rejected
  if (!castable(s.origin)) return false;
  std::vector<vec3f> points;
  for (const vec3f& p : s.points) {
    const double distance = (p - s.origin).cast<double>().norm();
    if (distance > 0.0 && distance < 1e-18) return false;
    const bool truncated = p.allFinite() && distance > s.options.max_range;
    if (s.options.mode == ray_mode::every_ray ? castable(p) || truncated : grid.key(p).has_value()) points.push_back(p);
  }
  const fuzz::octomap_silence silence;
  test::insert(tree, points, s.origin, s.options);
  return true;
}

void check_summary(const scan& s, const octree::integration_summary& done) {
  if (s.options.mode == ray_mode::every_ray)
    fuzz::require(done.used + done.truncated + done.rejected == s.points.size(), "every point is accounted for");
  else
    fuzz::require(done.used + done.truncated + done.rejected <= s.points.size(), "no point is counted twice");
  fuzz::require(done.occupied <= done.used, "no voxel is occupied without a point");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  orbis::fuzz::accept();  // any bytes mean something
  constexpr double resolutions[] = {0.05, 0.1, 0.02, 1.0, 0.0123456789, 1.0 / 3.0, 1e-3, 64.0};
  source from{{data, size}};
  const unsigned first = from.byte();
  const double resolution = resolutions[first & 7U];
  fuzz::map ours{resolution}, shuffled{resolution};
  static octomap::OcTree theirs{0.1};  // as in empty_octomap
  theirs.clear();
  theirs.setResolution(resolution);
  bool comparable = true;
  // The larger one is half a second with sanitizers.
  fuzz::ray_budget rays{(first & 0xF8U) == 0xF8U ? 32000.0 : 1500.0};
  for (int scans = 0; scans != 4 && !from.empty(); ++scans) {
    scan s = next_scan(from, resolution, rays);
    const auto done = ours.integrate(s.points, s.origin, s.options);
    check_summary(s, done);
    comparable = insert_into_octomap(theirs, s) && comparable;

    if (scans == 0) {
      std::size_t voxels = 0;
      ours.for_each_leaf([&](const fuzz::map::leaf& leaf) {
        const std::size_t edge = fuzz::edge_in_voxels(ours, leaf);
        voxels += edge * edge * edge;
      });
      fuzz::require(voxels == done.free + done.occupied, "a first scan leaves the voxels it counts, and no more");
    }

    // Copies, another order, several threads (which take part from some thousand points on).
    std::reverse(s.points.begin(), s.points.end());
    const std::size_t once = s.points.size(), copies = once == 0 ? 1 : s.many ? 9000 / once : s.tame ? 3 : 1;
    for (std::size_t i = once; i < copies * once; ++i) s.points.push_back(s.points[i - once]);
    static thread_pool threads{3};
    const auto again = shuffled.integrate(par.on(threads), s.points, s.origin, s.options);
    fuzz::require(again.free == done.free && again.occupied == done.occupied, "copies and order change nothing");
  }
  const std::string file = ot_bytes(ours);
  fuzz::require(ot_bytes(shuffled) == file, "the map does not depend on copies, order and threads");
  fuzz::require(!comparable || octomap_file(theirs) == file, "the map is OctoMap's");
  fuzz::check_map(ours);
  return 0;
}

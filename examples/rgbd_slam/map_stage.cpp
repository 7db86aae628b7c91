// SPDX-License-Identifier: BSD-3-Clause
#include "map_stage.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <orbis/io/ply.hpp>
#include <orbis/octree/files.hpp>

#include "../common/filter_text.hpp"
#include "filters.hpp"
#include "summary.hpp"
#include "view_frame.hpp"
#include "voxel_colors.hpp"

namespace app {
namespace {

using orbis::result;
using orbis::vec3f;
using tree = orbis::octree::occupancy_octree<>;

/// Returns freed memory to the system, even if it was freed in small blocks.
void give_back_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

std::string describe(const built_map& map) {
  return count_text(map.cloud.size()) + " points, " + count_text(map.filter.removed) + " removed by filter " +
         std::string{to_string(map.filter.mode)} + ", octree of " + count_text(map.octree.num_leaves()) + " leaves";
}

/// An octree in which the voxels of the points are occupied.
tree occupied_only(const std::vector<vec3f>& points, double resolution) {
  tree map{resolution};
  for (const vec3f& p : points)
    if (const auto key = map.grid().key(p); key && !map.log_odds(*key))
      map.set_unknown_node(*key, map.tree_depth(), orbis::octree::after_hit<tree::model>(0.0F));
  return map;
}

tree_numbers describe_tree(const tree& map, std::uintmax_t bytes) {
  const auto n = map.counts();
  return {n.leaves, n.occupied_leaves, n.free_leaves, bytes};
}

/// The occupied leaves, each with the mean colour of its points. `only`: indices of the points to use; null: all
/// points.
std::vector<voxel> occupied_voxels(const tree& map, const orbis::point_cloud& cloud,
                                   const std::vector<std::uint32_t>* only = nullptr) {
  voxel_colors colors{map.resolution()};
  const std::size_t count = !cloud.has_colors() ? 0 : only != nullptr ? only->size() : cloud.size();
  for (std::size_t k = 0; k != count; ++k) {
    const std::size_t i = only != nullptr ? (*only)[k] : k;
    colors.add(cloud.points[i], cloud.colors[i]);
  }
  std::vector<voxel> out;
  map.for_each_leaf([&](const tree::leaf& leaf) {
    if (!leaf.occupied) return;
    voxel v{leaf.center.cast<float>(), static_cast<float>(leaf.size), no_color};
    if (const auto color = colors.mean_color(v)) v.color = *color;
    out.push_back(v);
  });
  return out;
}

}  // namespace

orbis::mapping::dense_options dense_options(const frame_source& source, const settings& s) {
  orbis::mapping::dense_options options;
  options.stride = point_stride;
  options.max_depth = static_cast<float>(source.depth_limit(s));
  // Finer than the octree's voxels, so that the octree contains every surface; memory is proportional to the visible
  // surface, not to the duration.
  options.voxel_size = s.resolution / 5;
  return options;
}

result<built_map> map_frames(const posed_frames& frames, const frame_source& source, live_octree* live,
                             const settings& s, console& console) {
  console.stage("mapping");
  orbis::mapping::map_options options{
      .dense = dense_options(source, s), .filter = filter_options(s), .resolution = s.resolution};
  if (options.filter.kind == orbis::mapping::filter_kind::automatic) options.moving.emplace();
  orbis::thread_pool threads{s.threads};
  const auto policy = orbis::par.on(threads);
  const auto shown = console.progress();
  const auto progress = [&](std::size_t done, std::size_t total) {
    if (done % frames.size() == 0) give_back_memory();  // used by a pass over the frames
    return shown(done, total);
  };
  give_back_memory();  // used by tracking
  auto map = live != nullptr ? orbis::mapping::build_map(policy, frames, *live, options, progress)
                             : orbis::mapping::build_map(policy, frames, source.camera.model, options, progress);
  if (frames.read_error()) return orbis::fail(*frames.read_error());  // the map would be incomplete
  if (map) console.finish(describe(*map));
  return map;
}

built_map map_cloud(orbis::point_cloud cloud, const settings& s, console& console) {
  console.stage("mapping");
  built_map map{.octree = tree{s.resolution}};
  map.cloud = std::move(cloud);
  orbis::mapping::filter_options options = filter_options(s);
  options.automatic.sensor_origin = s.origin;
  orbis::mapping::filtered_indices filtered =
      orbis::mapping::filter_points(orbis::par.with(s.threads), map.cloud.points, {}, options);
  map.filter = std::move(filtered.report);
  map.inliers = std::move(filtered.inliers);

  const auto build = [&](const std::vector<vec3f>& points, std::vector<double>& milliseconds) {
    if (!s.origin) return occupied_only(points, s.resolution);
    tree scanned{s.resolution};
    const auto start = console::clock::now();
    scanned.integrate(orbis::par.with(s.threads), points, *s.origin, {.max_range = s.depth_limit()});
    milliseconds.push_back(std::chrono::duration<double, std::milli>(console::clock::now() - start).count());
    return scanned;
  };
  map.unfiltered_octree = build(map.cloud.points, map.insert_ms_unfiltered);
  map.octree = build(map.filtered_cloud().points, map.insert_ms);
  console.finish(describe(map));
  return map;
}

result<map_results> write_map(built_map map, const settings& s, const std::filesystem::path& folder, console& console) {
  console.stage("writing");
  map_results m;
  const auto write = [&](const char* name, const auto& how, std::uintmax_t& bytes) -> result<void> {
    const std::filesystem::path path = folder / name;
    if (auto done = how(path); !done) return done;
    std::error_code ignored;
    bytes = std::filesystem::file_size(path, ignored);
    return {};
  };
  const auto bt_writer = [](const tree& t) {
    return [&t](const auto& path) { return orbis::octree::write_bt(t, path); };
  };
  std::uintmax_t bt_bytes = 0, bt_bytes_unfiltered = 0;
  result<void> done = write(
      "cloud.ply", [&](const auto& path) { return orbis::io::write_ply(path, map.cloud); }, m.cloud_bytes);
  if (done)
    done = write(
        "cloud_filtered.ply", [&](const auto& path) { return orbis::io::write_ply(path, map.cloud, map.inliers); },
        m.filtered_bytes);
  if (done) done = write("map_unfiltered.bt", bt_writer(*map.unfiltered_octree), bt_bytes_unfiltered);
  if (done) done = write("map.bt", bt_writer(map.octree), bt_bytes);
  if (done)
    done = write(
        "map.ot", [&](const auto& path) { return orbis::octree::write_ot(map.octree, path); }, m.ot_bytes);
  if (!done) return orbis::fail(done.error());

  m.filter_mode = to_string(map.filter.mode);
  m.filter_reason =
      examples::moved_objects_text(map.moving.pixels, map.moving.keyframes) + examples::filter_text(map.filter);
  m.moving_pixels = map.moving.pixels;
  m.moving_keyframes = map.moving.keyframes;
  m.resolution = s.resolution;
  m.unfiltered = describe_tree(*map.unfiltered_octree, bt_bytes_unfiltered);
  m.filtered = describe_tree(map.octree, bt_bytes);
  m.insert_ms = std::move(map.insert_ms);
  m.voxels_unfiltered = occupied_voxels(*map.unfiltered_octree, map.cloud);
  m.voxels = occupied_voxels(map.octree, map.cloud, &map.inliers);
  m.kept = std::move(map.inliers);
  m.cloud = std::move(map.cloud);
  console.finish("cloud.ply, cloud_filtered.ply, map_unfiltered.bt, map.bt, map.ot");
  return m;
}

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of occupancy_octree.hpp.
#pragma once

#include <utility>

#include <orbis/octree/detail/mark/mark_scan.hpp>
#include <orbis/octree/detail/storage/apply_scan.hpp>
#include <orbis/octree/detail/storage/palette_kernels.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/scan.hpp>  // in header-only use, also the definitions of mark_scan.hpp

namespace orbis::octree {

namespace detail {

/// Returns the callback that finds the voxels of a map that a miss would not change.
template <sensor_model Model>
[[nodiscard]] saturated_voxels saturated_in(const brick_store<typename Model::value_type>& store) {
  using map = brick_store<typename Model::value_type>;
  return {.find =
              [](const void* of, std::uint64_t name, saturated_voxels::words& saturated) {
                find_saturated<Model>(*static_cast<const map*>(of), name, saturated);
              },
          .map = &store};
}

}  // namespace detail

template <sensor_model Model>
occupancy_octree<Model>::occupancy_octree(double resolution, int tree_depth) : grid_{resolution, tree_depth} {}
template <sensor_model Model>
occupancy_octree<Model>::occupancy_octree(double resolution, int tree_depth, detail::brick_store<value_type> store)
    : grid_{resolution, tree_depth}, store_{std::move(store)} {}
template <sensor_model Model>
occupancy_octree<Model>::occupancy_octree(const occupancy_octree&) = default;
template <sensor_model Model>
occupancy_octree<Model>::occupancy_octree(occupancy_octree&&) noexcept = default;
template <sensor_model Model>
occupancy_octree<Model>& occupancy_octree<Model>::operator=(const occupancy_octree&) = default;
template <sensor_model Model>
occupancy_octree<Model>& occupancy_octree<Model>::operator=(occupancy_octree&&) noexcept = default;
template <sensor_model Model>
occupancy_octree<Model>::~occupancy_octree() = default;

template <sensor_model Model>
integration_summary occupancy_octree<Model>::integrate_points(const parallel_policy& policy,
                                                              const detail::point_view& points,
                                                              const detail::float3& origin,
                                                              const integration_options& options) {
  begin_change();
  integration_summary summary;
  const detail::scan_masks& masks = detail::mark_points(policy, scratch_, grid_, points, origin, options, summary,
                                                        detail::saturated_in<Model>(store_));
  detail::apply_scan<Model>(store_, masks, summary, track_.on ? &track_.log : nullptr);
  return summary;
}

template <sensor_model Model>
integration_summary occupancy_octree<Model>::integrate_depth(const parallel_policy& policy,
                                                             const detail::depth_scan& scan, const se3& T_world_camera,
                                                             const integration_options& options) {
  begin_change();
  integration_summary summary;
  const detail::scan_masks& masks = detail::mark_depth(policy, scratch_, grid_, scan, T_world_camera, options, summary,
                                                       detail::saturated_in<Model>(store_));
  detail::apply_scan<Model>(store_, masks, summary, track_.on ? &track_.log : nullptr);
  return summary;
}

template <sensor_model Model>
integration_summary occupancy_octree<Model>::apply(const scan& voxels) {
  begin_change();
  integration_summary summary;
  for (const scan::part& p : voxels.parts())
    detail::apply_brick<Model>(
        store_, p.name, [&](const auto& visit) { voxels.for_each_octant(p, visit); }, summary,
        track_.on ? &track_.log : nullptr);
  return summary;
}

template <sensor_model Model>
void occupancy_octree<Model>::prune() {
  const std::vector<detail::tree_part<value_type>> parts = detail::tree_parts(store_, tree_depth());
  detail::large_leaves<value_type> merged;
  for (const auto& part : parts)
    if (part.level > detail::brick_level) merged.add(detail::node_name(part.key, part.level), part.value);
  const auto is_inside = [&](std::uint64_t name) {
    const auto* const leaf = merged.find(detail::named_key(name));
    return leaf != nullptr && leaf->name != name;
  };
  std::vector<std::uint64_t> bricks, large;
  store_.for_each_brick([&](const detail::brick<value_type>& b) {
    if (is_inside(b.name)) bricks.push_back(b.name);
  });
  store_.for_each_large([&](std::uint64_t name, value_type) {
    if (is_inside(name)) large.push_back(name);
  });
  store_.erase_bricks(bricks);
  store_.erase_large(large);
  for (std::size_t i = 0; i != merged.size(); ++i) {
    const auto& [name, v] = merged[i];
    if (store_.find_large_value(detail::named_key(name)) == nullptr)
      store_.set_node(detail::named_key(name), detail::named_level(name), v);
  }
}

template <sensor_model Model>
octree_counts occupancy_octree<Model>::counts() const {
  return detail::count_leaves<Model>(store_, tree_depth());
}

template <sensor_model Model>
std::optional<bounding_box> occupancy_octree<Model>::bounds() const {
  std::optional<bounding_box> box;
  for_each_leaf([&](const leaf& l) {
    const vec3 low = shifted(l.center, -l.size / 2.0), high = shifted(low, l.size);
    if (!box) box = bounding_box{low, high};
    box->min = entrywise_min(box->min, low);
    box->max = entrywise_max(box->max, high);
  });
  return box;
}

template <sensor_model Model>
void occupancy_octree<Model>::replace_octant(const voxel_key& k, const block<value_type>& before,
                                             block<value_type>& after) {
  std::uint64_t changed = before.known ^ after.known;
  for (unsigned i = 0; i != 64; ++i) {
    after.value[i] = (after.known >> i & 1U) != 0 ? without_sign_of_zero(after.value[i]) : value_type{};
    changed |= std::uint64_t{before.value[i] != after.value[i]} << i;
  }
  if (changed == 0) return;
  detail::brick<value_type>& b = store_.make(k);
  store_.write_octant(b, detail::place_in_brick(k) >> 6U, after);
  if (track_.on) track_.log.record(k, changed);
  if (!b.is_known()) store_.erase_bricks(std::array{b.name});
}

template <sensor_model Model>
void occupancy_octree<Model>::note_brick(const voxel_key& k, int level) {
  if (!track_.on) return;
  const detail::brick<value_type>* const b = level == detail::brick_level ? store_.find(k) : nullptr;
  if (b == nullptr) return note_node(k, level);
  for (unsigned i = 0; i != 8; ++i)
    track_.log.record(child_key(k, i, node_cells(detail::octant_level)), store_.known(*b, i));
}

template <sensor_model Model>
void occupancy_octree<Model>::note_node(const voxel_key& k, int level) {
  if (!track_.on) return;
  change_log& log = track_.log;
  if (level > detail::brick_level) {
    lose_track();
  } else if (level == detail::brick_level) {
    for (unsigned i = 0; i != 8; ++i) log.record(child_key(k, i, node_cells(detail::octant_level)), ~std::uint64_t{0});
  } else {
    const std::uint64_t inside = level == 0 ? 1U : level == 1 ? 0xffU : ~std::uint64_t{0};
    log.record(k, inside << (detail::place_in_brick(k) & 63U));
  }
}

}  // namespace orbis::octree

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Merges two maps into one.
#pragma once

#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/hash_index.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/octree/detail/storage/large_leaves.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/occupancy_octree.hpp>

namespace orbis::octree {

struct merge_summary {
  std::size_t merged = 0;  ///< voxels that got evidence from the other map
  bool cancelled = false;  ///< by the progress callback; some voxels have been merged, some have not
};

namespace detail {

/// The sum of two beliefs within the model's bounds.
template <sensor_model M>
[[nodiscard]] constexpr typename M::value_type sum_of(typename M::value_type a, typename M::value_type b) noexcept {
  using T = typename M::value_type;
  using wide = std::conditional_t<std::integral<T>, std::int64_t, T>;
  const wide sum = static_cast<wide>(a) + static_cast<wide>(b);
  return static_cast<T>(std::clamp<wide>(sum, M::clamp_min, M::clamp_max));
}

/// The octants of `grid` that the axis-aligned box overlaps, appended by their lowest voxels.
inline void append_octants(const voxel_grid& grid, const vec3& low, const vec3& high, std::vector<voxel_key>& octants) {
  const auto box = keys_between(grid, low, high);
  if (!box) return;
  const voxel_key first = node_key(box->low, octant_level);
  for (std::uint32_t z = first.z; z <= box->high.z; z += 4)
    for (std::uint32_t y = first.y; y <= box->high.y; y += 4)
      for (std::uint32_t x = first.x; x <= box->high.x; x += 4) octants.push_back({x, y, z});
}

/// The names of the nodes above bricks inside which something is stored. O(bricks).
template <class T>
[[nodiscard]] hash_index inner_nodes(const brick_store<T>& store, int root_level) {
  hash_index nodes;
  const auto add_above = [&](std::uint64_t name) {
    for (int level = named_level(name) + 1; level <= root_level; ++level) {
      const std::uint64_t above = node_name(named_key(name), level);
      if (nodes.find(above) != hash_index::none) return;  // and so are those above it
      nodes.set(above, 0);
    }
  };
  store.for_each_brick([&](const brick<T>& b) { add_above(b.name); });
  store.for_each_large([&](std::uint64_t name, T) { add_above(name); });
  return nodes;
}

/// The leaves above bricks of `from` in whose place `into`, on the same grid, knows nothing.
template <class T>
[[nodiscard]] large_leaves<T> new_leaves(const brick_store<T>& into, const brick_store<T>& from, int root_level) {
  large_leaves<T> found;
  if (!from.has_large()) return found;
  const hash_index inner = inner_nodes(into, root_level);
  from.for_each_large([&](std::uint64_t name, T v) {
    if (into.find_large_value(named_key(name)) == nullptr && inner.find(name) == hash_index::none) found.add(name, v);
  });
  return found;
}

/// The octants of `grid` in which something known of `from` may lie, moved by `T`, but none inside the
/// leaves `taken`; each once, in a fixed order.
template <sensor_model Model>
[[nodiscard]] std::vector<voxel_key> octants_around(const voxel_grid& grid, const occupancy_octree<Model>& from,
                                                    const se3& T,
                                                    const large_leaves<typename Model::value_type>& taken) {
  std::vector<voxel_key> octants;
  const mat3 extent = T.rotation_matrix().cwiseAbs();
  const auto add = [&](const voxel_key& k, int level) {
    const vec3 center = T * from.grid().center(k, level);
    const vec3 half = extent * vec3::Constant(from.grid().node_size(level) * 0.5 * (1.0 + 1e-9));
    append_octants(grid, center - half, center + half, octants);
  };
  from.store().for_each_brick([&](const auto& b) {
    for (unsigned i = 0; i != 8; ++i) {
      const voxel_key octant = child_key(named_key(b.name), i, node_cells(octant_level));
      if (((b.uniform | b.dense) >> i & 1U) != 0) add(octant, octant_level);
    }
  });
  from.store().for_each_large([&](std::uint64_t name, auto) {
    if (taken.find(named_key(name)) == nullptr) add(named_key(name), named_level(name));
  });
  // The neighbours of a leaf touch octants inside it.
  std::erase_if(octants, [&](const voxel_key& k) { return taken.find(k) != nullptr; });
  const auto before = [](const voxel_key& a, const voxel_key& b) {
    return node_name(a, octant_level) < node_name(b, octant_level);
  };
  std::sort(octants.begin(), octants.end(), before);
  octants.erase(std::unique(octants.begin(), octants.end()), octants.end());
  return octants;
}

}  // namespace detail

/// Adds the evidence of `from` to `into`. For every voxel of `into` whose centre lies in a known voxel of `from`, the
/// log-odds of that voxel are added, within the model's bounds; this takes the two maps to be made of independent
/// observations. `T_into_from` moves points of `from` to the frame of `into`. Resolutions may differ. With the same
/// grid and the identity, or a shift by whole voxels, the result is the sum of the two maps voxel by voxel. Otherwise
/// every voxel takes the value of the nearest one, and surfaces move by up to half a voxel's diagonal.
///
/// All policies give the same map. Time and memory O(octants of `into` in the volume known to `from`). With the same
/// grid and the identity, leaves bigger than a brick whose place is unknown in `into` cost O(1) each.
template <execution_policy Policy, sensor_model Model>
merge_summary merge(const Policy& policy, occupancy_octree<Model>& into, const occupancy_octree<Model>& from,
                    const se3& T_into_from = {}, progress report = {}) {
  using value_type = typename Model::value_type;
  const occupancy_octree<Model> source = from;  // costs nothing, and may be `into` itself
  const bool same_frame = into.grid() == from.grid() && T_into_from.to_matrix().isIdentity(0.0);
  merge_summary summary;
  const auto taken = same_frame ? detail::new_leaves(into.store(), source.store(), into.tree_depth())
                                : detail::large_leaves<value_type>{};
  for (std::size_t i = 0; i != taken.size(); ++i) {
    const auto& [name, v] = taken[i];
    into.set_unknown_node(detail::named_key(name), into.tree_depth() - detail::named_level(name),
                          std::clamp(v, Model::clamp_min, Model::clamp_max));
    summary.merged += std::size_t{1} << (3 * static_cast<unsigned>(detail::named_level(name)));
  }
  const std::vector<voxel_key> octants = detail::octants_around(into.grid(), source, T_into_from, taken);
  const se3 T_from_into = T_into_from.inverse();
  const mat3 rotation = T_from_into.rotation_matrix();
  const vec3 translation = T_from_into.translation();

  constexpr std::size_t batch = 4096;
  std::vector<block<value_type>> found(std::min(batch, octants.size()));
  for (std::size_t begin = 0; begin < octants.size(); begin += batch) {
    if (!report(begin, octants.size())) {
      summary.cancelled = true;
      return summary;
    }
    const std::size_t count = std::min(batch, octants.size() - begin);
    for_each_index(policy, count, 64, [&](std::size_t i) {
      block<value_type>& b = found[i];
      b = {};
      const voxel_key& octant = octants[begin + i];
      for (std::uint32_t place = 0; place != 64; ++place) {
        const voxel_key in = detail::voxel_in_brick(place);
        const voxel_key k{octant.x + in.x, octant.y + in.y, octant.z + in.z};
        const vec3 p = rotation * into.grid().center(k) + translation;
        if (const auto v = source.value(p)) {
          b.value[place] = *v;
          b.known |= std::uint64_t{1} << place;
        }
      }
    });
    const std::span<const voxel_key> part{octants.data() + begin, count};
    std::size_t i = 0;
    into.edit_octants(part, [&](const voxel_key&, block<value_type>& voxels) {
      const block<value_type>& b = found[i++];
      summary.merged += static_cast<std::size_t>(std::popcount(b.known));
      for (std::uint64_t rest = b.known; rest != 0; rest &= rest - 1) {
        const auto place = static_cast<std::size_t>(std::countr_zero(rest));
        voxels.value[place] = detail::sum_of<Model>(voxels.value[place], b.value[place]);
      }
      voxels.known |= b.known;
    });
  }
  return summary;
}
template <sensor_model Model>
merge_summary merge(occupancy_octree<Model>& into, const occupancy_octree<Model>& from, const se3& T_into_from = {},
                    progress report = {}) {
  return merge(seq, into, from, T_into_from, report);
}

}  // namespace orbis::octree

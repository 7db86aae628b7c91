// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The leaves of the pruned octree, straight from the bricks: the same as `pruned_tree` visits, but
/// without the inner nodes' values, which take most of its time.
#pragma once

#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/octree/brick.hpp>
#include <orbis/octree/pruned_tree.hpp>

namespace orbis::octree {

namespace detail {

/// A brick, or a leaf at least as large as one.
template <class T>
struct leaf_part {
  std::uint64_t order;      ///< Morton order of its lowest brick
  voxel_key key;            ///< its lowest voxel
  int level;                ///< brick_level or more
  const brick<T>* content;  ///< null: a leaf
  T value;
};

/// The bricks and larger leaves of a store in Morton order, equal ones merged as far as they go.
template <class T>
[[nodiscard]] std::vector<leaf_part<T>> leaf_parts(const brick_store<T>& store, int root_level) {
  std::vector<leaf_part<T>> parts;
  parts.reserve(store.brick_count() + store.large_count());
  store.for_each_brick([&](const brick<T>& b) {
    if (!b.is_known()) return;
    const voxel_key key = named_key(b.name);
    parts.push_back({morton_order(key), key, brick_level, b.is_uniform() ? nullptr : &b, b.value[0]});
  });
  if (store.has_large()) {
    store.for_each_large([&](std::uint64_t name, T v) {
      const voxel_key key = named_key(name);
      parts.push_back({morton_order(key), key, named_level(name), nullptr, v});
    });
    std::sort(parts.begin(), parts.end(),
              [](const leaf_part<T>& a, const leaf_part<T>& b) { return a.order < b.order; });
  }

  // The merged ones take the place of those read already. Eight leaves of one size that end with a
  // parent's last child are its children.
  std::size_t size = 0;
  for (std::size_t i = 0; i != parts.size(); ++i) {
    parts[size++] = parts[i];
    for (;;) {
      const leaf_part<T>& last = parts[size - 1];
      const std::uint64_t cells = std::uint64_t{1} << (3 * static_cast<unsigned>(last.level - brick_level));
      if (last.content != nullptr || last.level >= root_level - 1 || size < 8 || (last.order / cells & 7U) != 7) break;
      const auto first = parts.begin() + static_cast<std::ptrdiff_t>(size - 8);
      const bool equal = std::all_of(first, first + 8, [&](const leaf_part<T>& p) {
        return p.content == nullptr && p.level == last.level && p.value == last.value &&
               p.order / (8 * cells) == last.order / (8 * cells);
      });
      if (!equal) break;
      ++first->level;
      size -= 7;
    }
  }
  parts.resize(size);
  return parts;
}

}  // namespace detail

/// Calls `visit(key, level, value)` for every leaf of the pruned octree whose root is at `root_level`,
/// in the order of `pruned_tree::visit`. Returns the number of inner nodes. O(known voxels).
template <class T, std::invocable<const voxel_key&, int, T> Visit>
std::size_t visit_leaves(const brick_store<T>& store, int root_level, Visit&& visit) {
  std::size_t inner = 0;
  const auto visit_voxels = [&](const voxel_key& octant, const block<T>& b) {
    for (std::uint32_t place = 0; place != 64; place += 8) {
      const auto known = static_cast<unsigned>(b.known >> place & 0xffU);
      if (known == 0) continue;
      const T* const v = b.value.data() + place;
      const auto key = [&](std::uint32_t i) {
        const voxel_key k = voxel_in_brick(place + i);
        return voxel_key{octant.x + k.x, octant.y + k.y, octant.z + k.z};
      };
      if (known == 0xff && std::all_of(v, v + 8, [&](T other) { return other == v[0]; })) {
        visit(key(0), 1, v[0]);
        continue;
      }
      ++inner;
      for (unsigned bits = known; bits != 0; bits &= bits - 1) {
        const auto i = static_cast<std::uint32_t>(std::countr_zero(bits));
        visit(key(i), 0, v[i]);
      }
    }
  };
  block<T> voxels;
  const auto visit_brick = [&](const voxel_key& key, const brick<T>& b) {
    for (std::uint32_t i = 0; i != 8; ++i) {
      const voxel_key octant = child_key(key, i, node_cells(octant_level));
      if ((b.uniform >> i & 1U) != 0) visit(octant, octant_level, b.value[i]);
      if ((b.dense >> i & 1U) == 0) continue;
      ++inner;
      store.read_octant(b, i, voxels);
      visit_voxels(octant, voxels);
    }
  };

  const std::vector<detail::leaf_part<T>> parts = detail::leaf_parts(store, root_level);
  for (std::size_t i = 0; i != parts.size(); ++i) {
    const detail::leaf_part<T>& part = parts[i];
    // Its ancestors, but for those it has in common with the part before it.
    const auto differing = static_cast<int>(i == 0 ? 0 : std::bit_width(part.order ^ parts[i - 1].order));
    const int lowest_common = i == 0 ? root_level + 1 : brick_level + (differing + 2) / 3;
    inner += static_cast<std::size_t>(lowest_common - 1 - part.level);
    if (part.content == nullptr) {
      visit(part.key, part.level, part.value);
    } else {
      ++inner;
      visit_brick(part.key, *part.content);
    }
  }
  return inner;
}

}  // namespace orbis::octree

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The upper levels of a pruned octree, down to its bricks, as a sorted list, for algorithms that visit the whole tree.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/octree/detail/storage/brick.hpp>

namespace orbis::octree::detail {

/// A brick that is not a leaf, or a leaf of at least the size of a brick.
template <class T>
struct tree_part {
  std::uint64_t order;      ///< Morton order of the part's lowest brick
  voxel_key key;            ///< the part's lowest voxel
  int level;                ///< brick_level or more
  const brick<T>* content;  ///< null: the part is a leaf
  T value;                  ///< value of the leaf
};

/// Returns the bricks and larger leaves of a store in Morton order. O(bricks).
template <class T>
[[nodiscard]] std::vector<tree_part<T>> stored_parts(const brick_store<T>& store) {
  std::vector<tree_part<T>> parts;
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
    std::sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.order < b.order; });
  }
  return parts;
}

/// Repeatedly merges groups of eight equal leaves that fill their parent. The root is not merged. @pre `parts` are in
/// Morton order
template <class T>
void merge_parts(std::vector<tree_part<T>>& parts, int root_level) {
  // Merged parts overwrite parts already read. Eight leaves of one size that end with a parent's last child are the
  // children of that parent.
  std::size_t size = 0;
  for (std::size_t i = 0; i != parts.size(); ++i) {
    parts[size++] = parts[i];
    for (;;) {
      const tree_part<T>& last = parts[size - 1];
      const auto shift = 3 * static_cast<unsigned>(last.level - brick_level);
      if (last.content != nullptr || last.level >= root_level - 1 || size < 8 || (last.order >> shift & 7U) != 7) break;
      const auto first = parts.begin() + static_cast<std::ptrdiff_t>(size - 8);
      const bool equal = std::all_of(first, first + 8, [&](const tree_part<T>& p) {
        return p.content == nullptr && p.level == last.level && p.value == last.value &&
               p.order >> (shift + 3) == last.order >> (shift + 3);
      });
      if (!equal) break;
      ++first->level;
      size -= 7;
    }
  }
  parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(size), parts.end());
}

/// Returns the parts of a store's pruned octree: its leaves of at least the size of a brick, and the bricks that have
/// smaller leaves. O(bricks).
template <class T>
[[nodiscard]] std::vector<tree_part<T>> tree_parts(const brick_store<T>& store, int root_level) {
  std::vector<tree_part<T>> parts = stored_parts(store);
  merge_parts(parts, root_level);
  return parts;
}

/// Walks the part of a tree above its bricks, children before parents. `Visitor` has `open()`, which begins an inner
/// node and returns a collector of its children with `add(i, child)`; `close(level, collected)`, which returns the
/// value that is passed to the parent's `add`; and `content(part)`, which returns such a value for a part.
template <class T, class Visitor>
class upper_walk {
 public:
  upper_walk(const std::vector<tree_part<T>>& parts, Visitor& visitor)
      : next_{parts.data()}, end_{parts.data() + parts.size()}, visitor_{visitor} {}

  /// Walks a node. @pre the remaining parts begin with those inside one node at `level`, which this call visits
  auto walk(int level) {
    if (next_->level == level) return visitor_.content(*next_++);
    const auto shift = 3 * static_cast<unsigned>(level - 1 - brick_level);
    const std::uint64_t first = next_->order >> shift & ~std::uint64_t{7};
    auto open = visitor_.open();
    for (unsigned i = 0; i != 8; ++i)
      if (next_ != end_ && next_->order >> shift == first + i) open.add(i, walk(level - 1));
    return visitor_.close(level, open);
  }

 private:
  const tree_part<T>* next_;
  const tree_part<T>* end_;
  Visitor& visitor_;
};

}  // namespace orbis::octree::detail

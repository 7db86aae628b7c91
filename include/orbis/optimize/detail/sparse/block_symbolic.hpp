// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Symbolic Cholesky factorisation of a block-sparse matrix: the structure of the factor, which is independent of the
/// values.
///
/// Sources: J. W. H. Liu, "The role of elimination trees in sparse factorization", SIAM J. Matrix
/// Anal. Appl. 11(1), 1990; C. Ashcraft, R. Grimes, "The influence of relaxed supernode partitions on
/// the multifrontal method", ACM TOMS 15(4), 1989.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/optimize/detail/sparse/block_ordering.hpp>

namespace orbis::optimize::detail {

/// Consecutive block columns of the factor with the same rows below them, stored as one dense panel.
struct supernode {
  std::uint32_t first = 0;     ///< first block column, in the order of elimination
  std::uint32_t columns = 0;   ///< number of block columns
  std::size_t rows_begin = 0;  ///< start in `block_symbolic::rows` of the rows below its diagonal block, ascending
  std::uint32_t rows = 0;      ///< number of block rows
};

/// The update of a supernode by an earlier one, `source`: the rows `[begin, end)` of the panel of `source` correspond
/// to columns of the updated supernode.
struct supernode_update {
  std::uint32_t source = 0;
  std::uint32_t begin = 0, end = 0;  ///< positions in the source's rows
};

/// The structure of a factor `L` with `P A P^T = L L^T`.
struct block_symbolic {
  std::vector<std::uint32_t> order;     ///< `order[k]`: the block of A that becomes the k-th block of the factor
  std::vector<std::uint32_t> position;  ///< inverse of `order`
  std::vector<supernode> supernodes;    ///< in the order of elimination
  std::vector<std::uint32_t> rows;
  std::vector<std::uint32_t> supernode_of;  ///< supernode of each block column of the factor
  std::vector<supernode_update> updates;    ///< ordered by target, then by source
  std::vector<std::size_t> first_update;    ///< index of each target's first update; one extra entry at the end
  std::size_t factor_blocks = 0;  ///< number of blocks in the lower triangle of the panels, including explicit zeros

  [[nodiscard]] std::size_t size() const { return order.size(); }
  [[nodiscard]] std::span<const std::uint32_t> rows_of(const supernode& s) const {
    return std::span{rows}.subspan(s.rows_begin, s.rows);
  }
  [[nodiscard]] std::span<const supernode_update> updates_of(std::size_t target) const {
    return std::span{updates}.subspan(first_update[target], first_update[target + 1] - first_update[target]);
  }
};

inline constexpr std::uint32_t no_block = std::numeric_limits<std::uint32_t>::max();

/// Returns the parent of each column: its first nonzero row below the diagonal.
template <class = void>
[[nodiscard]] std::vector<std::uint32_t> elimination_tree(const block_adjacency& graph,
                                                          const std::vector<std::uint32_t>& order,
                                                          const std::vector<std::uint32_t>& position) {
  std::vector<std::uint32_t> parent(order.size(), no_block), ancestor(order.size(), no_block);
  for (std::uint32_t k = 0; k != order.size(); ++k)
    for (const std::uint32_t neighbor : graph.neighbors(order[k])) {
      std::uint32_t i = position[neighbor];
      while (i < k) {
        const std::uint32_t up = ancestor[i];
        ancestor[i] = k;  // path compression
        if (up == no_block) parent[i] = k;
        if (up == no_block || up == k) break;
        i = up;
      }
    }
  return parent;
}

/// Returns a postorder of the columns: every subtree is consecutive, and children precede their parent.
template <class = void>
[[nodiscard]] std::vector<std::uint32_t> postorder(const std::vector<std::uint32_t>& parent) {
  const std::size_t n = parent.size();
  std::vector<std::uint32_t> child(n, no_block), sibling(n, no_block), stack, result;
  result.reserve(n);
  for (std::size_t i = n; i != 0; --i)
    if (const std::uint32_t p = parent[i - 1]; p != no_block) {
      sibling[i - 1] = child[p];
      child[p] = static_cast<std::uint32_t>(i - 1);
    }
  for (std::uint32_t root = 0; root != n; ++root) {
    if (parent[root] != no_block) continue;
    stack.push_back(root);
    while (!stack.empty()) {
      const std::uint32_t i = stack.back();
      if (child[i] != no_block) {
        stack.push_back(child[i]);
        child[i] = sibling[child[i]];
      } else {
        result.push_back(i);
        stack.pop_back();
      }
    }
  }
  return result;
}

/// Returns the number of blocks in each column of the factor, including the diagonal.
template <class = void>
[[nodiscard]] std::vector<std::uint32_t> column_counts(const block_adjacency& graph, const block_symbolic& symbolic,
                                                       const std::vector<std::uint32_t>& parent) {
  std::vector<std::uint32_t> count(parent.size(), 1), seen(parent.size(), no_block);
  for (std::uint32_t k = 0; k != parent.size(); ++k) {
    seen[k] = k;
    for (const std::uint32_t neighbor : graph.neighbors(symbolic.order[k]))
      for (std::uint32_t i = symbolic.position[neighbor]; i < k && seen[i] != k; i = parent[i]) {
        seen[i] = k;
        ++count[i];
      }
  }
  return count;
}

/// Returns true if one panel with `zeros` zero blocks among `blocks` blocks is faster than two panels.
[[nodiscard]] inline bool worth_merging(std::size_t columns, std::size_t zeros, std::size_t blocks) {
  const double share = static_cast<double>(zeros) / static_cast<double>(blocks);
  return zeros == 0 || (columns <= 4 && share < 0.4) || (columns <= 12 && share < 0.15) || share < 0.05;
}

/// Groups columns; sets all members of the supernodes except their rows.
template <class = void>
void group_columns(block_symbolic& symbolic, const std::vector<std::uint32_t>& parent,
                   const std::vector<std::uint32_t>& count) {
  struct group {
    std::uint32_t first, last;
    std::size_t rows;  ///< number of rows below the last column
    std::size_t zeros;
  };
  const auto blocks = [](std::size_t columns, std::size_t rows) {
    return columns * (columns + 1) / 2 + columns * rows;
  };
  std::vector<group> groups;
  for (std::uint32_t k = 0; k != parent.size(); ++k) {
    groups.push_back({k, k, count[k] - std::size_t{1}, 0});
    while (groups.size() > 1) {  // merge with the last child, which ends where this one begins
      const group& top = groups.back();
      const group& child = groups[groups.size() - 2];
      if (parent[child.last] == no_block || parent[child.last] > top.last) break;
      const std::size_t columns = top.last - child.first + std::size_t{1};
      const std::size_t all = blocks(columns, top.rows);
      const std::size_t used = blocks(child.last - child.first + std::size_t{1}, child.rows) - child.zeros +
                               blocks(top.last - top.first + std::size_t{1}, top.rows) - top.zeros;
      if (!worth_merging(columns, all - used, all)) break;
      const group merged{child.first, top.last, top.rows, all - used};
      groups.pop_back();
      groups.back() = merged;
    }
  }
  symbolic.supernode_of.resize(parent.size());
  for (const group& g : groups) {
    for (std::uint32_t k = g.first; k <= g.last; ++k)
      symbolic.supernode_of[k] = static_cast<std::uint32_t>(symbolic.supernodes.size());
    symbolic.supernodes.push_back({g.first, g.last - g.first + 1, 0, 0});
  }
}

/// Computes the rows of every supernode: those of its columns and of its children.
template <class = void>
void find_rows(block_symbolic& symbolic, const block_adjacency& graph) {
  std::vector<std::uint32_t> seen(symbolic.size(), no_block), child(symbolic.supernodes.size(), no_block),
      sibling(symbolic.supernodes.size(), no_block);
  for (std::uint32_t s = 0; s != symbolic.supernodes.size(); ++s) {
    supernode& node = symbolic.supernodes[s];
    const std::uint32_t end = node.first + node.columns;
    node.rows_begin = symbolic.rows.size();
    const auto add = [&](std::uint32_t row) {
      if (row < end || seen[row] == s) return;
      seen[row] = s;
      symbolic.rows.push_back(row);
    };
    for (std::uint32_t k = node.first; k != end; ++k)
      for (const std::uint32_t neighbor : graph.neighbors(symbolic.order[k])) add(symbolic.position[neighbor]);
    for (std::uint32_t c = child[s]; c != no_block; c = sibling[c]) {
      const supernode& below = symbolic.supernodes[c];
      for (std::size_t at = below.rows_begin; at != below.rows_begin + below.rows; ++at) add(symbolic.rows[at]);
    }
    node.rows = static_cast<std::uint32_t>(symbolic.rows.size() - node.rows_begin);
    std::sort(symbolic.rows.begin() + static_cast<std::ptrdiff_t>(node.rows_begin), symbolic.rows.end());
    if (node.rows != 0) {
      const std::uint32_t up = symbolic.supernode_of[symbolic.rows[node.rows_begin]];
      sibling[s] = child[up];
      child[up] = s;
    }
    symbolic.factor_blocks +=
        std::size_t{node.columns} * (node.columns + 1) / 2 + std::size_t{node.columns} * node.rows;
  }
}

/// Computes the updates between supernodes.
template <class = void>
void find_updates(block_symbolic& symbolic) {
  const auto for_each = [&](auto&& visit) {
    for (std::uint32_t s = 0; s != symbolic.supernodes.size(); ++s) {
      const std::span<const std::uint32_t> rows = symbolic.rows_of(symbolic.supernodes[s]);
      for (std::uint32_t begin = 0, end = 0; begin != rows.size(); begin = end) {
        const std::uint32_t target = symbolic.supernode_of[rows[begin]];
        while (end != rows.size() && symbolic.supernode_of[rows[end]] == target) ++end;
        visit(target, supernode_update{s, begin, end});
      }
    }
  };
  symbolic.first_update.assign(symbolic.supernodes.size() + 1, 0);
  for_each([&](std::uint32_t target, const supernode_update&) { ++symbolic.first_update[target + 1]; });
  for (std::size_t s = 0; s != symbolic.supernodes.size(); ++s)
    symbolic.first_update[s + 1] += symbolic.first_update[s];
  symbolic.updates.resize(symbolic.first_update.back());
  std::vector<std::size_t> next(symbolic.first_update.begin(), symbolic.first_update.end() - 1);
  for_each([&](std::uint32_t target, const supernode_update& u) { symbolic.updates[next[target]++] = u; });
}

/// Computes the structure of the factor of a matrix with blocks at `places` and on the diagonal.
/// @pre every place has indices less than `size` and is off the diagonal
template <class = void>
[[nodiscard]] block_symbolic analyze_blocks(std::size_t size, std::span<const block_place> places) {
  const block_adjacency graph{size, places};
  block_symbolic symbolic;
  const auto invert = [&] {
    symbolic.position.resize(size);
    for (std::uint32_t k = 0; k != size; ++k) symbolic.position[symbolic.order[k]] = k;
  };
  symbolic.order = minimum_degree_order(graph);
  invert();
  const auto tree = elimination_tree(graph, symbolic.order, symbolic.position);
  std::vector<std::uint32_t> renumbered;
  renumbered.reserve(size);
  for (const std::uint32_t k : postorder(tree)) renumbered.push_back(symbolic.order[k]);
  symbolic.order = std::move(renumbered);
  invert();
  const auto parent = elimination_tree(graph, symbolic.order, symbolic.position);
  group_columns(symbolic, parent, column_counts(graph, symbolic, parent));
  find_rows(symbolic, graph);
  find_updates(symbolic);
  return symbolic;
}

}  // namespace orbis::optimize::detail

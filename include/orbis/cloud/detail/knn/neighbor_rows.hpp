// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The neighbours of the points of some leaves, as rows of a table.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/nearest_search.hpp>
#include <orbis/cloud/detail/knn/rank_sort.hpp>
#include <orbis/cloud/neighbors.hpp>

namespace orbis::cloud::detail {

/// Writes the nearest of what was gathered, but for the point itself, as a row. Returns the squared distance to the
/// last of them.
inline float write_row(rank_sorter& gathered, std::uint32_t self, std::span<neighbor<float>> row) {
  std::size_t written = 0;
  float last = 0.0F, last_squared = 0.0F;
  bool in_order = true;
  gathered.for_each([&](std::size_t, std::uint32_t index, float distance_squared) {
    if (index == self) return true;
    const float distance = std::sqrt(distance_squared);
    // Different squares can have the same root.
    in_order = in_order && (written == 0 || distance != last || index > row[written - 1].index);
    row[written++] = {index, distance};
    last = distance;
    last_squared = distance_squared;
    return written != row.size();
  });
  if (!in_order) std::sort(row.begin(), row.end(), nearest_sink<float>::less);
  return last_squared;
}

/// Writes the row of the i-th point of leaf `l` from what `search` has found for it: `found`, up to `bound`, squared.
/// Returns the squared distance to the last. `gathered` is scratch.
ORBIS_ALWAYS_INLINE float write_found(const leaf_hierarchy& tree, const knn_kernels& kernels, nearest_search& search,
                                      rank_sorter& gathered, std::size_t l, std::size_t i, std::span<float> found,
                                      float bound, std::span<neighbor<float>> row) {
  const std::size_t wanted = row.size() + 1;  // with the point itself
  const std::uint32_t self = tree.members[l * leaf_width + i];
  if (const std::uint32_t* const places = search.places_of(i)) {
    gathered.assign(found, places, tree.members.data());
    return write_row(gathered, self, row);
  }
  const float largest = found.size() < wanted
                            ? std::numeric_limits<float>::infinity()
                            : kernels.sum_nearest(found.data(), found.size(), wanted, bound).largest_squared;
  gathered.clear();
  search.visit_within(l, i, largest, [&](std::uint32_t member, float d) { gathered.add(member, d); });
  write_row(gathered, self, row);
  return largest;
}

/// For the points of the leaves [begin, end), calls `row_of(l, i)` for the i-th point of leaf `l`, writes its `width`
/// nearest other points, nearest first, into the span that this returns, and calls `done(l)` after each leaf.
/// @pre 0 < width < points in the leaves
template <class RowOf, class Done>
void find_neighbor_rows(const leaf_hierarchy& tree, const knn_kernels& kernels, std::size_t width, std::size_t begin,
                        std::size_t end, RowOf&& row_of, Done&& done) {
  nearest_search search{tree, kernels, width + 1, true};  // with the point itself
  rank_sorter gathered;
  for (std::size_t l = begin; l != end; ++l) {
    search.visit_leaf(l, [&](std::size_t i, std::span<float> found, float bound) ORBIS_INLINE_LAMBDA {
      return write_found(tree, kernels, search, gathered, l, i, found, bound, row_of(l, i));
    });
    done(l);
  }
}

}  // namespace orbis::cloud::detail

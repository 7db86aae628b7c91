// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Neighbours of the points of some leaves, as rows of a table.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/nearest_search.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

// Sorts a few dozen values by counting the smaller values for each: n^2 comparisons, but vectorised and without
// branches.

/// Computes the rank of each of `count` values: the number of smaller values and of equal values before it. @pre 16
/// more values are readable and writable
struct find_ranks {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::int32_t* values, std::size_t count, std::int32_t* ranks) {
    using lanes = simd::native_vec<std::int32_t, Target>;
    constexpr std::size_t n = lanes::count;
    const lanes one = 1, none = 0;
    for (std::size_t i = 0; i < count; i += n) {
      const lanes v = lanes::load(values + i);
      lanes rank = 0;
      const std::size_t here = std::min(i + n, count);
      std::size_t j = 0;
      for (; j != i; ++j) rank += select(v < lanes(values[j]), none, one);
      const lanes place = lanes::iota() + lanes(static_cast<std::int32_t>(i));
      for (; j != here; ++j)
        rank +=
            select(lanes(values[j]) < v + select(lanes(static_cast<std::int32_t>(j)) < place, one, none), one, none);
      for (; j < count; ++j) rank += select(lanes(values[j]) < v, one, none);
      rank.store(ranks + i);
    }
  }
};

/// Sorts points by squared distance, then by index. Reuses its memory.
template <class = void>
class basic_rank_sorter {
 public:
  void clear() noexcept { count_ = 0; }
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// Adds a point. @pre distance_squared >= 0, so that bit patterns have the order of the values
  void add(std::uint32_t index, float distance_squared) {
    if (count_ + 2 * room > keys_.size()) grow();
    std::memcpy(&keys_[count_], &distance_squared, sizeof distance_squared);
    indices_[count_++] = index;
  }
  /// Replaces the added points by those at the given places of `members`. @pre same as for `add`
  void assign(std::span<const float> squared, const std::uint32_t* places, const std::uint32_t* members) {
    while (squared.size() + 2 * room > keys_.size()) grow();
    count_ = squared.size();
    std::memcpy(keys_.data(), squared.data(), squared.size_bytes());
    for (std::size_t i = 0; i != count_; ++i) indices_[i] = members[places[i]];
  }
  /// Calls `f(rank, index, distance_squared)` for all points, nearest first, until `f` returns false.
  template <class F>
  void for_each(F&& f) {
    if (count_ == 0) return;
    if (count_ <= most_ranked) {
      find_ranks_(keys_.data(), count_, ranks_.data());
      for (std::size_t i = 0; i != count_; ++i) sorted_[static_cast<std::size_t>(ranks_[i])] = pack(i);
      // Sorts equal distances by index. There are only a few, and scalar reads can follow the preceding scalar writes
      // without delay.
      std::uint64_t before = sorted_[0];
      for (std::size_t i = 1; i < count_; ++i) {
        const std::uint64_t here = sorted_[i];
        if (here < before) {
          std::size_t at = i;
          for (; at != 0 && here < sorted_[at - 1]; --at) sorted_[at] = sorted_[at - 1];
          sorted_[at] = here;
        } else {
          before = here;
        }
      }
    } else {
      for (std::size_t i = 0; i != count_; ++i) sorted_[i] = pack(i);
      std::sort(sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(count_));
    }
    for (std::size_t i = 0; i != count_; ++i) {
      const auto bits = static_cast<std::uint32_t>(sorted_[i] >> 32U);
      float distance_squared;
      std::memcpy(&distance_squared, &bits, sizeof bits);
      if (!f(i, static_cast<std::uint32_t>(sorted_[i]), distance_squared)) return;
    }
  }

 private:
  static constexpr std::size_t room = 16;          // accessible elements after the last
  static constexpr std::size_t most_ranked = 384;  // above this, sorting in n log n is faster

  [[nodiscard]] std::uint64_t pack(std::size_t i) const noexcept {
    return std::uint64_t{static_cast<std::uint32_t>(keys_[i])} << 32U | indices_[i];
  }
  void grow() {
    const std::size_t size = std::max<std::size_t>(128, 2 * keys_.size());
    keys_.resize(size);
    indices_.resize(size);
    ranks_.resize(size);
    sorted_.resize(size);
  }

  void (*find_ranks_)(const std::int32_t*, std::size_t, std::int32_t*) =
      simd::kernel<find_ranks, void(const std::int32_t*, std::size_t, std::int32_t*)>();
  std::size_t count_ = 0;
  std::vector<std::int32_t> keys_;
  std::vector<std::uint32_t> indices_;
  std::vector<std::int32_t> ranks_;
  std::vector<std::uint64_t> sorted_;
};
using rank_sorter = basic_rank_sorter<>;

/// Writes the nearest gathered points, excluding the point itself, as a row. Returns the squared distance to the last
/// one.
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
  if (!in_order) std::sort(row.begin(), row.end(), is_nearer<float>);
  return last_squared;
}

/// Writes the nearest of the given points, excluding the point itself, as a row of one, without sorting. Returns the
/// squared distance to it.
inline float write_nearest(std::span<const float> squared, const std::uint32_t* places, const std::uint32_t* members,
                           std::uint32_t self, neighbor<float>& row) {
  constexpr std::uint64_t none = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t nearest = none;  // squared distance and index; the minimum is found without branches
  for (std::size_t i = 0; i != squared.size(); ++i) {
    const std::uint32_t index = members[places[i]];
    const std::uint64_t here = std::uint64_t{std::bit_cast<std::uint32_t>(squared[i])} << 32U | index;
    nearest = std::min(nearest, index == self ? none : here);
  }
  if (nearest == none) return 0.0F;
  const auto least = std::bit_cast<float>(static_cast<std::uint32_t>(nearest >> 32U));
  row = {static_cast<std::uint32_t>(nearest), std::sqrt(least)};
  return least;
}

/// Writes the row of the i-th point of leaf `l` from the search result `found`, complete up to squared distance
/// `bound`. Returns the squared distance to the last neighbour. `gathered` is scratch.
ORBIS_ALWAYS_INLINE float write_found(const leaf_hierarchy& tree, const knn_kernels& kernels, nearest_search& search,
                                      rank_sorter& gathered, std::size_t l, std::size_t i, std::span<float> found,
                                      float bound, std::span<neighbor<float>> row) {
  const std::size_t wanted = row.size() + 1;  // including the point itself
  const std::uint32_t self = tree.members[l * leaf_width + i];
  if (const std::uint32_t* const places = search.found_places(i)) {
    if (row.size() == 1) return write_nearest(found, places, tree.members.data(), self, row.front());
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

/// For the points of the leaves [begin, end): calls `row_of(l, i)` for the i-th point of leaf `l`, writes its `width`
/// nearest other points, nearest first, into the returned span, and calls `done(l)` after each leaf.
/// @pre 0 < width < points in the leaves
template <class RowOf, class Done>
void find_neighbor_rows(const leaf_hierarchy& tree, const knn_kernels& kernels, std::size_t width, std::size_t begin,
                        std::size_t end, RowOf&& row_of, Done&& done) {
  nearest_search search{tree, kernels, width + 1, true};  // including the point itself
  rank_sorter gathered;
  for (std::size_t l = begin; l != end; ++l) {
    search.visit_leaf(l, [&](std::size_t i, std::span<float> found, float bound) ORBIS_INLINE_LAMBDA {
      return write_found(tree, kernels, search, gathered, l, i, found, bound, row_of(l, i));
    });
    done(l);
  }
}

}  // namespace orbis::cloud::detail

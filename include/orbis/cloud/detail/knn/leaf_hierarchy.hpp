// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A cloud divided into leaves of sixteen points, with a hierarchy of boxes in which each node has sixteen children:
/// the index structure of the all-points neighbour search.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

inline constexpr std::size_t leaf_width = 16;

/// Points of one leaf, axis by axis; unused entries are at infinity.
struct alignas(64) point_row {
  std::array<std::array<float, leaf_width>, 3> axis;
};

struct box3 {
  std::array<float, 3> low;
  std::array<float, 3> high;
};

/// Boxes of sixteen children, axis by axis; unused entries are at infinity.
struct alignas(64) box_row {
  std::array<std::array<float, leaf_width>, 3> low;
  std::array<std::array<float, leaf_width>, 3> high;
  [[nodiscard]] box3 child(std::size_t i) const noexcept {
    return {{low[0][i], low[1][i], low[2][i]}, {high[0][i], high[1][i], high[2][i]}};
  }
};

/// Cells of a grid and their keys along a Hilbert curve.
struct curve_block {
  static constexpr std::size_t size = 256;
  static constexpr std::uint32_t bits = 10;
  std::array<std::array<std::uint32_t, size>, 3> axis;
  std::array<std::uint32_t, size> key;
};

/// Spreads ten bits: inserts two zeros after each bit.
[[nodiscard]] constexpr std::uint32_t spread_ten_bits(std::uint32_t x) noexcept {
  x = (x | x << 16U) & 0x030000ffU;
  x = (x | x << 8U) & 0x0300f00fU;
  x = (x | x << 4U) & 0x030c30c3U;
  return (x | x << 2U) & 0x09249249U;
}

/// Computes Hilbert keys for many cells at once, without branches, in loops that compilers vectorise.
/// Source: J. Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707, 2004.
struct fill_curve_keys {
  template <simd::target>
  static ORBIS_ALWAYS_INLINE void run(curve_block& cells) {
    auto& [x, y, z] = cells.axis;
    for (std::uint32_t level = curve_block::bits - 1; level > 0; --level) {
      const std::uint32_t below = (1U << level) - 1;
      for (std::size_t i = 0; i != curve_block::size; ++i) {
        std::uint32_t first = x[i] ^ (below & (0U - ((x[i] >> level) & 1U)));
        const std::uint32_t y_set = 0U - ((y[i] >> level) & 1U);
        const std::uint32_t xy = (first ^ y[i]) & below & ~y_set;
        first ^= (below & y_set) | xy;
        y[i] ^= xy;
        const std::uint32_t z_set = 0U - ((z[i] >> level) & 1U);
        const std::uint32_t xz = (first ^ z[i]) & below & ~z_set;
        x[i] = first ^ ((below & z_set) | xz);
        z[i] ^= xz;
      }
    }
    for (std::size_t i = 0; i != curve_block::size; ++i) {
      y[i] ^= x[i];
      z[i] ^= y[i];
      std::uint32_t flip = z[i] >> 1U;
      flip ^= flip >> 1U;
      flip ^= flip >> 2U;
      flip ^= flip >> 4U;
      flip ^= flip >> 8U;
      cells.key[i] =
          spread_ten_bits(x[i] ^ flip) << 2U | spread_ten_bits(y[i] ^ flip) << 1U | spread_ten_bits(z[i] ^ flip);
    }
  }
};

/// Order of the points in the leaves: along a Hilbert curve through a grid with 2^10 cells per side; if many points
/// share a cell, they are ordered recursively along a finer curve within it. The leaves thus adapt to any uneven
/// density. Each level divides the extent by about a thousand, and the range of float allows 28 levels: O(n) on typical
/// clouds, at most 28 times as long otherwise.
template <class = void>
class basic_leaf_order {
 public:
  struct entry {
    std::uint32_t key;
    std::uint32_t index;
  };
  struct range {
    std::size_t begin;
    std::size_t end;
  };

  /// Orders the finite points. Of identical points in a crowded cell, only `most_copies` are kept, because a search
  /// needs no more. `there`: for each point, nonzero to include it; empty to include all.
  template <execution_policy Policy>
  basic_leaf_order(const Policy& policy, const point_view& points, std::size_t most_copies,
                   std::span<const char> there = {})
      : points_{points}, most_copies_{most_copies} {
    const auto count = static_cast<std::uint32_t>(points.size());
    const auto counts = [&](std::uint32_t i) { return (there.empty() || there[i] != 0) && is_finite(position(i)); };
    std::size_t present = 0;
    for (std::uint32_t i = 0; i != count; ++i) present += counts(i) ? 1 : 0;
    entries_.reserve(present);
    for (std::uint32_t i = 0; i != count; ++i) {
      if (counts(i)) entries_.push_back({0, i});
    }
    spare_.resize(entries_.size());
    order(as_parallel(policy), 0, entries_.size());
    std::vector<entry>{}.swap(spare_);
  }
  [[nodiscard]] std::span<const entry> entries() const noexcept { return entries_; }
  /// Frees the memory of the entries.
  void drop_entries() noexcept { std::vector<entry>{}.swap(entries_); }
  /// Ranges of left-out entries, ascending. At least `most_copies` points identical to each entry remain.
  [[nodiscard]] std::span<const range> left_out() const noexcept { return left_out_; }
  [[nodiscard]] std::array<float, 3> position(std::uint32_t i) const noexcept { return points_[i]; }

 private:
  static constexpr std::size_t few = 2 * leaf_width;  // maximum number of points that share a cell
  static constexpr std::size_t block = curve_block::size;
  static constexpr std::uint32_t bits = curve_block::bits;

  template <execution_policy Policy>
  void order(const Policy& policy, std::size_t begin, std::size_t end) {
    if (end - begin <= leaf_width) return;
    constexpr float inf = std::numeric_limits<float>::infinity();
    box3 box{{inf, inf, inf}, {-inf, -inf, -inf}};
    for (std::size_t i = begin; i != end; ++i) {
      const std::array<float, 3> p = position(entries_[i].index);
      for (std::size_t a = 0; a != 3; ++a) {
        box.low[a] = std::min(box.low[a], p[a]);
        box.high[a] = std::max(box.high[a], p[a]);
      }
    }
    double extent = 0;
    for (std::size_t a = 0; a != 3; ++a) extent = std::max(extent, double{box.high[a]} - double{box.low[a]});
    if (extent == 0) {
      if (end - begin > most_copies_) left_out_.push_back({begin + most_copies_, end});
      return;
    }
    // With this scale the extreme points are in different cells, so each level makes progress.
    const double scale = ((1U << bits) - 1) / extent;
    auto* const fill_keys = simd::kernel<fill_curve_keys, void(curve_block&)>();
    for_each_chunk(policy, end - begin, 16 * block, [&](std::size_t from, std::size_t to) {
      curve_block cells{};
      for (std::size_t first = begin + from; first < begin + to; first += block) {
        const std::size_t size = std::min(block, begin + to - first);
        for (std::size_t i = 0; i != size; ++i) {
          const std::array<float, 3> p = position(entries_[first + i].index);
          for (std::size_t a = 0; a != 3; ++a) {
            cells.axis[a][i] =
                static_cast<std::uint32_t>(static_cast<std::int32_t>((double{p[a]} - double{box.low[a]}) * scale));
          }
        }
        fill_keys(cells);
        for (std::size_t i = 0; i != size; ++i) entries_[first + i].key = cells.key[i];
      }
    });
    sort(begin, end);
    for (std::size_t first = begin; first != end;) {
      std::size_t last = first + 1;
      while (last != end && entries_[last].key == entries_[first].key) ++last;
      if (last - first > few) order(parallel_policy{1}, first, last);
      first = last;
    }
  }

  /// Sorts by key; the sort is stable.
  void sort(std::size_t begin, std::size_t end) {
    const auto first = entries_.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = entries_.begin() + static_cast<std::ptrdiff_t>(end);
    if (end - begin < 2048) {
      std::sort(first, last,
                [](const entry& a, const entry& b) { return a.key < b.key || (a.key == b.key && a.index < b.index); });
      return;
    }
    constexpr std::uint32_t digit = 10;
    constexpr std::uint32_t values = 1U << digit;
    std::array<std::array<std::uint32_t, values>, 3> starts{};
    for (std::size_t i = begin; i != end; ++i) {
      for (std::uint32_t pass = 0; pass != 3; ++pass) ++starts[pass][entries_[i].key >> (pass * digit) & (values - 1)];
    }
    for (std::uint32_t pass = 0; pass != 3; ++pass) {
      std::uint32_t start = static_cast<std::uint32_t>(begin);
      for (std::uint32_t& s : starts[pass]) start += std::exchange(s, start);
      const bool forth = pass != 1;
      entry* from = forth ? entries_.data() : spare_.data();
      entry* to = forth ? spare_.data() : entries_.data();
      for (std::size_t i = begin; i != end; ++i) {
        to[starts[pass][from[i].key >> (pass * digit) & (values - 1)]++] = from[i];
      }
    }
    std::copy(spare_.begin() + static_cast<std::ptrdiff_t>(begin), spare_.begin() + static_cast<std::ptrdiff_t>(end),
              first);
  }

  point_view points_;
  std::size_t most_copies_;
  std::vector<entry> entries_;
  std::vector<entry> spare_;
  std::vector<range> left_out_;
};
using leaf_order = basic_leaf_order<>;

/// A point that is in no leaf because the leaves hold enough identical points.
struct surplus_copy {
  std::uint32_t index;
  std::uint32_t kept;  ///< position in `members` of the first identical point in a leaf
};

/// The leaves of a cloud and their bounding boxes. Takes about 18 bytes per point, even during construction.
struct leaf_hierarchy {
  std::vector<point_row> leaves;
  std::vector<std::vector<box_row>> levels;  ///< [0]: boxes of the leaves; the last level is a single row
  std::vector<std::uint32_t> members;        ///< indices of the points, leaf by leaf; the last leaf is padded with 0
  std::vector<surplus_copy> left_out;        ///< surplus copies of identical points, which are in no leaf
  std::size_t in_leaves = 0;                 ///< number of points in the leaves
  std::size_t finite = 0;                    ///< number of points in the leaves plus those left out

  /// Number of points in a leaf.
  [[nodiscard]] std::size_t leaf_size(std::size_t leaf) const noexcept {
    return std::min(leaf_width, in_leaves - leaf * leaf_width);
  }
};

[[nodiscard]] inline box_row empty_boxes() noexcept {
  constexpr float inf = std::numeric_limits<float>::infinity();
  box_row row;
  for (std::size_t a = 0; a != 3; ++a) {
    row.low[a].fill(inf);
    row.high[a].fill(-inf);
  }
  return row;
}

/// Builds the hierarchy. `there`: for each point, nonzero to include it; empty to include all.
/// @pre most_copies > 0, fewer than 2^32 points; `there` is empty or has one entry per point
template <execution_policy Policy>
[[nodiscard]] leaf_hierarchy make_leaves(const Policy& policy, const point_view& points, std::size_t most_copies,
                                         std::span<const char> there = {}) {
  leaf_hierarchy out;
  leaf_order order{policy, points, most_copies, there};
  const auto entries = order.entries();
  out.finite = entries.size();
  std::size_t copies = 0;
  for (const auto& range : order.left_out()) copies += range.end - range.begin;
  out.in_leaves = entries.size() - copies;
  const std::size_t leaves = (out.in_leaves + leaf_width - 1) / leaf_width;
  out.members.reserve(leaf_width * leaves);
  out.left_out.reserve(copies);
  std::size_t next = 0;
  const auto take = [&](std::size_t end) {
    for (; next != end; ++next) out.members.push_back(entries[next].index);
  };
  for (const auto& range : order.left_out()) {
    take(range.begin);
    const auto kept = static_cast<std::uint32_t>(out.members.size() - most_copies);
    for (; next != range.end; ++next) out.left_out.push_back({entries[next].index, kept});
  }
  take(entries.size());
  order.drop_entries();
  if (out.members.empty()) return out;
  out.members.resize(leaf_width * leaves);
  out.leaves.resize(leaves);

  constexpr float inf = std::numeric_limits<float>::infinity();
  const auto rows = [](std::size_t n) { return (n + leaf_width - 1) / leaf_width; };
  out.levels.emplace_back(rows(out.leaves.size()), empty_boxes());
  for_each_index(policy, out.leaves.size(), 1024, [&](std::size_t l) {
    point_row& leaf = out.leaves[l];
    box3 box{{inf, inf, inf}, {-inf, -inf, -inf}};
    for (std::size_t a = 0; a != 3; ++a) leaf.axis[a].fill(inf);
    for (std::size_t i = 0; i != out.leaf_size(l); ++i) {
      const std::array<float, 3> p = order.position(out.members[l * leaf_width + i]);
      for (std::size_t a = 0; a != 3; ++a) {
        leaf.axis[a][i] = p[a];
        box.low[a] = std::min(box.low[a], p[a]);
        box.high[a] = std::max(box.high[a], p[a]);
      }
    }
    box_row& boxes = out.levels[0][l / leaf_width];
    for (std::size_t a = 0; a != 3; ++a) {
      boxes.low[a][l % leaf_width] = box.low[a];
      boxes.high[a][l % leaf_width] = box.high[a];
    }
  });
  while (out.levels.back().size() > 1) {
    const std::vector<box_row>& below = out.levels.back();
    std::vector<box_row> level(rows(below.size()), empty_boxes());
    for (std::size_t i = 0; i != below.size(); ++i) {
      for (std::size_t a = 0; a != 3; ++a) {
        level[i / leaf_width].low[a][i % leaf_width] =
            *std::min_element(below[i].low[a].begin(), below[i].low[a].end());
        level[i / leaf_width].high[a][i % leaf_width] =
            *std::max_element(below[i].high[a].begin(), below[i].high[a].end());
      }
    }
    out.levels.push_back(std::move(level));
  }
  return out;
}

}  // namespace orbis::cloud::detail

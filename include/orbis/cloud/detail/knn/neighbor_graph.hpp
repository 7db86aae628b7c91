// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Compact storage of the neighbours of all points of a cloud, for algorithms that traverse them repeatedly.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/neighbor_rows.hpp>
#include <orbis/cloud/detail/knn/squared_distance.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

/// The rows of `all_knn`, with the points to which they belong. Points are identified by *places*, their positions
/// along the curve of `leaf_order`, from 0 to size() - 1; identical points that are in no leaf come last. Store
/// per-point data indexed by place, so that the data of neighbours are close in memory.
///
/// The points of a leaf have their neighbours in few leaves. These are listed once, and a neighbour is encoded in one
/// byte: the position of its leaf in the list, and its own position in the leaf. With more than 16 listed leaves a
/// neighbour takes two bytes; with more than 256 it is encoded as a place. Distances are recomputed. Takes about k + 3
/// bytes per point on a surface, and 18 for the point's position and index; a `neighbor_table` takes 8 k.
template <class = void>
class basic_neighbor_graph {
 public:
  basic_neighbor_graph() = default;
  /// Finds the `min(k, points - 1)` nearest other points of every point of `tree`. O(n k log k); the result is the same
  /// for every policy. Takes 4 bytes per point of the cloud during construction. @pre k > 0; `tree` keeps k + 1
  /// copies of identical points; its indices are less than `count`
  template <execution_policy Policy>
  basic_neighbor_graph(const Policy& policy, leaf_hierarchy tree, std::size_t count, std::size_t k)
      : tree_{std::move(tree)}, width_{std::min(k, std::max<std::size_t>(tree_.finite, 1) - 1)} {
    assert(k > 0);
    if (width_ == 0) return;
    const std::vector<std::uint32_t> place_of = places(count);
    const std::size_t leaves = tree_.leaves.size();
    start_.resize(leaves);
    rows_.resize((leaves + leaves_at_once - 1) / leaves_at_once);
    const knn_kernels kernels;
    for_each_chunk(policy, leaves, leaves_at_once, [&](std::size_t begin, std::size_t end) {
      std::vector<neighbor<float>> found(leaf_width * width_);
      std::vector<std::uint32_t> words;
      leaf_writer writer;
      find_neighbor_rows(
          tree_, kernels, width_, begin, end,
          [&](std::size_t, std::size_t i) { return std::span{found}.subspan(i * width_, width_); },
          [&](std::size_t l) {
            start_[l] = static_cast<std::uint32_t>(words.size());
            writer.write(std::span{found}.first(tree_.leaf_size(l) * width_), place_of, words);
          });
      rows_[begin / leaves_at_once].assign(words.begin(), words.end());  // without spare capacity
    });
  }

  /// Number of points, and number of neighbours of each.
  [[nodiscard]] std::size_t size() const noexcept { return tree_.in_leaves + tree_.left_out.size(); }
  [[nodiscard]] std::size_t width() const noexcept { return width_; }
  [[nodiscard]] const leaf_hierarchy& tree() const noexcept { return tree_; }
  /// Index in the cloud of the point at `place`.
  [[nodiscard]] std::uint32_t index(std::size_t place) const noexcept {
    return is_in_leaf(place) ? tree_.members[place] : copy(place).index;
  }
  static constexpr std::uint32_t no_place = std::numeric_limits<std::uint32_t>::max();
  /// Returns the places of all points of a cloud of `count` points; `no_place` for non-finite points.
  [[nodiscard]] std::vector<std::uint32_t> places(std::size_t count) const {
    std::vector<std::uint32_t> out(count, no_place);
    for (std::size_t p = 0; p != size(); ++p) out[index(p)] = static_cast<std::uint32_t>(p);
    return out;
  }
  [[nodiscard]] std::array<float, 3> position(std::size_t place) const noexcept {
    const std::size_t at = is_in_leaf(place) ? place : copy(place).kept;
    const point_row& leaf = tree_.leaves[at / leaf_width];
    const std::size_t i = at % leaf_width;
    return {leaf.axis[0][i], leaf.axis[1][i], leaf.axis[2][i]};
  }
  /// Distance between the points at two places, metres, computed as in `all_knn`.
  [[nodiscard]] float distance(std::size_t a, std::size_t b) const noexcept {
    return std::sqrt(squared_distance(position(a), position(b)));
  }
  /// Calls `f(place)` for the `count` nearest neighbours of a point, nearest first. @pre count <= width()
  template <class F>
  ORBIS_ALWAYS_INLINE void for_each_neighbor(std::size_t place, std::size_t count, F&& f) const {
    assert(count <= width_);
    if (!is_in_leaf(place)) {  // its neighbours are its copies
      const std::uint32_t kept = copy(place).kept;
      for (std::size_t n = 0; n != count; ++n) f(kept + static_cast<std::uint32_t>(n));
      return;
    }
    if (count == 0) return;
    const std::size_t l = place / leaf_width;
    const std::uint32_t* const words = rows_[l / leaves_at_once].data() + start_[l];
    const std::size_t listed = words[0];
    const std::uint32_t* const leaves = words + 1;
    const std::size_t first = place % leaf_width * width_;
    if (listed == 0) {
      for (std::size_t n = 0; n != count; ++n) f(leaves[first + n]);
      return;
    }
    const auto* const codes = reinterpret_cast<const unsigned char*>(leaves + listed);
    if (listed <= short_list) {
      for (std::size_t n = 0; n != count; ++n) {
        const unsigned code = codes[first + n];
        f(leaves[code >> 4U] * leaf_bits + (code & 15U));
      }
      return;
    }
    for (std::size_t n = 0; n != count; ++n) {
      std::uint16_t code;
      std::memcpy(&code, codes + 2 * (first + n), sizeof code);
      f(leaves[code >> 4U] * leaf_bits + (code & 15U));
    }
  }
  /// Computes for each place the mean distance to its first `k` neighbours, or to all if there are fewer, metres; NaN
  /// if there are no neighbours. O(n k). @pre k > 0
  template <execution_policy Policy>
  [[nodiscard]] std::vector<float> mean_distance(const Policy& policy, std::size_t k) const {
    const std::size_t count = std::min(k, width_);
    std::vector<float> out(size(), std::numeric_limits<float>::quiet_NaN());
    if (count == 0) return out;
    for_each_index(policy, size(), 4096, [&](std::size_t p) {
      const std::array<float, 3> at = position(p);
      double sum = 0;
      for_each_neighbor(p, count, [&](std::uint32_t n) { sum += std::sqrt(squared_distance(at, position(n))); });
      out[p] = static_cast<float>(sum / static_cast<double>(count));
    });
    return out;
  }
  /// Heap memory in bytes.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = tree_.leaves.capacity() * sizeof(point_row) +
                        (tree_.members.capacity() + start_.capacity()) * sizeof(std::uint32_t) +
                        tree_.left_out.capacity() * sizeof(surplus_copy) + rows_.capacity() * sizeof(rows_[0]);
    for (const auto& level : tree_.levels) bytes += level.capacity() * sizeof(box_row);
    for (const auto& rows : rows_) bytes += rows.capacity() * sizeof(std::uint32_t);
    return bytes;
  }

 private:
  static constexpr std::size_t leaves_at_once = 128;
  static constexpr std::size_t short_list = 16;
  static constexpr std::size_t long_list = 256;
  static constexpr std::uint32_t leaf_bits = leaf_width;
  static_assert(leaf_width == 16, "four bits identify a point in a leaf");

  [[nodiscard]] bool is_in_leaf(std::size_t place) const noexcept { return place < tree_.in_leaves; }
  [[nodiscard]] const surplus_copy& copy(std::size_t place) const noexcept {
    return tree_.left_out[place - tree_.in_leaves];
  }

  /// Encodes the rows of one leaf at a time: the number of listed leaves, the leaves, and a code for each neighbour.
  class leaf_writer {
   public:
    void write(std::span<const neighbor<float>> found, std::span<const std::uint32_t> place_of,
               std::vector<std::uint32_t>& out) {
      leaves_.clear();
      codes_.clear();
      std::uint32_t last = 0, slot = 0;  // consecutive neighbours are mostly in the same leaf
      for (const neighbor<float>& n : found) {
        const std::uint32_t place = place_of[n.index];
        const std::uint32_t leaf = place / leaf_bits;
        if (leaves_.empty() || leaf != last) {
          const auto at = std::find(leaves_.begin(), leaves_.end(), leaf);
          slot = static_cast<std::uint32_t>(at - leaves_.begin());
          if (at == leaves_.end() && leaves_.size() == long_list) return write_places(found, place_of, out);
          if (at == leaves_.end()) leaves_.push_back(leaf);
          last = leaf;
        }
        codes_.push_back(static_cast<std::uint16_t>(slot << 4U | place % leaf_bits));
      }
      const bool is_short = leaves_.size() <= short_list;
      out.push_back(static_cast<std::uint32_t>(leaves_.size()));
      out.insert(out.end(), leaves_.begin(), leaves_.end());
      const std::size_t begin = out.size();
      const std::size_t bytes = codes_.size() * (is_short ? 1 : sizeof(std::uint16_t));
      out.resize(begin + (bytes + sizeof(std::uint32_t) - 1) / sizeof(std::uint32_t), 0);
      auto* const codes = reinterpret_cast<unsigned char*>(out.data() + begin);
      if (is_short)
        std::transform(codes_.begin(), codes_.end(), codes,
                       [](std::uint16_t c) { return static_cast<unsigned char>(c); });
      else
        std::memcpy(codes, codes_.data(), bytes);
    }

   private:
    static void write_places(std::span<const neighbor<float>> found, std::span<const std::uint32_t> place_of,
                             std::vector<std::uint32_t>& out) {
      out.push_back(0);
      for (const neighbor<float>& n : found) out.push_back(place_of[n.index]);
    }
    std::vector<std::uint32_t> leaves_;
    std::vector<std::uint16_t> codes_;
  };

  leaf_hierarchy tree_;
  std::size_t width_ = 0;
  std::vector<std::uint32_t> start_;              ///< for each leaf, the position of its rows in its chunk's words
  std::vector<std::vector<std::uint32_t>> rows_;  ///< encoded rows, one vector of words per chunk of leaves
};
using neighbor_graph = basic_neighbor_graph<>;

}  // namespace orbis::cloud::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A fill-reducing elimination order for the blocks of a sparse symmetric matrix.
///
/// Source: P. R. Amestoy, T. A. Davis, I. S. Duff, "An approximate minimum degree ordering algorithm",
/// SIAM J. Matrix Anal. Appl. 17(4), 1996.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace orbis::optimize::detail {

/// The position of one block off the diagonal of a symmetric matrix; (column, row) is implied.
struct block_place {
  std::uint32_t row = 0;
  std::uint32_t column = 0;
  friend bool operator==(const block_place&, const block_place&) = default;
};

/// The neighbours of every block row: `neighbors(i)` contains each j for which (i, j) or (j, i) is one of the places.
class block_adjacency {
 public:
  block_adjacency() = default;
  /// Builds the lists. O(size + places). @pre every place has indices less than `size` and is off the diagonal
  block_adjacency(std::size_t size, std::span<const block_place> places) : first_(size + 1, 0) {
    for (const block_place& p : places) {
      assert(p.row < size && p.column < size && p.row != p.column);
      ++first_[p.row + 1];
      ++first_[p.column + 1];
    }
    for (std::size_t i = 0; i != size; ++i) first_[i + 1] += first_[i];
    neighbors_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (const block_place& p : places) {
      neighbors_[next[p.row]++] = p.column;
      neighbors_[next[p.column]++] = p.row;
    }
  }
  [[nodiscard]] std::size_t size() const { return first_.size() - 1; }
  [[nodiscard]] std::span<const std::uint32_t> neighbors(std::size_t i) const {
    return std::span{neighbors_}.subspan(first_[i], first_[i + 1] - first_[i]);
  }

 private:
  std::vector<std::size_t> first_{0};
  std::vector<std::uint32_t> neighbors_;
};

/// The quotient graph during an elimination. A node is a variable (not yet eliminated; it may represent several with
/// the same neighbours), an element (eliminated; its list is the resulting clique), or `gone` (absorbed by another
/// node).
template <class = void>
class basic_quotient_graph {
 public:
  explicit basic_quotient_graph(const block_adjacency& graph)
      : size_{static_cast<std::uint32_t>(graph.size())},
        weight_(size_, 1),
        list_(size_),
        degree_(size_),
        state_(size_, variable),
        remains_(size_, 0),
        bucket_(size_ + 1, none),
        next_(size_, none),
        previous_(size_, none),
        merged_(size_, none),
        last_merged_(size_) {
    std::vector<std::uint32_t> seen(size_, none);
    for (std::uint32_t i = 0; i != size_; ++i) {
      list_[i].begin = list_[i].variables = pool_.size();
      for (const std::uint32_t j : graph.neighbors(i)) {
        if (seen[j] == i) continue;  // duplicate
        seen[j] = i;
        pool_.push_back(j);
      }
      // Every list has room for one element: at most one is added before another entry is removed.
      list_[i].end = pool_.size();
      degree_[i] = static_cast<std::uint32_t>(list_[i].end - list_[i].begin);
      last_merged_[i] = i;
    }
    for (std::uint32_t i = size_; i != 0; --i) enlist(i - 1);
  }

  [[nodiscard]] std::vector<std::uint32_t> eliminate_all() {
    std::vector<std::uint32_t> order;
    order.reserve(size_);
    while (order.size() != size_) {
      while (bucket_[lowest_] == none) ++lowest_;
      const std::uint32_t pivot = bucket_[lowest_];
      eliminate(pivot, static_cast<std::uint32_t>(order.size()));
      for (std::uint32_t i = pivot; i != none; i = merged_[i]) order.push_back(i);
    }
    return order;
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  enum kind : std::uint8_t { variable, element, gone };

  /// The list of a node. A variable has its elements in [begin, variables) and its variables in [variables, end); an
  /// element has its variables in [begin, end).
  struct range {
    std::size_t begin = 0, variables = 0, end = 0;
  };

  void enlist(std::uint32_t i) {
    const std::uint32_t head = bucket_[degree_[i]];
    next_[i] = head;
    previous_[i] = none;
    if (head != none) previous_[head] = i;
    bucket_[degree_[i]] = i;
    lowest_ = std::min(lowest_, degree_[i]);
  }
  void delist(std::uint32_t i) {
    if (previous_[i] != none)
      next_[previous_[i]] = next_[i];
    else
      bucket_[degree_[i]] = next_[i];
    if (next_[i] != none) previous_[next_[i]] = previous_[i];
  }
  /// Records that `i` is eliminated together with `into`.
  void merge(std::uint32_t i, std::uint32_t into) {
    merged_[last_merged_[into]] = i;
    last_merged_[into] = last_merged_[i];
    weight_[into] += weight_[i];
    weight_[i] = 0;
    state_[i] = gone;
  }

  void eliminate(std::uint32_t pivot, std::uint32_t eliminated) {
    delist(pivot);
    collect_clique(pivot);
    measure_elements();
    update_degrees(pivot, size_ - eliminated);
    merge_indistinguishable();

    const std::size_t begin = pool_.size();
    std::uint32_t total = 0;
    for (const std::uint32_t i : clique_) {
      in_clique_mark(i, false);
      if (state_[i] != variable) continue;
      pool_.push_back(i);
      total += weight_[i];
      enlist(i);
    }
    list_[pivot] = {begin, begin, pool_.size()};
    degree_[pivot] = total;
    state_[pivot] = total != 0 ? element : gone;
    in_clique_mark(pivot, false);
  }

  void in_clique_mark(std::uint32_t i, bool in) { remains_[i] = in ? in_clique : 0; }
  [[nodiscard]] bool is_in_clique(std::uint32_t i) const { return remains_[i] == in_clique; }

  /// Collects all variables that are neighbours of the pivot or share an element with it.
  void collect_clique(std::uint32_t pivot) {
    clique_.clear();
    in_clique_mark(pivot, true);
    const auto add = [&](std::uint32_t i) {
      if (state_[i] != variable || is_in_clique(i)) return;
      in_clique_mark(i, true);
      clique_.push_back(i);
    };
    const range own = list_[pivot];
    for (std::size_t at = own.begin; at != own.variables; ++at) {
      const std::uint32_t e = pool_[at];
      if (state_[e] != element) continue;
      for (std::size_t k = list_[e].begin; k != list_[e].end; ++k) add(pool_[k]);
      state_[e] = gone;  // part of the new element
    }
    for (std::size_t at = own.variables; at != own.end; ++at) add(pool_[at]);
    clique_weight_ = 0;
    for (const std::uint32_t i : clique_) clique_weight_ += weight_[i];
  }

  /// Computes, for each element that touches the clique, its weight outside the clique.
  void measure_elements() {
    touched_.clear();
    for (const std::uint32_t i : clique_)
      for (std::size_t at = list_[i].begin; at != list_[i].variables; ++at) {
        const std::uint32_t e = pool_[at];
        if (state_[e] != element) continue;
        if (remains_[e] == 0) {
          remains_[e] = std::uint64_t{degree_[e]} + 1;
          touched_.push_back(e);
        }
        remains_[e] -= weight_[i];
      }
  }

  void update_degrees(std::uint32_t pivot, std::uint32_t left) {
    hashes_.clear();
    for (const std::uint32_t i : clique_) {
      delist(i);
      range& own = list_[i];
      const std::uint32_t others = clique_weight_ - weight_[i];
      std::uint64_t outside = 0;
      std::uint64_t hash = 0;
      std::size_t to = own.begin;
      for (std::size_t at = own.begin; at != own.variables; ++at) {
        const std::uint32_t e = pool_[at];
        if (state_[e] != element) continue;
        if (remains_[e] == 1) continue;  // entirely inside the clique: contained in the new element
        outside += remains_[e] - 1;
        hash += e;
        pool_[to++] = e;
      }
      const std::size_t elements_end = to;
      std::size_t kept = 0;
      for (std::size_t at = own.variables; at != own.end; ++at) {
        const std::uint32_t j = pool_[at];
        if (state_[j] != variable || is_in_clique(j)) continue;
        outside += weight_[j];
        hash += j;
        pool_[to++] = j;
        ++kept;
      }
      // The pivot, or an element that it has absorbed, was in this list: there is room for one more.
      pool_[to] = elements_end != to ? pool_[elements_end] : 0;
      pool_[elements_end] = pivot;
      own.variables = elements_end + 1;
      own.end = own.variables + kept;
      if (outside == 0) {
        merge(i, pivot);  // no neighbours outside the clique: eliminate it with the pivot
        continue;
      }
      const std::uint64_t bound = std::min<std::uint64_t>(std::uint64_t{degree_[i]} + others, others + outside);
      degree_[i] = static_cast<std::uint32_t>(std::min<std::uint64_t>(bound, left - 1));
      hashes_.push_back({hash + pivot, i});
    }
    for (const std::uint32_t e : touched_) {
      if (remains_[e] == 1) state_[e] = gone;
      remains_[e] = 0;
    }
  }

  /// Merges variables with the same elements and neighbours, because they would remain indistinguishable.
  void merge_indistinguishable() {
    std::sort(hashes_.begin(), hashes_.end(),
              [](const hashed& a, const hashed& b) { return a.hash != b.hash ? a.hash < b.hash : a.node < b.node; });
    for (std::size_t a = 0; a != hashes_.size(); ++a) {
      const std::uint32_t i = hashes_[a].node;
      if (state_[i] != variable) continue;
      bool marked = false;
      for (std::size_t b = a + 1; b != hashes_.size() && hashes_[b].hash == hashes_[a].hash; ++b) {
        const std::uint32_t j = hashes_[b].node;
        if (state_[j] != variable || list_[i].end - list_[i].begin != list_[j].end - list_[j].begin) continue;
        if (!marked) {
          ++stamp_;
          marks_.resize(size_, 0);
          for (std::size_t at = list_[i].begin; at != list_[i].end; ++at) marks_[pool_[at]] = stamp_;
          marked = true;
        }
        const bool same = std::all_of(pool_.begin() + static_cast<std::ptrdiff_t>(list_[j].begin),
                                      pool_.begin() + static_cast<std::ptrdiff_t>(list_[j].end),
                                      [&](std::uint32_t k) { return marks_[k] == stamp_; });
        if (!same) continue;
        degree_[i] -= std::min(degree_[i], weight_[j]);
        merge(j, i);
      }
    }
  }

  struct hashed {
    std::uint64_t hash;
    std::uint32_t node;
  };
  static constexpr std::uint64_t in_clique = std::numeric_limits<std::uint64_t>::max();

  std::uint32_t size_;
  std::vector<std::uint32_t> weight_;  ///< number of blocks that a node represents
  std::vector<range> list_;
  std::vector<std::uint32_t> degree_;  ///< for variables: upper bound on the number of adjacent blocks
  std::vector<kind> state_;
  std::vector<std::uint64_t> remains_;  ///< elements: 1 + weight outside the clique; variables: `in_clique` or 0
  std::vector<std::uint32_t> bucket_, next_, previous_;  ///< lists of the variables of each degree
  std::vector<std::uint32_t> merged_, last_merged_;      ///< chains of variables eliminated together
  std::vector<std::uint32_t> pool_, clique_, touched_;
  std::vector<hashed> hashes_;
  std::vector<std::uint64_t> marks_;
  std::uint64_t stamp_ = 0;
  std::uint32_t clique_weight_ = 0;
  std::uint32_t lowest_ = 0;
};
using quotient_graph = basic_quotient_graph<>;

/// Returns an approximate minimum degree elimination order: `order[k]` is the k-th block to eliminate. Deterministic;
/// about O(places) for meshes and pose graphs.
template <class = void>
[[nodiscard]] std::vector<std::uint32_t> minimum_degree_order(const block_adjacency& graph) {
  return quotient_graph{graph}.eliminate_all();
}

}  // namespace orbis::optimize::detail

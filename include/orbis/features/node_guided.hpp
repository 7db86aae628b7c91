// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The source that compares only descriptors that fall under the same node of a vocabulary.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/features/detail/match/search_among.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>

namespace orbis::features {

/// The features under one node of a vocabulary tree (or in one cell of any other partition of descriptors).
struct node_features {
  std::uint32_t node = 0;
  std::span<const std::uint32_t> features;  ///< indices of descriptors
};

/// The features of an image by node, made of one node for each descriptor.
class node_index {
 public:
  node_index() = default;
  /// `nodes[i]` is the node of descriptor `i`, or `none`. O(n log n).
  explicit node_index(std::span<const std::uint32_t> nodes) { assign(nodes); }
  node_index(const node_index&) = delete;  // the groups point into it
  node_index& operator=(const node_index&) = delete;
  node_index(node_index&&) = default;
  node_index& operator=(node_index&&) = default;
  ~node_index() = default;

  /// Replaces the contents of the index, whose memory is used again. O(n log n).
  void assign(std::span<const std::uint32_t> nodes) {
    order_.clear();
    groups_.clear();
    for (std::size_t i = 0; i != nodes.size(); ++i)
      if (nodes[i] != none) order_.push_back(static_cast<std::uint32_t>(i));
    std::sort(order_.begin(), order_.end(),
              [&](std::uint32_t a, std::uint32_t b) { return nodes[a] != nodes[b] ? nodes[a] < nodes[b] : a < b; });
    for (std::size_t first = 0, i = 1; i <= order_.size(); ++i) {
      if (i != order_.size() && nodes[order_[i]] == nodes[order_[first]]) continue;
      groups_.push_back({nodes[order_[first]], std::span{order_}.subspan(first, i - first)});
      first = i;
    }
  }

  /// By ascending node.
  [[nodiscard]] std::span<const node_features> groups() const noexcept { return groups_; }

 private:
  std::vector<std::uint32_t> order_;
  std::vector<node_features> groups_;
};

/// Finds for each query the nearest and the second nearest of the trains under its node. Made by
/// `node_guided(distance)`; a chain that begins with it is called with the features by node of both
/// sides, as `node_index` or as lists by ascending node from elsewhere:
///
/// @code
///   constexpr auto matcher = node_guided(hamming{}) | ratio_test{0.7f} | rotation_consistency{};
///   std::vector<match> a = matcher(f1, f2, node_index{nodes1}, node_index{nodes2});
///   std::vector<match> b = matcher(f1, f2, groups1, groups2);  // std::span<const node_features>
/// @endcode
///
/// What looks alike mostly falls under the same node: with a tenth to a hundredth of the comparisons, most of the
/// matches. Source: Galvez-Lopez, Tardos, "Bags of binary words for fast place recognition in image sequences",
/// IEEE T-RO 2012, section IV.D. The reverse neighbour of a train is the nearest of the queries under its node.
template <class Distance>
struct node_guided_source {
  using match_source_tag = void;
  Distance distance{};

  struct workspace {
    detail::search_among_workspace search;
    std::vector<std::span<const std::uint32_t>> trains_of;  ///< by query
  };

  /// One candidate for each query with a train under its node.
  /// @pre both lists ascend strictly by node; no feature stands under more than one
  template <class Descriptor>
  requires descriptor_distance<Distance, Descriptor>
  void search(std::vector<candidate>& candidates, workspace& memory, const feature_view<Descriptor>& queries,
              const feature_view<Descriptor>& trains, search_needs needs, std::span<const node_features> query_nodes,
              std::span<const node_features> train_nodes) const {
    const auto ascends = [](std::span<const node_features> list) {
      return std::adjacent_find(list.begin(), list.end(), [](const node_features& a, const node_features& b) {
               return a.node >= b.node;
             }) == list.end();
    };
    assert(ascends(query_nodes) && ascends(train_nodes));
    static_cast<void>(ascends);
    memory.trains_of.assign(queries.descriptors.size(), {});
    auto t = train_nodes.begin();
    for (const node_features& group : query_nodes) {
      while (t != train_nodes.end() && t->node < group.node) ++t;
      if (t == train_nodes.end()) break;
      if (t->node != group.node) continue;
      for (const std::uint32_t q : group.features) {
        assert(q < queries.descriptors.size());
        memory.trains_of[q] = t->features;
      }
    }
    detail::search_among(distance, candidates, memory.search, queries, trains, needs, [&](std::size_t q, auto&& add) {
      for (const std::uint32_t train : memory.trains_of[q]) add(train);
    });
  }
  template <class Descriptor>
  requires descriptor_distance<Distance, Descriptor>
  void search(std::vector<candidate>& candidates, workspace& memory, const feature_view<Descriptor>& queries,
              const feature_view<Descriptor>& trains, search_needs needs, const node_index& query_nodes,
              const node_index& train_nodes) const {
    search(candidates, memory, queries, trains, needs, query_nodes.groups(), train_nodes.groups());
  }
};

/// A source that compares under common nodes: `node_guided(hamming{})`.
template <class Distance>
[[nodiscard]] constexpr node_guided_source<Distance> node_guided(Distance distance) {
  return {distance};
}

}  // namespace orbis::features

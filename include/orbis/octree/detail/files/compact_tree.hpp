// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An octree as the lists that the coder of trees takes, and bricks made of what it returns.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/hash_index.hpp>
#include <orbis/octree/detail/files/rank_coder.hpp>
#include <orbis/octree/detail/files/tree_coder.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/detail/storage/tree_parts.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree::detail {

/// The distinct values of a map's leaves, the most frequent first, by kind: 0 free, 1 occupied.
template <class T>
using value_lists = std::array<std::vector<T>, 2>;

/// Numbers values in the order in which they come, and counts them.
template <class T>
class value_counter {
 public:
  [[nodiscard]] std::uint32_t number_of(T value) {
    const auto bits = static_cast<std::uint64_t>(std::bit_cast<value_bits<T>>(value));
    if (bits != last_bits_ || values_.empty()) {
      last_bits_ = bits;
      last_ = index_.find(bits);
      if (last_ == hash_index::none) {
        last_ = static_cast<std::uint32_t>(values_.size());
        index_.set(bits, last_);
        values_.push_back(value);
        counts_.push_back(0);
      }
    }
    ++counts_[last_];
    return last_;
  }
  /// The values of each kind in order, and for each number its value's rank there.
  template <class Kind>
  [[nodiscard]] std::pair<value_lists<T>, std::vector<std::uint32_t>> ranked(Kind&& kind_of) const {
    std::vector<std::uint32_t> order(values_.size()), rank(values_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return counts_[a] > counts_[b]; });
    value_lists<T> lists;
    for (const std::uint32_t i : order) {
      std::vector<T>& list = lists[kind_of(values_[i])];
      rank[i] = static_cast<std::uint32_t>(list.size());
      list.push_back(values_[i]);
    }
    return {std::move(lists), std::move(rank)};
  }

 private:
  hash_index index_;
  std::vector<T> values_;
  std::vector<std::size_t> counts_;
  std::uint64_t last_bits_ = 0;
  std::uint32_t last_ = 0;
};

/// Takes a map apart, level by level.
template <sensor_model Model>
class tree_lists {
 public:
  using T = typename Model::value_type;
  /// The inner nodes above one level, in Morton order.
  struct level {
    std::vector<std::uint64_t> parents;
    std::vector<child_states> children;
    std::vector<std::uint32_t> values;  ///< numbers of the values of the leaves among the children
  };

  /// With `occupancy_only`, everything free is as likely free, and everything occupied likewise.
  tree_lists(const brick_store<T>& store, int root_level, bool occupancy_only)
      : store_{store}, root_level_{root_level}, exact_{!occupancy_only}, levels_(static_cast<std::size_t>(root_level)) {
    const auto parts = tree_parts(store, root_level);
    if (parts.empty()) return;
    root_ = upper_walk<T, tree_lists>{parts, *this}.walk(root_level).state;
    if (root_ != coded_state::inner && exact_) root_value_ = values_.number_of(parts.front().value);
  }

  [[nodiscard]] coded_state root() const noexcept { return root_; }
  /// The number of the value of a root that is a leaf.
  [[nodiscard]] std::uint32_t root_value() const noexcept { return root_value_; }
  /// Of the children at `l`.
  [[nodiscard]] const level& at(int l) const noexcept { return levels_[static_cast<std::size_t>(l)]; }
  [[nodiscard]] const value_counter<T>& values() const noexcept { return values_; }
  [[nodiscard]] std::size_t inner_nodes() const noexcept {
    std::size_t n = 0;
    for (const level& l : levels_) n += l.parents.size();
    return n;
  }
  [[nodiscard]] static coded_state state_of(T value) noexcept {
    return is_occupied<Model>(value) ? coded_state::occupied : coded_state::free;
  }

  // -- called by upper_walk

  struct node {
    coded_state state;
    T value;
  };
  struct open_node {
    child_states children;
    std::array<T, 8> value{};
    void add(unsigned i, node n) noexcept {
      children.set(i, n.state);
      value[i] = n.value;
    }
  };
  [[nodiscard]] open_node open() const noexcept { return {}; }
  [[nodiscard]] node close(int l, const open_node& n) {
    if (l != root_level_ && is_leaf(n)) return {n.children[0], n.value[0]};
    put(l - 1, order_ >> (3 * static_cast<unsigned>(l - brick_level)), n.children, n.value.data());
    return {coded_state::inner, T{}};
  }
  [[nodiscard]] node content(const tree_part<T>& part) {
    order_ = part.order;
    if (part.content == nullptr) return {state_of(part.value), part.value};
    const brick<T>& b = *part.content;
    open_node n;
    for (std::uint32_t i = 0; i != 8; ++i) {
      if ((b.uniform >> i & 1U) != 0) n.add(i, {state_of(b.value[i]), b.value[i]});
      if ((b.dense >> i & 1U) != 0) n.add(i, octant(b, i));
    }
    return close(brick_level, n);
  }

 private:
  [[nodiscard]] bool is_leaf(const open_node& n) const noexcept {
    if (n.children.known != 0xff || (n.children.occupied != 0 && n.children.occupied != 0xff)) return false;
    return !exact_ || std::all_of(n.value.begin(), n.value.end(), [&](T v) { return v == n.value[0]; });
  }
  void put(int l, std::uint64_t parent, const child_states& children, const T* values) {
    level& out = levels_[static_cast<std::size_t>(l)];
    out.parents.push_back(parent);
    out.children.push_back(children);
    if (!exact_) return;
    for (unsigned rest = children.leaves(); rest != 0; rest &= rest - 1)
      out.values.push_back(values_.number_of(values[std::countr_zero(rest)]));
  }
  [[nodiscard]] node octant(const brick<T>& b, std::uint32_t place) {
    const std::uint64_t code = order_ << 3U | place;
    const std::uint64_t known = store_.known(b, place);
    const std::uint64_t occupied = store_.voxels_where(b, place, [](T v) { return is_occupied<Model>(v); });
    block<T> voxels;
    if (exact_) store_.read_octant(b, place, voxels);
    open_node n;
    for (unsigned g = 0; g != 8; ++g) {
      open_node group;
      group.children = {static_cast<std::uint8_t>(known >> (8 * g)), static_cast<std::uint8_t>(occupied >> (8 * g))};
      if (group.children.known == 0) continue;
      std::copy_n(voxels.value.begin() + 8 * g, exact_ ? 8 : 0, group.value.begin());
      if (is_leaf(group)) {
        n.add(g, {group.children[0], group.value[0]});
      } else {
        put(0, code << 3U | g, group.children, group.value.data());
        n.add(g, {coded_state::inner, T{}});
      }
    }
    if (is_leaf(n)) return {n.children[0], n.value[0]};
    put(1, code, n.children, n.value.data());
    return {coded_state::inner, T{}};
  }

  const brick_store<T>& store_;
  int root_level_;
  bool exact_;
  std::vector<level> levels_;
  value_counter<T> values_;
  coded_state root_ = coded_state::unknown;
  std::uint32_t root_value_ = 0;
  std::uint64_t order_ = 0;  ///< of the part visited last
};

/// Codes a map's lists.
template <sensor_model Model>
[[nodiscard]] std::string encode_tree(const tree_lists<Model>& lists, int root_level,
                                      const std::vector<std::uint32_t>& rank,
                                      const value_lists<typename Model::value_type>& values) {
  range_encoder coder;
  tree_coder<range_encoder> tree{coder, root_level};
  rank_coder<range_encoder> ranks{coder};
  const auto put_value = [&](coded_state leaf, std::uint32_t number) {
    const unsigned kind = leaf == coded_state::occupied ? 1 : 0;
    ranks.code(kind, rank[number], static_cast<std::uint32_t>(values[kind].size()));
  };
  if (lists.root() != coded_state::inner && !rank.empty()) put_value(lists.root(), lists.root_value());
  for (int l = root_level - 1; l >= 0; --l) {
    const auto& level = lists.at(l);
    tree.begin_level(l, level.parents);
    const std::uint32_t* number = level.values.data();
    for (std::size_t i = 0; i != level.parents.size(); ++i) {
      const child_states children = level.children[i];
      tree.code(level.parents[i], children);
      if (rank.empty()) continue;
      for (unsigned rest = children.leaves(); rest != 0; rest &= rest - 1)
        put_value(children[static_cast<unsigned>(std::countr_zero(rest))], *number++);
    }
  }
  return coder.finish();
}

/// Makes bricks of a coded tree.
template <sensor_model Model>
class tree_decoder {
 public:
  using T = typename Model::value_type;

  /// `values`: empty lists if leaves are to have the model's bounds. `limit`: of inner nodes.
  tree_decoder(std::span<const std::byte> coded, int root_level, bool occupancy_only, const value_lists<T>& values,
               std::size_t limit)
      : coder_{coded},
        tree_{coder_, root_level},
        ranks_{coder_},
        root_level_{root_level},
        exact_{!occupancy_only},
        values_{values},
        limit_{limit} {}

  /// Reads everything below a root of the given kind; false: see problem().
  [[nodiscard]] bool read(coded_state root) {
    if (root == coded_state::unknown) return true;
    if (root != coded_state::inner) {
      store_.set_node({}, root_level_, value_of(root));
      return problem_ == nullptr;
    }
    std::vector<std::uint64_t> parents{0}, inner;
    inner_nodes_ = 1;
    for (int l = root_level_ - 1; l >= octant_level; --l, parents.swap(inner)) {
      tree_.begin_level(l, parents);
      inner.clear();
      for (const std::uint64_t parent : parents) {
        const child_states children = take(parent);
        if (problem_ != nullptr) return false;
        put_leaves(parent, l, children);
        put_inner(parent, children, inner);
      }
      if (problem_ != nullptr) return false;
    }
    return read_octants(parents);
  }
  [[nodiscard]] const char* problem() const noexcept { return problem_; }
  [[nodiscard]] std::size_t inner_nodes() const noexcept { return inner_nodes_; }
  [[nodiscard]] brick_store<T>& store() noexcept { return store_; }

 private:
  [[nodiscard]] T value_of(coded_state leaf) {
    const unsigned kind = leaf == coded_state::occupied ? 1 : 0;
    if (!exact_) return kind != 0 ? Model::clamp_max : Model::clamp_min;
    const std::vector<T>& list = values_[kind];
    const std::uint32_t rank = list.empty() ? 0 : ranks_.code(kind, 0, static_cast<std::uint32_t>(list.size()));
    if (rank < list.size()) return list[rank];
    problem_ = "a value that is not listed";
    return Model::clamp_min;
  }
  [[nodiscard]] child_states take(std::uint64_t parent) {
    const child_states children = tree_.code(parent, {});
    if (children == child_states{}) problem_ = "an inner node without children";
    return children;
  }
  void put_inner(std::uint64_t parent, const child_states& children, std::vector<std::uint64_t>& inner) {
    for (unsigned rest = children.inner(); rest != 0; rest &= rest - 1) {
      if (++inner_nodes_ > limit_) {
        problem_ = "more inner nodes than declared";
        return;
      }
      inner.push_back(parent << 3U | static_cast<std::uint64_t>(std::countr_zero(rest)));
    }
  }
  void put_leaves(std::uint64_t parent, int l, const child_states& children) {
    const auto key = [&](std::uint64_t code) { return morton_key(code << (3 * static_cast<unsigned>(l))); };
    if (l == octant_level) {
      brick<T>& b = store_.make(key(parent << 3U));
      for (std::uint32_t i = 0; i != 8; ++i)
        if ((children.leaves() >> i & 1U) != 0) store_.make_uniform(b, i, value_of(children[i]));
      return;
    }
    for (unsigned i = 0; i != 8; ++i)
      if ((children.leaves() >> i & 1U) != 0) store_.set_node(key(parent << 3U | i), l, value_of(children[i]));
  }
  [[nodiscard]] bool read_octants(const std::vector<std::uint64_t>& octants) {
    tree_.begin_level(1, octants);
    std::vector<child_states> children(octants.size());
    std::vector<std::array<T, 8>> values(exact_ ? octants.size() : 0);
    std::vector<std::uint64_t> groups;
    for (std::size_t i = 0; i != octants.size(); ++i) {
      children[i] = take(octants[i]);
      if (exact_)
        for (unsigned rest = children[i].leaves(); rest != 0; rest &= rest - 1) {
          const auto g = static_cast<unsigned>(std::countr_zero(rest));
          values[i][g] = value_of(children[i][g]);
        }
      put_inner(octants[i], children[i], groups);
      if (problem_ != nullptr) return false;
    }
    tree_.begin_level(0, groups);
    block<T> voxels;
    for (std::size_t i = 0; i != octants.size(); ++i) {
      voxels.known = 0;
      std::uint64_t occupied = 0;
      for (unsigned g = 0; g != 8; ++g) {
        const coded_state s = children[i][g];
        T* const v = voxels.value.data() + 8 * g;
        child_states c{static_cast<std::uint8_t>(s == coded_state::unknown ? 0 : 0xff),
                       static_cast<std::uint8_t>(s == coded_state::occupied ? 0xff : 0)};
        if (exact_) std::fill(v, v + 8, s == coded_state::unknown || s == coded_state::inner ? T{} : values[i][g]);
        if (s == coded_state::inner) {
          c = take(octants[i] << 3U | g);
          if (exact_)
            for (unsigned rest = c.leaves(); rest != 0; rest &= rest - 1) {
              const auto place = static_cast<unsigned>(std::countr_zero(rest));
              v[place] = value_of(c[place]);
            }
        }
        voxels.known |= std::uint64_t{c.known} << (8 * g);
        occupied |= std::uint64_t{c.occupied} << (8 * g);
      }
      if (problem_ != nullptr) return false;
      const auto place = static_cast<std::uint32_t>(octants[i] & 7U);
      brick<T>& b = store_.make(morton_key(octants[i] << (3U * octant_level)));
      if (exact_) {
        store_.write_octant(b, place, voxels);
        continue;
      }
      palette<T> p;
      if (voxels.known != occupied) p.add(Model::clamp_min, voxels.known & ~occupied);
      if (occupied != 0) p.add(Model::clamp_max, occupied);
      store_.write_octant(b, place, voxels.known, p);
    }
    return true;
  }

  range_decoder coder_;
  tree_coder<range_decoder> tree_;
  rank_coder<range_decoder> ranks_;
  int root_level_;
  bool exact_;
  const value_lists<T>& values_;
  std::size_t limit_;
  std::size_t inner_nodes_ = 0;
  const char* problem_ = nullptr;
  brick_store<T> store_;
};

}  // namespace orbis::octree::detail

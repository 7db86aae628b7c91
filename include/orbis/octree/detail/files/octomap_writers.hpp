// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Writers for the nodes of OctoMap files. Nodes are written in preorder from the bricks, one mask of 64 voxels at a
/// time.
///
/// A `.bt` node has two bits per child (0 unknown, 1 free, 2 occupied, 3 an inner node); an `.ot` node has a value and
/// one bit per child. The content of a node depends on the nodes below it: its space is reserved while its children are
/// written, and then filled in, or released if the node became a leaf.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/detail/storage/tree_parts.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree::detail {

/// A byte buffer that grows by std::realloc, which can often remap pages instead of copying them.
class node_buffer {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::string_view view() const noexcept { return {bytes_.get(), size_}; }
  /// Reserves room for `n` bytes and returns its address.
  char* room(std::size_t n) {
    if (capacity_ - size_ < n) grow(n);
    return bytes_.get() + size_;
  }
  [[nodiscard]] char* at(std::size_t place) noexcept { return bytes_.get() + place; }
  /// Sets the size: larger to include bytes written to room(), or smaller to discard bytes.
  void set_size(std::size_t n) noexcept { size_ = n; }
  void set_end(const char* end) noexcept { size_ = static_cast<std::size_t>(end - bytes_.get()); }

 private:
  struct free_memory {
    void operator()(char* p) const noexcept { std::free(p); }
  };
  void grow(std::size_t n) {
    const std::size_t wanted = std::max(2 * capacity_, size_ + n + 4096);
    void* const moved = std::realloc(bytes_.get(), wanted);
    if (moved == nullptr) throw std::bad_alloc{};
    (void)bytes_.release();
    bytes_.reset(static_cast<char*>(moved));
    capacity_ = wanted;
  }

  std::unique_ptr<char, free_memory> bytes_;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

/// Nodes of a file, excluding the header.
struct octomap_nodes {
  node_buffer bytes;
  std::size_t nodes = 0;
};

/// Moves bit i of a byte to bit 2 i.
inline constexpr auto spread_bits = [] {
  std::array<std::uint16_t, 256> table{};
  for (unsigned i = 0; i != 256; ++i)
    for (unsigned bit = 0; bit != 8; ++bit)
      table[i] = static_cast<std::uint16_t>(table[i] | (i >> bit & 1U) << (2 * bit));
  return table;
}();
inline void put_bytes16(char* out, unsigned v) noexcept {
  out[0] = static_cast<char>(v & 0xffU);
  out[1] = static_cast<char>(v >> 8U);
}

/// Writes `.bt` nodes: the maximum-likelihood tree (each leaf free or occupied), pruned as in OctoMap.
///
/// OctoMap prunes level by level from the bottom and stops at the first level without a node to prune. Eight equal
/// leaves can remain only because of this early stop, which this writer reproduces.
template <octomap_model Model>
class bt_writer {
 public:
  bt_writer(const brick_store<float>& store, int root_level) : store_{store}, root_level_{root_level} {}

  [[nodiscard]] octomap_nodes write() {
    const auto parts = tree_parts(store_, root_level_);
    if (parts.empty()) return {};
    if (parts.front().level == root_level_) return write_root(parts.front().value);
    write_pass(parts);
    if (pruned_levels_ >> octant_level != 0 && is_group_pruned(parts)) pruned_levels_ |= 2U;
    const int stop = 1 + std::countr_one(pruned_levels_ >> 1U);
    if (pruned_levels_ >> static_cast<unsigned>(stop) != 0) {
      stop_level_ = stop;
      write_pass(parts);
    }
    return {std::move(out_), nodes_};
  }

  // -- interface of upper_walk

  struct open_node {
    std::size_t place;
    unsigned codes = 0;
    void add(unsigned i, unsigned code) noexcept { codes |= code << (2 * i); }
  };
  [[nodiscard]] open_node open() {
    out_.room(2);
    const open_node node{out_.size()};
    out_.set_size(node.place + 2);
    return node;
  }
  [[nodiscard]] unsigned close(int level, const open_node& node) {
    if ((node.codes == free_children || node.codes == occupied_children) && level != root_level_) {
      pruned_levels_ |= 1U << static_cast<unsigned>(level);
      if (level < stop_level_) {
        out_.set_size(node.place);
        return node.codes & 3U;
      }
    }
    put_bytes16(out_.at(node.place), node.codes);
    nodes_ += static_cast<std::size_t>(std::popcount((node.codes | node.codes >> 1U) & 0x5555U));
    return inner;
  }
  [[nodiscard]] unsigned content(const tree_part<float>& part) {
    if (part.content == nullptr) return leaf_code(part.value);
    out_.room(2 * (1 + 8 + 64));
    open_node node = open();
    for (std::uint32_t i = 0; i != 8; ++i) {
      const brick<float>& b = *part.content;
      if ((b.uniform >> i & 1U) != 0) node.add(i, leaf_code(b.value[i]));
      if ((b.dense >> i & 1U) != 0) node.add(i, write_octant(store_.known(b, i), occupied(b, i)));
    }
    return close(brick_level, node);
  }

 private:
  static constexpr unsigned free = 1, occupied_leaf = 2, inner = 3;
  static constexpr unsigned free_children = 0x5555, occupied_children = 0xaaaa;

  [[nodiscard]] static unsigned leaf_code(float value) noexcept {
    return is_occupied<Model>(value) ? occupied_leaf : free;
  }
  [[nodiscard]] std::uint64_t occupied(const brick<float>& b, std::uint32_t i) const noexcept {
    return store_.voxels_where(b, i, [](float v) { return is_occupied<Model>(v); });
  }
  void write_pass(const std::vector<tree_part<float>>& parts) {
    out_.set_size(0);
    nodes_ = 1;
    (void)upper_walk<float, bt_writer>{parts, *this}.walk(root_level_);
  }
  /// Writes a tree that is a single leaf as eight leaves, because the format cannot store a root without children.
  [[nodiscard]] octomap_nodes write_root(float value) {
    put_bytes16(out_.room(2), is_occupied<Model>(value) ? occupied_children : free_children);
    out_.set_size(2);
    return {std::move(out_), 9};
  }
  /// Writes an octant. @pre known != 0, and there is room for 2 * (1 + 8) bytes
  [[nodiscard]] unsigned write_octant(std::uint64_t known, std::uint64_t occupied) {
    constexpr std::uint64_t all = ~std::uint64_t{0};
    if (known == all && (occupied == all || occupied == 0)) {
      pruned_levels_ |= 1U << octant_level;
      if (octant_level < stop_level_) return occupied != 0 ? occupied_leaf : free;
    }
    char* const node = out_.at(out_.size());
    char* out = node + 2;
    unsigned codes = 0, count = 0;
    std::uint64_t in_groups = 0;
    for (unsigned g = 0; g != 8; ++g) {
      const auto k = static_cast<unsigned>(known >> (8 * g) & 0xffU);
      const auto o = static_cast<unsigned>(occupied >> (8 * g) & 0xffU);
      if (k == 0) continue;
      ++count;
      if (k == 0xff && (o == 0xff || o == 0)) {
        codes |= (o != 0 ? occupied_leaf : free) << (2 * g);
        continue;
      }
      codes |= inner << (2 * g);
      put_bytes16(out, spread_bits[k & ~o] | static_cast<unsigned>(spread_bits[o]) << 1U);
      out += 2;
      in_groups |= std::uint64_t{k} << (8 * g);
    }
    put_bytes16(node, codes);
    out_.set_end(out);
    nodes_ += count + static_cast<unsigned>(std::popcount(in_groups));
    return inner;
  }
  /// Returns true if there is a 2x2x2 node whose voxels have different values but the same maximum-likelihood state.
  [[nodiscard]] bool is_group_pruned(const std::vector<tree_part<float>>& parts) const {
    block<float> voxels;
    return std::any_of(parts.begin(), parts.end(), [&](const tree_part<float>& part) {
      if (part.content == nullptr) return false;
      for (std::uint32_t i = 0; i != 8; ++i) {
        if ((part.content->dense >> i & 1U) == 0) continue;
        store_.read_octant(*part.content, i, voxels);
        const std::uint64_t o = occupied(*part.content, i);
        for (unsigned g = 0; g != 8; ++g) {
          const std::uint64_t group = std::uint64_t{0xff} << (8 * g);
          const float* const v = voxels.value.data() + 8 * g;
          if ((voxels.known & group) == group && ((o & group) == group || (o & group) == 0) &&
              !std::all_of(v, v + 8, [&](float other) { return other == v[0]; }))
            return true;
        }
      }
      return false;
    });
  }

  const brick_store<float>& store_;
  int root_level_;
  node_buffer out_;
  std::size_t nodes_ = 0;
  unsigned pruned_levels_ = 0;  ///< bit l: a node at level l was or could have been pruned to a leaf
  int stop_level_ = max_tree_depth + 1;
};

/// Writes `.ot` nodes: the pruned octree with its values.
template <class = void>
class basic_ot_writer {
 public:
  basic_ot_writer(const brick_store<float>& store, int root_level) : store_{store}, root_level_{root_level} {}

  [[nodiscard]] octomap_nodes write() {
    const auto parts = tree_parts(store_, root_level_);
    if (parts.empty()) return {};
    (void)upper_walk<float, basic_ot_writer>{parts, *this}.walk(root_level_);
    const std::size_t nodes = out_.size() / node_bytes;
    return {std::move(out_), nodes};
  }

  // -- interface of upper_walk

  struct child {
    float value;
    bool leaf;
  };
  struct open_node {
    std::size_t place;
    unsigned children = 0, leaves = 0;
    float first = 0, max = 0;
    bool equal = true;
    void add(unsigned i, child c) noexcept {
      if (children == 0) first = max = c.value;
      children |= 1U << i;
      leaves |= static_cast<unsigned>(c.leaf) << i;
      equal &= c.value == first;
      max = std::max(max, c.value);
    }
  };
  [[nodiscard]] open_node open() {
    out_.room(node_bytes);
    const open_node node{out_.size()};
    out_.set_size(node.place + node_bytes);
    return node;
  }
  child close(int level, const open_node& node) {
    if (node.leaves == 0xff && node.equal && level != root_level_) {
      out_.set_size(node.place);
      return put_leaf(node.first);
    }
    put(out_.at(node.place), node.max, node.children);
    return {node.max, false};
  }
  child content(const tree_part<float>& part) {
    if (part.content == nullptr) return put_leaf(part.value);
    out_.room(node_bytes * (1 + 8 + 64 + 512));
    open_node node = open();
    block<float> voxels;
    for (std::uint32_t i = 0; i != 8; ++i) {
      const brick<float>& b = *part.content;
      if ((b.uniform >> i & 1U) != 0) node.add(i, put_leaf(b.value[i]));
      if ((b.dense >> i & 1U) == 0) continue;
      store_.read_octant(b, i, voxels);
      node.add(i, write_octant(voxels));
    }
    return close(brick_level, node);
  }

 private:
  static constexpr std::size_t node_bytes = 5;

  static char* put(char* out, float value, unsigned children) noexcept {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    out[0] = static_cast<char>(bits & 0xffU);
    out[1] = static_cast<char>(bits >> 8U & 0xffU);
    out[2] = static_cast<char>(bits >> 16U & 0xffU);
    out[3] = static_cast<char>(bits >> 24U);
    out[4] = static_cast<char>(children);
    return out + node_bytes;
  }
  child put_leaf(float value) {
    put(out_.room(node_bytes), value, 0);
    out_.set_size(out_.size() + node_bytes);
    return {value, true};
  }
  [[nodiscard]] child write_octant(const block<float>& voxels) {
    open_node node = open();
    char* out = out_.at(out_.size());
    for (unsigned g = 0; g != 8; ++g) {
      const auto known = static_cast<unsigned>(voxels.known >> (8 * g) & 0xffU);
      if (known == 0) continue;
      const float* const v = voxels.value.data() + 8 * g;
      char* const group = out;
      out += node_bytes;
      float max = v[std::countr_zero(known)];
      if (known == 0xff) {
        float min = max;
        for (unsigned i = 0; i != 8; ++i) {
          max = std::max(max, v[i]);
          min = std::min(min, v[i]);
          out = put(out, v[i], 0);
        }
        if (min == max) {
          out = put(group, max, 0);
          node.add(g, {max, true});
          continue;
        }
      } else {
        for (unsigned rest = known; rest != 0; rest &= rest - 1) {
          const float value = v[std::countr_zero(rest)];
          max = std::max(max, value);
          out = put(out, value, 0);
        }
      }
      put(group, max, known);
      node.add(g, {max, false});
    }
    out_.set_end(out);
    return close(octant_level, node);
  }

  const brick_store<float>& store_;
  int root_level_;
  node_buffer out_;
};
using ot_writer = basic_ot_writer<>;

}  // namespace orbis::octree::detail

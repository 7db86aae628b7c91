// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Readers that parse the nodes of OctoMap's files into bricks. See octomap_writers.hpp for the node format.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree::detail {

/// Moves bit 2 i of a 16-bit word to bit i; ignores the other bits.
[[nodiscard]] constexpr unsigned gather_bits(unsigned v) noexcept {
  v &= 0x5555U;
  v = (v | v >> 1U) & 0x3333U;
  v = (v | v >> 2U) & 0x0f0fU;
  return (v | v >> 4U) & 0xffU;
}

/// Common base of the two readers: the remaining bytes and the destination.
struct node_reader {
  brick_store<float>& store;
  std::span<const std::byte> left;
  std::size_t nodes = 0;
  const char* problem = nullptr;

  [[nodiscard]] unsigned byte(std::size_t i) const noexcept { return std::to_integer<unsigned>(left[i]); }
  [[nodiscard]] bool give_up(const char* why) noexcept {
    problem = why;
    return false;
  }
};
inline constexpr const char* ends_early = "the data ends early";
inline constexpr const char* no_children = "inner node without children";
inline constexpr const char* too_deep = "node below the deepest level";

/// Reads `.bt` nodes. Leaves get the log-odds at the model's bounds.
template <octomap_model Model>
class bt_reader : public node_reader {
 public:
  /// Reads the inner node at `level` that starts at `key`, and all nodes below it. On failure returns false and sets
  /// `problem`.
  [[nodiscard]] bool read(const voxel_key& key, int level) {
    if (level == brick_level) return read_brick(key);
    unsigned codes = 0;
    if (!take(codes)) return false;
    for (unsigned i = 0; i != 8; ++i, codes >>= 2U) {
      const unsigned code = codes & 3U;
      const voxel_key child = child_key(key, i, node_cells(level - 1));
      if (code == 3U) {
        if (!read(child, level - 1)) return false;
      } else if (code != 0) {
        ++nodes;
        store.set_node(child, level - 1, leaf_value(code));
      }
    }
    return true;
  }

 private:
  [[nodiscard]] static float leaf_value(unsigned code) noexcept {
    return code == 2U ? Model::clamp_max : Model::clamp_min;
  }
  [[nodiscard]] bool take(unsigned& codes) noexcept {
    ++nodes;
    if (left.size() < 2) return give_up(ends_early);
    codes = byte(0) | byte(1) << 8U;
    left = left.subspan(2);
    return codes != 0 || give_up(no_children);
  }
  [[nodiscard]] bool read_brick(const voxel_key& key) {
    unsigned codes = 0;
    if (!take(codes)) return false;
    brick<float>& b = store.make(key);
    for (std::uint32_t i = 0; i != 8; ++i, codes >>= 2U) {
      const unsigned code = codes & 3U;
      if (code == 3U) {
        if (!read_octant(b, i)) return false;
      } else if (code != 0) {
        ++nodes;
        store.make_uniform(b, i, leaf_value(code));
      }
    }
    return true;
  }
  [[nodiscard]] bool read_octant(brick<float>& b, std::uint32_t octant) {
    unsigned codes = 0;
    if (!take(codes)) return false;
    std::uint64_t known = 0, occupied = 0;
    for (unsigned g = 0; g != 8; ++g) {
      const unsigned code = codes >> (2 * g) & 3U;
      if (code == 0) continue;
      unsigned k = 0xff, o = code == 2U ? 0xff : 0;
      if (code == 3U) {
        unsigned voxels = 0;
        if (!take(voxels)) return false;
        const unsigned f = gather_bits(voxels);
        o = gather_bits(voxels >> 1U);
        if ((f & o) != 0) return give_up(too_deep);
        k = f | o;
        nodes += static_cast<unsigned>(std::popcount(k));
      } else {
        ++nodes;
      }
      known |= std::uint64_t{k} << (8 * g);
      occupied |= std::uint64_t{o} << (8 * g);
    }
    palette<float> p;
    if (known != occupied) p.add(Model::clamp_min, known & ~occupied);
    if (occupied != 0) p.add(Model::clamp_max, occupied);
    store.write_octant(b, octant, known, p);
    return true;
  }
};

/// Reads `.ot` nodes. Skips the values of inner nodes, which follow from the leaves. -0 becomes 0.
template <class = void>
class basic_ot_reader : public node_reader {
 public:
  /// Reads the node at `level` that starts at `key`, and all nodes below it. On failure returns false and sets
  /// `problem`.
  [[nodiscard]] bool read(const voxel_key& key, int level) {
    float value = 0;
    unsigned children = 0;
    if (!take(value, children)) return false;
    if (children == 0) {
      store.set_node(key, level, value);
      return true;
    }
    if (level == brick_level) return read_brick(key, children);
    for (unsigned i = 0; i != 8; ++i)
      if ((children >> i & 1U) != 0 && !read(child_key(key, i, node_cells(level - 1)), level - 1)) return false;
    return true;
  }

 private:
  [[nodiscard]] bool take(float& value, unsigned& children) noexcept {
    ++nodes;
    if (left.size() < 5) return give_up(ends_early);
    value = std::bit_cast<float>(value_at(0)) + 0.0F;
    children = byte(4);
    left = left.subspan(5);
    return children != 0 || std::isfinite(value) || give_up("non-finite value");
  }
  [[nodiscard]] std::uint32_t value_at(std::size_t i) const noexcept {
    return byte(i) | byte(i + 1) << 8U | byte(i + 2) << 16U | byte(i + 3) << 24U;
  }
  /// Reads the next eight nodes at once if they are all leaves.
  [[nodiscard]] bool read_eight_leaves(float* values) noexcept {
    if (left.size() < 40) return false;
    unsigned children = 0;
    bool finite = true;
    for (std::size_t i = 0; i != 8; ++i) {
      const std::uint32_t bits = value_at(5 * i);
      finite &= (bits & 0x7f800000U) != 0x7f800000U;
      children |= byte(5 * i + 4);
      values[i] = std::bit_cast<float>(bits) + 0.0F;
    }
    if (!finite || children != 0) return false;
    left = left.subspan(40);
    nodes += 8;
    return true;
  }
  [[nodiscard]] bool read_brick(const voxel_key& key, unsigned octants) {
    brick<float>& b = store.make(key);
    block<float> voxels;
    for (std::uint32_t i = 0; i != 8; ++i) {
      if ((octants >> i & 1U) == 0) continue;
      float value = 0;
      unsigned children = 0;
      if (!take(value, children)) return false;
      if (children == 0) {
        store.make_uniform(b, i, value);
      } else {
        if (!read_octant(children, voxels)) return false;
        store.write_octant(b, i, voxels);
      }
    }
    return true;
  }
  [[nodiscard]] bool read_octant(unsigned groups, block<float>& voxels) {
    voxels = {};
    for (unsigned g = 0; g != 8; ++g) {
      if ((groups >> g & 1U) == 0) continue;
      float value = 0;
      unsigned children = 0, none = 0;
      if (!take(value, children)) return false;
      float* const v = voxels.value.data() + 8 * g;
      voxels.known |= std::uint64_t{children == 0 ? 0xffU : children} << (8 * g);
      if (children == 0) {
        std::fill(v, v + 8, value);
        continue;
      }
      if (children == 0xff && read_eight_leaves(v)) continue;
      for (unsigned rest = children; rest != 0; rest &= rest - 1) {
        if (!take(v[std::countr_zero(rest)], none)) return false;
        if (none != 0) return give_up(too_deep);
      }
    }
    return true;
  }
};
using ot_reader = basic_ot_reader<>;

}  // namespace orbis::octree::detail

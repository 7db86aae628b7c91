// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The shape of an octree, arithmetically coded: level by level from above, what each child of each
/// inner node is, expected from what is known by then about its six neighbours.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/hash_index.hpp>
#include <orbis/octree/detail/files/range_coder.hpp>

namespace orbis::octree::detail {

/// What a node can be. Two bits: whether it is known to be a leaf, and which.
enum class coded_state : unsigned { unknown = 0, inner = 1, free = 2, occupied = 3 };

/// The states of eight children, one bit of each in either byte.
struct child_states {
  std::uint8_t known = 0;     ///< the high bits: those that are leaves
  std::uint8_t occupied = 0;  ///< the low bits: those that are occupied leaves or inner nodes

  [[nodiscard]] constexpr coded_state operator[](unsigned i) const noexcept {
    return static_cast<coded_state>((known >> i & 1U) << 1U | (occupied >> i & 1U));
  }
  constexpr void set(unsigned i, coded_state s) noexcept {
    const auto bit = 1U << i;
    known = static_cast<std::uint8_t>((known & ~bit) | (static_cast<unsigned>(s) >> 1U) << i);
    occupied = static_cast<std::uint8_t>((occupied & ~bit) | (static_cast<unsigned>(s) & 1U) << i);
  }
  [[nodiscard]] constexpr unsigned leaves() const noexcept { return known; }
  [[nodiscard]] constexpr unsigned inner() const noexcept { return occupied & ~static_cast<unsigned>(known) & 0xffU; }
  friend constexpr bool operator==(const child_states&, const child_states&) = default;
};

/// Codes trees from the root down. Nodes are named by their Morton code at their own level.
///
/// For each level of children, from the root's down to 0: begin_level() with all inner nodes above it
/// in Morton order, then code() for each of them in that order.
///
/// What is known of a level lies in tiles of 4x4x4 nodes, two bits each; nodes that are still to come
/// count as inner, which is what their parents are.
template <class Coder>
class tree_coder {
 public:
  /// A tile's states: those of 64 nodes, as child_states has those of eight.
  struct tile {
    std::uint64_t known = 0;
    std::uint64_t occupied = 0;
  };

  tree_coder(Coder& coder, int root_level) : coder_{coder}, root_level_{root_level} {}

  /// `parents`: the inner nodes at `level` + 1.
  void begin_level(int level, std::span<const std::uint64_t> parents) {
    level_ = level;
    current_ = ~std::uint64_t{0};
    for (const std::uint64_t parent : parents) {
      if (parent >> 3U == current_) continue;
      current_ = parent >> 3U;
      const tile made = state_of(current_);
      index_.set(name(current_, level + 2), static_cast<std::uint32_t>(tiles_.size()));
      tiles_.push_back(made);
    }
    current_ = ~std::uint64_t{0};
  }
  /// Writes the children of `parent`, or reads them. Returns them.
  child_states code(std::uint64_t parent, child_states children) {
    if (parent >> 3U != current_) enter(parent >> 3U);
    const auto group = static_cast<unsigned>(parent & 7U);
    const unsigned shift = 8 * group;
    // A byte for each neighbour, a bit for each child: first those outside the parent.
    std::uint64_t known = 0, occupied = 0;
    for (unsigned axis = 0; axis != 3; ++axis) {
      const unsigned step = 1U << axis, upper = upper_children[axis], lower = 0xffU & ~upper;
      const bool is_upper = (group & step) != 0;
      const unsigned beside = 8 * (group ^ step);
      const tile& below = is_upper ? tiles_[tile_] : around_[axis];
      const tile& above = is_upper ? around_[3 + axis] : tiles_[tile_];
      known |= (below.known >> beside >> step & lower) << (8 * axis);
      known |= (above.known >> beside << step & upper) << (24 + 8 * axis);
      occupied |= (below.occupied >> beside >> step & lower) << (8 * axis);
      occupied |= ((above.occupied >> beside << step & upper) | lower) << (24 + 8 * axis);
    }
    // Turned around: a number of twelve bits for each child.
    known = transposed(known);
    occupied = transposed(occupied);
    std::array<unsigned, 8> context{};
    for (unsigned i = 0; i != 8; ++i)
      context[i] = static_cast<unsigned>((known >> (8 * i) & 0x3fU) | (occupied >> (8 * i) & 0x3fU) << 6U);

    child_states now{0, 0xff};
    auto& expectations = expectations_[static_cast<std::size_t>(level_ < 3 ? level_ : 3)];
    for (unsigned i = 0; i != 8; ++i) {
      const coded_state s = code_state(expectations[context[i]], children[i]);
      now.set(i, s);
      // It lies below three of its siblings.
      const unsigned bits = static_cast<unsigned>(s) >> 1U | (static_cast<unsigned>(s) & 1U) << 6U;
      for (unsigned axis = 0; axis != 3; ++axis)
        if ((i >> axis & 1U) == 0) context[i | 1U << axis] |= bits << axis;
    }
    tile& t = tiles_[tile_];
    t.known = (t.known & ~(std::uint64_t{0xff} << shift)) | std::uint64_t{now.known} << shift;
    t.occupied = (t.occupied & ~(std::uint64_t{0xff} << shift)) | std::uint64_t{now.occupied} << shift;
    return now;
  }
  /// What is known of the 64 nodes at the level begun inside node `code`, two levels above it.
  [[nodiscard]] tile state_of(std::uint64_t code) const noexcept {
    if (const std::uint32_t i = index_.find(name(code, level_ + 2)); i != hash_index::none) return tiles_[i];
    // Nothing there is inner: it is all as the children of the node there, or of one that contains it.
    if (const std::uint32_t i = index_.find(name(code >> 3U, level_ + 3)); i != hash_index::none) {
      const auto shift = 8 * static_cast<unsigned>(code & 7U);
      return {each_bit_eight_times(tiles_[i].known >> shift & 0xffU),
              each_bit_eight_times(tiles_[i].occupied >> shift & 0xffU)};
    }
    for (int level = level_ + 2; level < root_level_; ++level, code >>= 3U) {
      const std::uint32_t i = index_.find(name(code >> 6U, level + 2));
      if (i == hash_index::none) continue;
      const auto all = [&](std::uint64_t states) { return (states >> (code & 63U) & 1U) != 0 ? ~std::uint64_t{0} : 0; };
      return {all(tiles_[i].known), all(tiles_[i].occupied)};
    }
    return {};
  }

 private:
  struct expectation {
    bit_expectation inner, known, occupied;
  };
  static constexpr std::array<unsigned, 3> upper_children{0xaa, 0xcc, 0xf0};
  static constexpr std::uint64_t x_bits = 0x1249249249249249ULL;

  [[nodiscard]] static std::uint64_t name(std::uint64_t code, int level) noexcept {
    return code | static_cast<std::uint64_t>(level) << 58U;
  }
  [[nodiscard]] static constexpr std::uint64_t each_bit_eight_times(std::uint64_t byte) noexcept {
    const std::uint64_t apart = byte * 0x0101010101010101ULL & 0x8040201008040201ULL;
    return ((apart + 0x7f7f7f7f7f7f7f7fULL) >> 7U & 0x0101010101010101ULL) * 0xffU;
  }
  /// Bit j of byte i moved to bit i of byte j.
  [[nodiscard]] static constexpr std::uint64_t transposed(std::uint64_t m) noexcept {
    const auto swap = [&](unsigned distance, std::uint64_t where) {
      const std::uint64_t differing = (m ^ m >> distance) & where;
      m ^= differing ^ differing << distance;
    };
    swap(7, 0x00aa00aa00aa00aaULL);
    swap(14, 0x0000cccc0000ccccULL);
    swap(28, 0x00000000f0f0f0f0ULL);
    return m;
  }
  void enter(std::uint64_t code) {
    current_ = code;
    tile_ = index_.find(name(code, level_ + 2));
    const unsigned bits = 3 * static_cast<unsigned>(std::max(root_level_ - level_ - 2, 0));
    const std::uint64_t inside = (std::uint64_t{1} << bits) - 1;
    for (unsigned axis = 0; axis != 3; ++axis) {
      const std::uint64_t along = (x_bits << axis) & inside, across = code & ~along, at = code & along;
      around_[axis] = at == 0 ? tile{} : state_of(across | ((at - 1) & along));
      around_[3 + axis] = at == along ? tile{} : state_of(across | (((at | ~along) + 1) & along));
    }
  }
  bool code_bit(bit_expectation& e, bool bit) {
    bit = coder_.code(bit, e.set());
    e.learn(bit);
    return bit;
  }
  [[nodiscard]] coded_state code_state(expectation& e, coded_state s) {
    if (level_ != 0 && code_bit(e.inner, s == coded_state::inner)) return coded_state::inner;
    if (!code_bit(e.known, s != coded_state::unknown)) return coded_state::unknown;
    return code_bit(e.occupied, s == coded_state::occupied) ? coded_state::occupied : coded_state::free;
  }

  Coder& coder_;
  int root_level_;
  int level_ = 0;
  hash_index index_;
  std::vector<tile> tiles_;
  std::uint64_t current_ = ~std::uint64_t{0};
  std::size_t tile_ = 0;
  std::array<tile, 6> around_{};
  std::vector<std::array<expectation, 4096>> expectations_{4};
};

}  // namespace orbis::octree::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Map from brick positions to brick indices; a brick has 8x8x8 voxels.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/cow_pages.hpp>
#include <orbis/core/hash_index.hpp>

namespace orbis::nav::detail {

/// A brick's position in the grid, in bricks.
struct brick_place {
  std::int32_t x = 0, y = 0, z = 0;
  friend bool operator==(const brick_place&, const brick_place&) = default;
};

/// Brick indices by position, stored in blocks of 8x8x8 bricks. Copies share the blocks until one of them changes.
template <class = void>
class basic_brick_directory {
 public:
  /// Results of `find` for positions without an index: `inner` in one of the cubes (see add_cube), `none` outside all
  /// of them.
  static constexpr std::uint32_t none = hash_index::none, inner = none - 1;

  /// `bricks`: edge of the grid in bricks. Positions outside the grid are never found.
  explicit basic_brick_directory(std::uint32_t bricks) noexcept : bricks_{bricks} {}

  [[nodiscard]] bool is_inside(const brick_place& p) const noexcept {
    return static_cast<std::uint32_t>(p.x) < bricks_ && static_cast<std::uint32_t>(p.y) < bricks_ &&
           static_cast<std::uint32_t>(p.z) < bricks_;
  }
  /// The index of the brick at `p`, or `inner`, or `none`. O(1).
  [[nodiscard]] std::uint32_t find(const brick_place& p) const noexcept {
    if (!is_inside(p)) return none;
    const std::uint32_t b = blocks_.find(name(p));
    return b == none ? without_number(p) : numbers_[b][place(p)];
  }
  /// Makes `find` return `inner` for the positions that have no index and are in the cube of 2^level bricks that
  /// contains `p`.
  /// @pre no brick has an index; level >= 3; the cube is in the grid
  void add_cube(const brick_place& p, int level) {
    cubes_.set(cube_name(p, level), 0);
    levels_ |= 1U << static_cast<unsigned>(level);
  }
  /// Returns true if a node of 2^level bricks lies in one of the cubes. O(levels).
  [[nodiscard]] bool is_in_cube(const brick_place& p, int level) const noexcept {
    for (unsigned levels = levels_ >> level << level; levels != 0; levels &= levels - 1)
      if (cubes_.find(cube_name(p, std::countr_zero(levels))) != none) return true;
    return false;
  }
  [[nodiscard]] bool has_cubes() const noexcept { return levels_ != 0; }
  /// `inner` or `none`: the result that `find` would return for `p` if `p` had no index. O(levels of cubes).
  [[nodiscard]] std::uint32_t without_number(const brick_place& p) const noexcept {
    return has_cubes() && is_in_cube(p, 0) ? inner : none;
  }
  /// Sets the index of the brick at `p`. @pre is_inside(p)
  void set(const brick_place& p, std::uint32_t number) {
    std::uint32_t b = blocks_.find(name(p));
    if (b == none) {
      b = static_cast<std::uint32_t>(numbers_.size());
      blocks_.set(name(p), b);
      block empty;
      empty.fill(without_number(p));  // for the whole block: no cube is smaller than a block
      numbers_.push_back(empty);
      names_.push_back(name(p));
    }
    numbers_.writable(b)[place(p)] = number;
  }
  /// Removes the brick at `p`, and its block if the block becomes empty. @pre `p` has an index
  void erase(const brick_place& p) {
    const std::uint32_t b = blocks_.find(name(p));
    block& numbers = numbers_.writable(b);
    numbers[place(p)] = without_number(p);
    if (std::any_of(numbers.begin(), numbers.end(), [](std::uint32_t n) { return n < inner; })) return;
    blocks_.erase(name(p));
    const auto last = static_cast<std::uint32_t>(numbers_.size() - 1);
    if (b != last) {
      blocks_.set(names_[last], b);
      numbers = numbers_[last];
      names_[b] = names_[last];
    }
    numbers_.resize(last);
    names_.pop_back();
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return blocks_.memory_bytes() + cubes_.memory_bytes() + numbers_.memory_bytes() +
           names_.capacity() * sizeof(std::uint64_t);
  }

  /// Looks up bricks, each near the previous one. Valid until the directory changes.
  class cursor {
   public:
    explicit cursor(const basic_brick_directory& directory) noexcept : directory_{&directory} {}
    [[nodiscard]] std::uint32_t find(const brick_place& p) noexcept {
      if (!directory_->is_inside(p)) return none;
      if (const std::uint64_t n = name(p); n != name_) {
        name_ = n;
        const std::uint32_t b = directory_->blocks_.find(n);
        block_ = b == none ? nullptr : &directory_->numbers_[b];
      }
      return block_ == nullptr ? directory_->without_number(p) : (*block_)[place(p)];
    }

   private:
    const basic_brick_directory* directory_;
    std::uint64_t name_ = ~std::uint64_t{0};
    const std::array<std::uint32_t, 512>* block_ = nullptr;
  };

 private:
  using block = std::array<std::uint32_t, 512>;

  [[nodiscard]] static std::uint64_t name(const brick_place& p) noexcept {
    return static_cast<std::uint64_t>(p.x >> 3) | static_cast<std::uint64_t>(p.y >> 3) << 20U |
           static_cast<std::uint64_t>(p.z >> 3) << 40U;
  }
  [[nodiscard]] static std::uint64_t cube_name(const brick_place& p, int level) noexcept {
    return static_cast<std::uint64_t>(p.x >> level) | static_cast<std::uint64_t>(p.y >> level) << 20U |
           static_cast<std::uint64_t>(p.z >> level) << 40U | static_cast<std::uint64_t>(level) << 59U;
  }
  [[nodiscard]] static std::size_t place(const brick_place& p) noexcept {
    return static_cast<std::size_t>((p.x & 7) | (p.y & 7) << 3 | (p.z & 7) << 6);
  }

  std::uint32_t bricks_;
  hash_index blocks_;
  hash_index cubes_;     ///< cubes by name
  unsigned levels_ = 0;  ///< bit l is set if there is a cube of 2^l bricks
  cow_pages<block> numbers_;
  std::vector<std::uint64_t> names_;  ///< names of the blocks
};
using brick_directory = basic_brick_directory<>;

}  // namespace orbis::nav::detail

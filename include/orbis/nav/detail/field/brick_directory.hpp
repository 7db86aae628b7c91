// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which brick of 8x8x8 voxels has which number.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/core/cow_pages.hpp>
#include <orbis/core/hash_index.hpp>

namespace orbis::nav::detail {

/// A brick's place in the grid, in bricks.
struct brick_place {
  std::int32_t x = 0, y = 0, z = 0;
  friend bool operator==(const brick_place&, const brick_place&) = default;
};

/// Numbers of bricks by their places, in blocks of 8x8x8 bricks. Copies share the blocks until one of them changes.
class brick_directory {
 public:
  static constexpr std::uint32_t none = hash_index::none;

  /// `bricks`: how many the grid is wide. What lies outside is never found.
  explicit brick_directory(std::uint32_t bricks) noexcept : bricks_{bricks} {}

  [[nodiscard]] bool is_inside(const brick_place& p) const noexcept {
    return static_cast<std::uint32_t>(p.x) < bricks_ && static_cast<std::uint32_t>(p.y) < bricks_ &&
           static_cast<std::uint32_t>(p.z) < bricks_;
  }
  /// The number of the brick at `p`, or `none`. O(1).
  [[nodiscard]] std::uint32_t find(const brick_place& p) const noexcept {
    if (!is_inside(p)) return none;
    const std::uint32_t b = blocks_.find(name(p));
    return b == none ? none : numbers_[b][place(p)];
  }
  /// Sets it. @pre is_inside(p)
  void set(const brick_place& p, std::uint32_t number) {
    std::uint32_t b = blocks_.find(name(p));
    if (b == none) {
      b = static_cast<std::uint32_t>(numbers_.size());
      blocks_.set(name(p), b);
      block empty;
      empty.fill(none);
      numbers_.push_back(empty);
    }
    numbers_.writable(b)[place(p)] = number;
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return blocks_.memory_bytes() + numbers_.memory_bytes(); }

  /// Looks bricks up of which each lies near the one before. Valid until the directory changes.
  class cursor {
   public:
    explicit cursor(const brick_directory& directory) noexcept : directory_{&directory} {}
    [[nodiscard]] std::uint32_t find(const brick_place& p) noexcept {
      if (!directory_->is_inside(p)) return none;
      if (const std::uint64_t n = name(p); n != name_) {
        name_ = n;
        const std::uint32_t b = directory_->blocks_.find(n);
        block_ = b == none ? nullptr : &directory_->numbers_[b];
      }
      return block_ == nullptr ? none : (*block_)[place(p)];
    }

   private:
    const brick_directory* directory_;
    std::uint64_t name_ = ~std::uint64_t{0};
    const std::array<std::uint32_t, 512>* block_ = nullptr;
  };

 private:
  using block = std::array<std::uint32_t, 512>;

  [[nodiscard]] static std::uint64_t name(const brick_place& p) noexcept {
    return static_cast<std::uint64_t>(p.x >> 3) | static_cast<std::uint64_t>(p.y >> 3) << 20U |
           static_cast<std::uint64_t>(p.z >> 3) << 40U;
  }
  [[nodiscard]] static std::size_t place(const brick_place& p) noexcept {
    return static_cast<std::size_t>((p.x & 7) | (p.y & 7) << 3 | (p.z & 7) << 6);
  }

  std::uint32_t bricks_;
  hash_index blocks_;
  cow_pages<block> numbers_;
};

}  // namespace orbis::nav::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An array of large values in blocks.
#pragma once

#include <cstddef>
#include <vector>

namespace orbis::nav::detail {

/// Values in blocks of 16. Adding a value does not move the others. Access takes two loads; a std::deque of large
/// values needs more instructions. One empty block is kept, so that adding and removing a value repeatedly allocates
/// nothing.
template <class T>
class block_vector {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  /// @pre i < size()
  [[nodiscard]] T& operator[](std::size_t i) noexcept { return blocks_[i / per_block][i % per_block]; }
  [[nodiscard]] const T& operator[](std::size_t i) const noexcept { return blocks_[i / per_block][i % per_block]; }
  T& emplace_back() {
    if (size_ / per_block == blocks_.size()) blocks_.emplace_back();
    std::vector<T>& block = blocks_[size_ / per_block];
    block.reserve(per_block);
    T& added = block.emplace_back();
    ++size_;
    return added;
  }
  /// @pre not empty
  void pop_back() {
    --size_;
    blocks_[size_ / per_block].pop_back();
    if (size_ / per_block + 2 < blocks_.size()) blocks_.pop_back();
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return blocks_.size() * per_block * sizeof(T) + blocks_.capacity() * sizeof(std::vector<T>);
  }

 private:
  static constexpr std::size_t per_block = 16;
  std::vector<std::vector<T>> blocks_;
  std::size_t size_ = 0;
};

}  // namespace orbis::nav::detail

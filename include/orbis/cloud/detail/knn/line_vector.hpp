// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Vectors that begin at a cache line.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace orbis::cloud::detail {

/// Allocates at cache lines. On many processors a register that is stored across two of them cannot be read again until
/// it has reached the cache; so rows whose first registers are read soon after begin at a line.
template <class T>
struct line_allocator {
  using value_type = T;
  static constexpr std::align_val_t line{64};
  static_assert(alignof(T) <= 64);
  line_allocator() = default;
  template <class U>
  line_allocator(const line_allocator<U>&) noexcept {}  // NOLINT(google-explicit-constructor)
  [[nodiscard]] T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), line)); }
  void deallocate(T* p, std::size_t) noexcept { ::operator delete(p, line); }
  template <class U>
  bool operator==(const line_allocator<U>&) const noexcept {
    return true;
  }
};

template <class T>
using line_vector = std::vector<T, line_allocator<T>>;

}  // namespace orbis::cloud::detail

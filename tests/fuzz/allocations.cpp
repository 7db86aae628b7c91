// SPDX-License-Identifier: BSD-3-Clause
//
// Global operator new and delete that count. Over-aligned ones are left alone: nothing here has any.
#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <new>

#include <malloc.h>

#include "target.hpp"

namespace orbis::fuzz {

allocation_counts& allocations() noexcept {
  thread_local allocation_counts counts;
  return counts;
}

}  // namespace orbis::fuzz

void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  void* const p = std::malloc(std::max<std::size_t>(size, 1));
  if (p == nullptr) return p;
  auto& counts = orbis::fuzz::allocations();
  counts.now += malloc_usable_size(p);
  counts.peak = std::max(counts.peak, counts.now);
  return p;
}
void* operator new(std::size_t size) {
  void* const p = operator new(size, std::nothrow);
  if (p == nullptr) throw std::bad_alloc{};
  return p;
}
void operator delete(void* p) noexcept {
  if (p == nullptr) return;
  orbis::fuzz::allocations().now -= malloc_usable_size(p);
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept { operator delete(p); }

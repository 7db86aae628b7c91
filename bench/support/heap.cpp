// SPDX-License-Identifier: BSD-3-Clause
//
// The C library's allocation functions, counted while somebody asks for it. Only glibc lets a program
// put its own in front of them like this.
#include "support/heap.hpp"

#include <atomic>
#include <cerrno>
#include <cstdint>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#include <malloc.h>

extern "C" {
void* __libc_malloc(std::size_t size);                           // NOLINT(bugprone-reserved-identifier)
void* __libc_calloc(std::size_t count, std::size_t size);        // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void* block, std::size_t size);             // NOLINT(bugprone-reserved-identifier)
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT(bugprone-reserved-identifier)
void __libc_free(void* block);                                   // NOLINT(bugprone-reserved-identifier)
}

namespace {

std::atomic<bool> counting{false};
std::atomic<std::ptrdiff_t> in_use{0};
std::atomic<std::ptrdiff_t> most{0};

void* taken(void* block) noexcept {
  if (!counting.load(std::memory_order_relaxed) || block == nullptr) return block;
  const auto size = static_cast<std::ptrdiff_t>(malloc_usable_size(block));
  const std::ptrdiff_t now = in_use.fetch_add(size, std::memory_order_relaxed) + size;
  std::ptrdiff_t seen = most.load(std::memory_order_relaxed);
  while (seen < now && !most.compare_exchange_weak(seen, now, std::memory_order_relaxed)) {
  }
  return block;
}
void given_back(void* block) noexcept {
  if (counting.load(std::memory_order_relaxed) && block != nullptr)
    in_use.fetch_sub(static_cast<std::ptrdiff_t>(malloc_usable_size(block)), std::memory_order_relaxed);
}

}  // namespace

extern "C" {
void* malloc(std::size_t size) { return taken(__libc_malloc(size)); }
void* calloc(std::size_t count, std::size_t size) { return taken(__libc_calloc(count, size)); }
void* realloc(void* block, std::size_t size) {
  given_back(block);
  return taken(__libc_realloc(block, size));
}
void* memalign(std::size_t alignment, std::size_t size) { return taken(__libc_memalign(alignment, size)); }
void* aligned_alloc(std::size_t alignment, std::size_t size) { return taken(__libc_memalign(alignment, size)); }
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  *block = taken(__libc_memalign(alignment, size));
  return *block == nullptr ? ENOMEM : 0;
}
void free(void* block) {
  given_back(block);
  __libc_free(block);
}
}

void orbis::bench::detail::start_counting_heap() {
  in_use = 0;
  most = 0;
  counting = true;
}
std::size_t orbis::bench::detail::stop_counting_heap() {
  counting = false;
  return static_cast<std::size_t>(most);
}
#else
void orbis::bench::detail::start_counting_heap() {}
std::size_t orbis::bench::detail::stop_counting_heap() { return 0; }
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What counts for `allocations.hpp`: to be included by one source file of a test executable.
#pragma once

#include <atomic>
#include <cstddef>

#include "support/allocations.hpp"

#if defined(__has_feature)
#define ORBIS_TEST_SANITIZED (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ORBIS_TEST_SANITIZED 1
#else
#define ORBIS_TEST_SANITIZED 0
#endif

namespace {
std::atomic<std::size_t> count{0};
std::atomic<std::size_t> held{0};
std::atomic<std::size_t> peak{0};
}  // namespace

#if defined(__GLIBC__) && !ORBIS_TEST_SANITIZED
#include <cerrno>

#include <malloc.h>

namespace {
void* taken(void* block) noexcept {
  if (block == nullptr) return block;
  const std::size_t bytes = malloc_usable_size(block);
  const std::size_t now = held.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  std::size_t most = peak.load(std::memory_order_relaxed);
  while (most < now && !peak.compare_exchange_weak(most, now, std::memory_order_relaxed)) {
  }
  return block;
}
void given_back(void* block) noexcept {
  if (block != nullptr) held.fetch_sub(malloc_usable_size(block), std::memory_order_relaxed);
}
}  // namespace

// NOLINTBEGIN(bugprone-reserved-identifier)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t items, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

void* malloc(std::size_t size) noexcept {
  count.fetch_add(1, std::memory_order_relaxed);
  return taken(__libc_malloc(size));
}
void* calloc(std::size_t items, std::size_t size) noexcept { return taken(__libc_calloc(items, size)); }
void* realloc(void* block, std::size_t size) noexcept {
  const std::size_t before = block != nullptr ? malloc_usable_size(block) : 0;
  void* const moved = __libc_realloc(block, size);
  if (moved != nullptr || size == 0) held.fetch_sub(before, std::memory_order_relaxed);
  return taken(moved);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept { return taken(__libc_memalign(alignment, size)); }
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  return taken(__libc_memalign(alignment, size));
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  *block = taken(__libc_memalign(alignment, size));
  return *block != nullptr ? 0 : ENOMEM;
}
void free(void* block) noexcept {
  given_back(block);
  __libc_free(block);
}
}
// NOLINTEND(bugprone-reserved-identifier)
bool orbis::test::counts_allocations() noexcept { return true; }
#else
bool orbis::test::counts_allocations() noexcept { return false; }
#endif

std::size_t orbis::test::allocations() noexcept { return count.load(); }
std::size_t orbis::test::bytes_held() noexcept { return held.load(); }
std::size_t orbis::test::peak_bytes_held() noexcept { return peak.load(); }
void orbis::test::begin_peak() noexcept { peak.store(held.load()); }

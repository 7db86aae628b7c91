// SPDX-License-Identifier: BSD-3-Clause
#include "io/no_memory.hpp"

#include <cstdlib>
#include <limits>
#include <new>

#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define ORBIS_TEST_OWN_NEW 0
#endif
#endif
#ifndef ORBIS_TEST_OWN_NEW
#define ORBIS_TEST_OWN_NEW 1
#endif

namespace {

constexpr std::size_t without_end = std::numeric_limits<std::size_t>::max();
thread_local std::size_t calls_left = without_end;

#if ORBIS_TEST_OWN_NEW
void* allocate(std::size_t bytes) noexcept {
  if (calls_left == 0) return nullptr;
  if (calls_left != without_end) --calls_left;
  return std::malloc(bytes == 0 ? 1 : bytes);
}
#endif

}  // namespace

#if ORBIS_TEST_OWN_NEW

void* operator new(std::size_t bytes) {
  void* const memory = allocate(bytes);
  if (memory == nullptr) throw std::bad_alloc{};
  return memory;
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return allocate(bytes); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
#endif

namespace orbis::test {

no_memory_after::no_memory_after(std::size_t count) noexcept { calls_left = count; }
no_memory_after::~no_memory_after() { calls_left = without_end; }
bool no_memory_after::works() noexcept { return ORBIS_TEST_OWN_NEW != 0; }

}  // namespace orbis::test

// SPDX-License-Identifier: BSD-3-Clause
#include "io/no_memory.hpp"

#include <cstdlib>
#include <limits>
#include <new>

namespace {

constexpr std::size_t without_end = std::numeric_limits<std::size_t>::max();
thread_local std::size_t calls_left = without_end;

void* allocate(std::size_t bytes) noexcept {
  if (calls_left == 0) return nullptr;
  if (calls_left != without_end) --calls_left;
  return std::malloc(bytes == 0 ? 1 : bytes);
}

}  // namespace

void* operator new(std::size_t bytes) {
  void* const memory = allocate(bytes);
  if (memory == nullptr) throw std::bad_alloc{};
  return memory;
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return allocate(bytes); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }

namespace orbis::test {

no_memory_after::no_memory_after(std::size_t count) noexcept { calls_left = count; }
no_memory_after::~no_memory_after() { calls_left = without_end; }

}  // namespace orbis::test

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
}

#if defined(__GLIBC__) && !ORBIS_TEST_SANITIZED
extern "C" {
void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier)
void* malloc(std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
}
bool orbis::test::counts_allocations() noexcept { return true; }
#else
bool orbis::test::counts_allocations() noexcept { return false; }
#endif

std::size_t orbis::test::allocations() noexcept { return count.load(); }

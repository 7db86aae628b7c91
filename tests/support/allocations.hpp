// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How often this program has asked for memory and how much it holds, whoever asked: Eigen's vectors do not go through
/// `operator new`.
#pragma once

#include <cstddef>

namespace orbis::test {

/// Calls of `malloc` so far.
[[nodiscard]] std::size_t allocations() noexcept;
/// Bytes that the program holds on the heap, and the most that it held since the last call of `begin_peak`.
[[nodiscard]] std::size_t bytes_held() noexcept;
[[nodiscard]] std::size_t peak_bytes_held() noexcept;
void begin_peak() noexcept;
/// Whether they are counted: not with a sanitizer, nor with a C library other than glibc.
[[nodiscard]] bool counts_allocations() noexcept;

}  // namespace orbis::test

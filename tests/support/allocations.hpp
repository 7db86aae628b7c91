// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How often this program has asked for memory, whoever asked: Eigen's vectors do not go through
/// `operator new`.
#pragma once

#include <cstddef>

namespace orbis::test {

/// Calls of `malloc` so far.
[[nodiscard]] std::size_t allocations() noexcept;
/// Whether they are counted: not with a sanitizer, nor with a C library other than glibc.
[[nodiscard]] bool counts_allocations() noexcept;

}  // namespace orbis::test

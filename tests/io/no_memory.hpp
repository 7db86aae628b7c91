// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Want of memory, made on purpose. The `operator new` of the whole program is replaced.
#pragma once

#include <cstddef>

namespace orbis::test {

/// While it lives, this thread's `operator new` throws after it has been called `count` times.
class no_memory_after {
 public:
  explicit no_memory_after(std::size_t count) noexcept;
  ~no_memory_after();
  no_memory_after(const no_memory_after&) = delete;
  no_memory_after& operator=(const no_memory_after&) = delete;
  /// False where it does nothing: clang's thread sanitizer lets nobody replace `operator new`.
  [[nodiscard]] static bool works() noexcept;
};

}  // namespace orbis::test

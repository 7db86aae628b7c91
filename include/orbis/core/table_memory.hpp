// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Memory for large tables with random access.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <span>
#include <type_traits>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace orbis {

/// `count` uninitialised values of `T`, aligned to a cache line. Large tables use huge pages where the system provides
/// them, which reduces TLB misses and the cost of first use.
template <class T>
requires std::is_trivially_copyable_v<T>
class table_memory {
  static constexpr std::size_t line = 64, huge_page = std::size_t{1} << 21U;

  struct release {
    std::align_val_t alignment;
    void operator()(T* p) const noexcept { ::operator delete(static_cast<void*>(p), alignment); }
  };

 public:
  table_memory() = default;
  explicit table_memory(std::size_t count) : size_{count} {
    if (count == 0) return;
    const std::size_t bytes = count * sizeof(T);
    const bool large = bytes >= 2 * huge_page;
    const std::align_val_t alignment{large ? huge_page : line};
    values_ = std::unique_ptr<T, release>(static_cast<T*>(::operator new(bytes, alignment)), release{alignment});
#if defined(__linux__) && defined(MADV_HUGEPAGE)
    if (large) static_cast<void>(madvise(static_cast<void*>(values_.get()), bytes, MADV_HUGEPAGE));  // a hint; may fail
#endif
  }

  [[nodiscard]] std::span<T> values() noexcept { return {values_.get(), values_ ? size_ : 0}; }
  [[nodiscard]] std::span<const T> values() const noexcept { return {values_.get(), values_ ? size_ : 0}; }

 private:
  std::unique_ptr<T, release> values_{nullptr, release{std::align_val_t{line}}};
  std::size_t size_ = 0;
};

}  // namespace orbis

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A paged copy-on-write array: copies share pages until one of them is written to. Copying costs one pointer per page,
/// and readers keep their copy while the writer continues.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace orbis {

/// Values in copy-on-write pages of about 4 KB. A write to a page that several arrays share clones the page first. Each
/// array belongs to one thread at a time; arrays that share pages need no lock between them.
template <class T>
requires std::is_trivially_copyable_v<T>
class cow_pages {
 public:
  static constexpr std::size_t per_page = std::max<std::size_t>(1, std::bit_floor(std::size_t{4096} / sizeof(T)));

  cow_pages() = default;
  cow_pages(const cow_pages& other) : pages_{other.pages_}, size_{other.size_} {
    for (page* const p : pages_) p->owners.fetch_add(1, std::memory_order_relaxed);
  }
  cow_pages(cow_pages&& other) noexcept
      : pages_{std::exchange(other.pages_, {})}, size_{std::exchange(other.size_, 0)} {}
  cow_pages& operator=(cow_pages other) noexcept {
    std::swap(pages_, other.pages_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~cow_pages() {
    for (page* const p : pages_) release(p);
  }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  /// @pre i < size()
  [[nodiscard]] const T& operator[](std::size_t i) const noexcept { return pages_[i / per_page]->items[i % per_page]; }
  /// Writable access to the i-th value; valid until the next copy of the array. @pre i < size()
  [[nodiscard]] T& writable(std::size_t i) {
    page*& p = pages_[i / per_page];
    // Acquire: reads by other owners before they release the page happen before this write.
    if (p->owners.load(std::memory_order_acquire) != 1) {
      page* const own = new page{{1}, p->items};
      release(std::exchange(p, own));
    }
    return p->items[i % per_page];
  }
  void push_back(const T& value) {
    if (size_ == pages_.size() * per_page) {
      if (pages_.size() == pages_.capacity()) pages_.reserve(pages_.size() + pages_.size() / 2 + 1);
      pages_.push_back(new page{{1}, {}});
    }
    writable(size_++) = value;
  }
  /// Resizes the array to `n` values; new values are value-initialised.
  void resize(std::size_t n) {
    while (size_ < n) push_back(T{});
    size_ = n;
    while (pages_.size() * per_page >= n + per_page) {
      release(pages_.back());
      pages_.pop_back();
    }
  }
  void clear() noexcept { *this = cow_pages{}; }
  /// Heap memory in bytes, including pages shared with copies.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return pages_.capacity() * sizeof(page*) + pages_.size() * sizeof(page);
  }

 private:
  struct page {
    std::atomic<std::uint32_t> owners;
    std::array<T, per_page> items;
  };
  static void release(page* p) noexcept {
    if (p->owners.fetch_sub(1, std::memory_order_acq_rel) == 1) delete p;
  }

  std::vector<page*> pages_;
  std::size_t size_ = 0;
};

}  // namespace orbis

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A view of points at a constant stride in a buffer: matrices, images of points, packed messages, columns of a table.
///
/// Eigen matrices do not need this: `m.colwise()` and `m.rowwise()` are already ranges of points.
#pragma once

#include <array>
#include <cassert>
#include <compare>
#include <concepts>
#include <cstddef>
#include <iterator>
#include <ranges>

namespace orbis::interop {

/// Layout of the points; strides are in units of `S`.
struct point_layout {
  std::ptrdiff_t point_stride = 3;       ///< distance from one point to the next
  std::ptrdiff_t coordinate_stride = 1;  ///< distance from x to y, and from y to z
  std::size_t row_length = 0;            ///< number of points per row; 0: all points are in one row
  std::ptrdiff_t row_stride = 0;         ///< distance from the first point of a row to the first point of the next row
};

/// A view of `size` points with coordinates of type `S`; each point is read as a `std::array<S, 3>`. A non-owning
/// `point_range`: the buffer must outlive it. Iterators remain valid after the view is destroyed.
template <std::floating_point S>
class strided_points {
 public:
  class iterator {
   public:
    using value_type = std::array<S, 3>;
    using difference_type = std::ptrdiff_t;
    using iterator_concept = std::random_access_iterator_tag;
    using iterator_category = std::input_iterator_tag;  // points are created when they are read

    constexpr iterator() noexcept = default;

    [[nodiscard]] constexpr value_type operator*() const noexcept { return (*this)[0]; }
    [[nodiscard]] constexpr value_type operator[](difference_type n) const noexcept {
      const S* const p = x_at(at_ + n);
      return {p[0], p[layout_.coordinate_stride], p[2 * layout_.coordinate_stride]};
    }
    constexpr iterator& operator+=(difference_type n) noexcept {
      at_ += n;
      return *this;
    }
    constexpr iterator& operator-=(difference_type n) noexcept { return *this += -n; }
    constexpr iterator& operator++() noexcept { return *this += 1; }
    constexpr iterator& operator--() noexcept { return *this += -1; }
    constexpr iterator operator++(int) noexcept {
      const iterator before = *this;
      ++*this;
      return before;
    }
    constexpr iterator operator--(int) noexcept {
      const iterator before = *this;
      --*this;
      return before;
    }
    [[nodiscard]] friend constexpr iterator operator+(iterator i, difference_type n) noexcept { return i += n; }
    [[nodiscard]] friend constexpr iterator operator+(difference_type n, iterator i) noexcept { return i += n; }
    [[nodiscard]] friend constexpr iterator operator-(iterator i, difference_type n) noexcept { return i -= n; }
    [[nodiscard]] friend constexpr difference_type operator-(const iterator& a, const iterator& b) noexcept {
      return a.at_ - b.at_;
    }
    [[nodiscard]] friend constexpr bool operator==(const iterator& a, const iterator& b) noexcept {
      return a.at_ == b.at_;
    }
    [[nodiscard]] friend constexpr auto operator<=>(const iterator& a, const iterator& b) noexcept {
      return a.at_ <=> b.at_;
    }

   private:
    friend class strided_points;
    constexpr iterator(const S* data, const point_layout& layout, std::ptrdiff_t at) noexcept
        : data_{data}, layout_{layout}, at_{at} {}

    [[nodiscard]] constexpr const S* x_at(std::ptrdiff_t i) const noexcept {
      if (layout_.row_length == 0) return data_ + i * layout_.point_stride;
      const auto length = static_cast<std::ptrdiff_t>(layout_.row_length);
      return data_ + i / length * layout_.row_stride + i % length * layout_.point_stride;
    }

    const S* data_ = nullptr;
    point_layout layout_{};
    std::ptrdiff_t at_ = 0;
  };

  constexpr strided_points() noexcept = default;
  /// `data`: address of x of the first point. @pre the buffer holds all points; rows are full
  constexpr strided_points(const S* data, std::size_t size, const point_layout& layout = {}) noexcept
      : data_{data}, size_{size}, layout_{layout} {
    assert(layout.row_length == 0 || size % layout.row_length == 0);
  }

  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] constexpr iterator begin() const noexcept { return {data_, layout_, 0}; }
  [[nodiscard]] constexpr iterator end() const noexcept { return {data_, layout_, static_cast<std::ptrdiff_t>(size_)}; }
  /// @pre i < size()
  [[nodiscard]] constexpr std::array<S, 3> operator[](std::size_t i) const noexcept {
    assert(i < size_);
    return begin()[static_cast<std::ptrdiff_t>(i)];
  }

 private:
  const S* data_ = nullptr;
  std::size_t size_ = 0;
  point_layout layout_{};
};

}  // namespace orbis::interop

/// @cond
template <class S>
inline constexpr bool std::ranges::enable_borrowed_range<orbis::interop::strided_points<S>> = true;
template <class S>
inline constexpr bool std::ranges::enable_view<orbis::interop::strided_points<S>> = true;
/// @endcond

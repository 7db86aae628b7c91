// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A heap-allocated value whose type may be incomplete where its owner is copied, moved and destroyed, so that API
/// headers need not include the definitions of solvers.
#pragma once

#include <utility>

namespace orbis::optimize::detail {

/// A `T` that is copied with its owner. It is empty after a move; only assignment is then allowed.
template <class T>
class boxed {
 public:
  /// @pre T is complete
  explicit boxed(T value) : value_{new T(std::move(value))}, copy_{&copied}, destroy_{&destroyed} {}
  boxed(const boxed& o)
      : value_{o.value_ == nullptr ? nullptr : o.copy_(*o.value_)}, copy_{o.copy_}, destroy_{o.destroy_} {}
  boxed(boxed&& o) noexcept : value_{std::exchange(o.value_, nullptr)}, copy_{o.copy_}, destroy_{o.destroy_} {}
  boxed& operator=(boxed o) noexcept {
    std::swap(value_, o.value_);
    return *this;
  }
  ~boxed() { destroy_(value_); }

  [[nodiscard]] T& operator*() noexcept { return *value_; }
  [[nodiscard]] const T& operator*() const noexcept { return *value_; }
  [[nodiscard]] T* operator->() noexcept { return value_; }
  [[nodiscard]] const T* operator->() const noexcept { return value_; }

 private:
  static T* copied(const T& value) { return new T(value); }
  static void destroyed(T* value) noexcept { delete value; }

  T* value_;
  T* (*copy_)(const T&);
  void (*destroy_)(T*) noexcept;
};

}  // namespace orbis::optimize::detail

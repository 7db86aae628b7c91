// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Progress and cancellation, by a callback that nothing owns.
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>

namespace orbis {

/// A non-owning reference to a callable `bool(std::size_t done, std::size_t total)`, called now and
/// then by algorithms that can run long. It returns true to go on, false to cancel. Default: none.
///
/// The callable must outlive the call it is passed to. Algorithms call it from one thread at a time.
class progress {
 public:
  constexpr progress() noexcept = default;

  template <class F>
  requires(!std::is_same_v<std::remove_cvref_t<F>, progress> &&
           std::is_invocable_r_v<
               bool, F&, std::size_t,
               std::size_t>) constexpr progress(F&& callback) noexcept  // NOLINT(google-explicit-constructor):
                                                                        // a callback is one
      : object_{address_of(callback)}, call_{[](void* object, std::size_t done, std::size_t total) -> bool {
          return (*reinterpret_cast<std::remove_reference_t<F>*>(object))(done, total);
        }} {}

  /// Reports `done` of `total`; false if the caller asked to stop.
  [[nodiscard]] bool operator()(std::size_t done, std::size_t total) const {
    return call_ == nullptr || call_(object_, done, total);
  }

  [[nodiscard]] explicit operator bool() const noexcept { return call_ != nullptr; }

 private:
  template <class F>
  [[nodiscard]] static constexpr void* address_of(F& callback) noexcept {
    if constexpr (std::is_function_v<F>)
      return reinterpret_cast<void*>(&callback);  // POSIX has them in the same size
    else
      return const_cast<void*>(static_cast<const void*>(std::addressof(callback)));
  }

  void* object_ = nullptr;
  bool (*call_)(void*, std::size_t, std::size_t) = nullptr;
};

}  // namespace orbis

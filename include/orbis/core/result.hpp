// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// `result<T>`: a value, or an `error` with a reason and a location.
///
/// Violated preconditions trigger assertions; invalid *data* is reported through this type. The library never prints,
/// exits or aborts.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <tl/expected.hpp>

namespace orbis {

/// Error categories that a caller may need to distinguish.
enum class errc {
  not_found,         ///< file or directory does not exist
  unreadable,        ///< exists, but cannot be opened or read
  malformed,         ///< read, but damaged, truncated or inconsistent
  unsupported,       ///< well-formed, but of an unsupported kind
  write_failed,      ///< no space, no permission, I/O error while writing
  invalid_argument,  ///< a value outside the accepted range
  no_data,           ///< empty input: cloud, list or trajectory
  degenerate,        ///< geometry does not determine the result
  cancelled,         ///< the progress callback requested cancellation
  exception          ///< an exception ended the operation: out of memory, or thrown by a callback
};

/// The name of an error category, e.g. "malformed".
[[nodiscard]] constexpr std::string_view to_string(errc code) noexcept {
  switch (code) {
    case errc::not_found: return "not found";
    case errc::unreadable: return "unreadable";
    case errc::malformed: return "malformed";
    case errc::unsupported: return "unsupported";
    case errc::write_failed: return "write failed";
    case errc::invalid_argument: return "invalid argument";
    case errc::no_data: return "no data";
    case errc::degenerate: return "degenerate";
    case errc::cancelled: return "cancelled";
    case errc::exception: return "exception";
  }
  return "unknown";
}

/// An error: category, location (a file with an optional line, or a field), and reason.
struct error {
  errc code{};
  std::string where;    ///< "path/to/file.txt:17", the name of an option, or empty
  std::string message;  ///< one sentence without a full stop

  /// "where: message", on one line.
  [[nodiscard]] std::string to_string() const { return where.empty() ? message : where + ": " + message; }
};

/// A `T`, or an error: `tl::expected<T, error>` with one difference. `value()` of a temporary returns by value, so that
/// `for (const auto& frame : open_recording(path).value())` does not iterate over a destroyed object.
template <class T>
class [[nodiscard]] result : public tl::expected<T, orbis::error> {
  using base = tl::expected<T, orbis::error>;

 public:
  using base::base;
  result(base&& other) : base{std::move(other)} {}  // NOLINT(google-explicit-constructor)
  result(const base& other) : base{other} {}        // NOLINT(google-explicit-constructor)

  /// The value; throws `tl::bad_expected_access` if there is none.
  [[nodiscard]] T& value() & { return base::value(); }
  [[nodiscard]] const T& value() const& { return base::value(); }
  [[nodiscard]] T value() && { return std::move(static_cast<base&>(*this)).value(); }
  /// The value. @pre has_value()
  [[nodiscard]] T& operator*() & { return base::operator*(); }
  [[nodiscard]] const T& operator*() const& { return base::operator*(); }
  [[nodiscard]] T operator*() && { return std::move(base::operator*()); }
};

/// Success, or an error.
template <>
class [[nodiscard]] result<void> : public tl::expected<void, orbis::error> {
  using base = tl::expected<void, orbis::error>;

 public:
  using base::base;
  result(base&& other) : base{std::move(other)} {}  // NOLINT(google-explicit-constructor)

  /// Throws `tl::bad_expected_access` on error, as in the other specialisations.
  void value() const {
    if (!has_value()) throw tl::bad_expected_access<orbis::error>(error());
  }
};

/// Creates an error for a function that returns a `result`: `return fail(errc::malformed, path, "...");`.
[[nodiscard]] inline tl::unexpected<error> fail(errc code, std::string where, std::string message) {
  return tl::unexpected<error>(error{code, std::move(where), std::move(message)});
}

/// Passes an error on: `if (!x) return fail(x.error());`
[[nodiscard]] inline tl::unexpected<error> fail(error e) { return tl::unexpected<error>(std::move(e)); }

}  // namespace orbis

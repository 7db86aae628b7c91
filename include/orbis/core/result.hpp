// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// `result<T>`: a value, or an `error` that says what went wrong and where.
///
/// Broken preconditions assert; bad *data* comes back through this type. The library never prints,
/// exits or aborts.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <tl/expected.hpp>

namespace orbis {

/// The kinds of failure a caller may want to tell apart.
enum class errc {
  not_found,         ///< a file or directory that does not exist
  unreadable,        ///< exists, but cannot be opened or read
  malformed,         ///< read, but damaged, truncated or contradicting itself
  unsupported,       ///< well-formed, but of a kind we do not handle
  write_failed,      ///< no space, no permission, I/O error while writing
  invalid_argument,  ///< a value outside what the function accepts
  no_data,           ///< nothing to work on: an empty cloud, list or trajectory
  degenerate,        ///< geometry that does not determine the answer
  cancelled,         ///< the progress callback asked to stop
  exception          ///< an exception ended the work: want of memory, or one that a callback threw
};

/// The name of a kind of failure, e.g. "malformed".
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

/// What failed, where (a file with an optional line, or a field), and why.
struct error {
  errc code{};
  std::string where;    ///< "path/to/file.txt:17", an option's name, or empty
  std::string message;  ///< one sentence without a full stop

  /// "where: message", in one line.
  [[nodiscard]] std::string to_string() const { return where.empty() ? message : where + ": " + message; }
};

/// A `T`, or the reason why there is none: `tl::expected<T, error>` with one difference. Taking the
/// value out of a temporary gives it by value, so that
/// `for (const auto& frame : open_recording(path).value())` does not iterate over a dead object.
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

/// Done, or the reason why not.
template <>
class [[nodiscard]] result<void> : public tl::expected<void, orbis::error> {
  using base = tl::expected<void, orbis::error>;

 public:
  using base::base;
  result(base&& other) : base{std::move(other)} {}  // NOLINT(google-explicit-constructor)

  /// Throws `tl::bad_expected_access` unless done, as the other results do.
  void value() const {
    if (!has_value()) throw tl::bad_expected_access<orbis::error>(error());
  }
};

/// `return fail(errc::malformed, path, "...");` from a function that returns a `result`.
[[nodiscard]] inline tl::unexpected<error> fail(errc code, std::string where, std::string message) {
  return tl::unexpected<error>(error{code, std::move(where), std::move(message)});
}

/// Passes an error on: `if (!x) return fail(x.error());`
[[nodiscard]] inline tl::unexpected<error> fail(error e) { return tl::unexpected<error>(std::move(e)); }

}  // namespace orbis

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The fields of a serialised ROS message, in order.
///
/// ROS 1 packs fields without gaps in little-endian order (wiki.ros.org/msg). ROS 2 uses CDR: the first four bytes
/// specify the byte order, numbers are aligned to their size relative to the byte after those four, and strings end
/// with a zero (OMG DDSI-RTPS 2.5, section 10; OMG DDS-XTYPES 1.3, section 7.4).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include <orbis/core/bytes.hpp>

namespace app {

enum class message_encoding : std::uint8_t { ros1, cdr };

/// Reads from bytes that must outlive the reader. After the first field that extends past the end, all fields are zero
/// or empty and `ok()` is false.
class message_reader {
 public:
  message_reader(std::string_view bytes, message_encoding encoding) : bytes_{bytes}, encoding_{encoding} {
    if (encoding == message_encoding::ros1) return;
    // The representation: plain CDR, version 1 (0 and 1) or 2 (6 and 7), whose numbers align to at most four bytes.
    const int kind = bytes.size() < 4 || bytes[0] != 0 ? -1 : bytes[1];
    ok_ = kind == 0 || kind == 1 || kind == 6 || kind == 7;
    if (!ok_) return;
    order_ = kind % 2 == 0 ? std::endian::big : std::endian::little;
    most_alignment_ = kind < 6 ? 8 : 4;
    bytes_.remove_prefix(4);
  }

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  void fail() noexcept { ok_ = false; }
  [[nodiscard]] message_encoding encoding() const noexcept { return encoding_; }
  [[nodiscard]] std::size_t position() const noexcept { return at_; }
  [[nodiscard]] std::size_t rest() const noexcept { return bytes_.size() - at_; }

  template <class T>
  [[nodiscard]] T number() {
    if (const std::size_t step = std::min(sizeof(T), most_alignment_); at_ % step != 0) skip(step - at_ % step);
    const std::string_view raw = skip(sizeof(T));
    return ok_ ? orbis::load_number<T>(raw.data(), order_) : T{};
  }
  template <class T, std::size_t N>
  [[nodiscard]] std::array<T, N> array() {
    std::array<T, N> values;
    for (T& v : values) v = number<T>();
    return values;
  }
  /// The number of elements in a sequence. Afterwards, `ok()` is false if that many elements, of at least `least` bytes
  /// each, would extend past the end.
  [[nodiscard]] std::size_t count(std::size_t least) {
    const std::size_t n = number<std::uint32_t>();
    if (n > rest() / least) ok_ = false;
    return ok_ ? n : 0;
  }
  template <class T>
  [[nodiscard]] std::vector<T> list() {
    std::vector<T> values(count(sizeof(T)));
    for (T& v : values) v = number<T>();
    return values;
  }
  /// A sequence of bytes, not copied.
  [[nodiscard]] std::string_view bytes() { return skip(count(1)); }
  [[nodiscard]] std::string_view string() {
    std::string_view text = bytes();
    if (encoding_ == message_encoding::cdr && text.ends_with('\0')) text.remove_suffix(1);
    return text;
  }
  /// The next `n` bytes.
  std::string_view skip(std::size_t n) {
    if (n > rest()) ok_ = false;
    if (!ok_) return {};
    at_ += n;
    return bytes_.substr(at_ - n, n);
  }

 private:
  std::string_view bytes_;
  message_encoding encoding_;
  std::endian order_ = std::endian::little;
  std::size_t most_alignment_ = 1, at_ = 0;
  bool ok_ = true;
};

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Files that consist of sections, each with a name, a length and a checksum, so that damage can be attributed to a
/// section.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/bytes.hpp>

namespace orbis::slam::detail {

/// Appends numbers in little-endian format.
template <class... T>
void put(std::string& to, T... values) {
  (append_little_endian(to, values), ...);
}

inline constexpr std::size_t section_head = 12, section_tail = 4;  ///< bytes before and after the content

/// Appends a section; `write(std::string&)` appends its content.
template <class Write>
void put_section(std::string& to, std::string_view name, Write&& write) {
  const std::size_t begin = to.size();
  to += name;
  put(to, std::uint64_t{0});
  write(to);
  std::string length;
  put(length, std::uint64_t{to.size() - begin - section_head});
  to.replace(begin + name.size(), length.size(), length);
  put(to, crc32c(std::as_bytes(std::span{to}).subspan(begin)));
}

/// Reads numbers from the content of a section. Past the end, it returns zeros and sets `ended`.
class section_reader {
 public:
  explicit section_reader(std::string_view content) : content_{content} {}

  template <class T>
  [[nodiscard]] T take() {
    if (content_.size() < sizeof(T)) {
      end();
      return T{};
    }
    const T value = load_number<T>(content_.data());
    content_.remove_prefix(sizeof(T));
    return value;
  }
  [[nodiscard]] std::size_t left() const noexcept { return content_.size(); }
  /// Returns true if a read went past the end of the content.
  [[nodiscard]] bool ended() const noexcept { return ended_; }
  /// Discards the rest of the content and sets `ended`. Returns false.
  bool end() {
    content_ = {};
    ended_ = true;
    return false;
  }

 private:
  std::string_view content_;
  bool ended_ = false;
};

/// Iterates over the sections of a file.
class section_finder {
 public:
  section_finder(std::string_view file, std::size_t begin) : file_{file}, at_{begin} {}

  /// Returns the content of the next section if its name is `name` and it is intact.
  [[nodiscard]] std::optional<section_reader> find(std::string_view name) {
    const auto wrong = [&](const std::string& what) {
      problem_ = "section \"" + std::string(name) + "\" " + what;
      return std::nullopt;
    };
    const std::size_t left = file_.size() - at_;
    if (left < section_head) return wrong("is missing: the file ends at byte " + std::to_string(file_.size()));
    if (file_.substr(at_, name.size()) != name) return wrong("does not begin at byte " + std::to_string(at_));
    const auto length = load_number<std::uint64_t>(file_.data() + at_ + name.size());
    if (left - section_head < section_tail || length > left - section_head - section_tail)
      return wrong("from byte " + std::to_string(at_) + " is cut off: the file ends at byte " +
                   std::to_string(file_.size()));
    const std::size_t size = section_head + static_cast<std::size_t>(length);
    const std::string_view whole = file_.substr(at_, size);
    if (crc32c(std::as_bytes(std::span{whole})) != load_number<std::uint32_t>(file_.data() + at_ + size))
      return wrong("from byte " + std::to_string(at_) + " is damaged: checksum mismatch");
    at_ += size + section_tail;
    return section_reader{whole.substr(section_head)};
  }

  /// Returns true if no section follows.
  [[nodiscard]] bool at_end() {
    if (at_ == file_.size()) return true;
    problem_ = "unexpected data after the end at byte " + std::to_string(at_);
    return false;
  }
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

 private:
  std::string_view file_;
  std::size_t at_;
  std::string problem_;
};

}  // namespace orbis::slam::detail

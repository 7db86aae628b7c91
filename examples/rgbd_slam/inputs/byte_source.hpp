// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random access to the bytes of a file or of memory.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <ios>
#include <string>
#include <utility>

#include <orbis/core/result.hpp>

namespace app {

/// A file or a string of bytes. Not thread-safe.
class byte_source {
 public:
  explicit byte_source(std::string memory) : memory_{std::move(memory)}, size_{memory_.size()} {}
  /// Opens a file. Errors: not_found, unreadable.
  [[nodiscard]] static orbis::result<byte_source> open(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::exists(path, error) && (!error || error == std::errc::no_such_file_or_directory))
      return orbis::fail(orbis::errc::not_found, path.string(), "no such file");
    byte_source source{std::string{}};
    source.size_ = std::filesystem::file_size(path, error);
    source.file_.open(path, std::ios::binary);
    if (error || !source.file_) return orbis::fail(orbis::errc::unreadable, path.string(), "cannot be opened");
    return source;
  }

  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
  /// Reads `count` bytes starting at position `at`; fewer at the end of the source.
  [[nodiscard]] std::string read(std::uint64_t at, std::uint64_t count) {
    if (at >= size_) return {};
    count = std::min(count, size_ - at);
    if (!file_.is_open()) return memory_.substr(at, count);
    std::string bytes(count, '\0');
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(at));
    file_.read(bytes.data(), static_cast<std::streamsize>(count));
    bytes.resize(static_cast<std::size_t>(file_.gcount()));
    return bytes;
  }

 private:
  std::string memory_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
};

}  // namespace app

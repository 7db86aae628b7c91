// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Colour images in a file, for frames that take longer to make again than to read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <unordered_map>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include <orbis/core/image.hpp>

namespace app {

/// Colour images by number, all of one size, in a file that has no name once it is open.
class color_file {
 public:
  explicit color_file(std::filesystem::path path) : path_{std::move(path)} {}
  color_file(color_file&& other) noexcept
      : path_{std::move(other.path_)}, file_{std::exchange(other.file_, -1)}, at_{std::move(other.at_)} {}
  color_file& operator=(color_file&&) = delete;
  ~color_file() {
    if (file_ >= 0) ::close(file_);
  }

  /// Whether it was written. Those that were not have to be had elsewhere.
  bool put(std::uint64_t number, const orbis::image<orbis::rgb8>& color) {
    if (file_ < 0 && at_.empty()) {
      file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
      if (file_ >= 0) ::unlink(path_.c_str());
    }
    const std::size_t place = at_.size();
    const auto bytes = size_of(color);
    if (file_ < 0 || ::pwrite(file_, color.pixels().data(), bytes, offset(place, bytes)) != static_cast<ssize_t>(bytes))
      return false;
    at_[number] = place;
    return true;
  }
  /// Whether it could be read. `out` has the size of the images. Any number of threads may call this.
  bool get(std::uint64_t number, orbis::image<orbis::rgb8>& out) const {
    const auto found = at_.find(number);
    if (found == at_.end()) return false;
    const auto bytes = size_of(out);
    return ::pread(file_, out.pixels().data(), bytes, offset(found->second, bytes)) == static_cast<ssize_t>(bytes);
  }

 private:
  [[nodiscard]] static std::size_t size_of(const orbis::image<orbis::rgb8>& color) {
    return color.pixels().size() * sizeof(orbis::rgb8);
  }
  [[nodiscard]] static off_t offset(std::size_t place, std::size_t bytes) {
    return static_cast<off_t>(place) * static_cast<off_t>(bytes);
  }

  std::filesystem::path path_;
  int file_ = -1;
  std::unordered_map<std::uint64_t, std::size_t> at_;
};

}  // namespace app

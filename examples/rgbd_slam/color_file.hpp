// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A file for the colours of keyframes, so that images are not decoded or rendered twice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include <orbis/core/image.hpp>

namespace app {

/// Stores numbered colour images of equal size: every `stride`-th pixel of every `stride`-th row, which are the pixels
/// that become points. The file is unlinked as soon as it is open.
class color_file {
 public:
  /// `most_bytes`: maximum size of the file. @pre stride > 0
  color_file(std::filesystem::path path, int stride, std::uint64_t most_bytes)
      : path_{std::move(path)}, stride_{stride}, most_bytes_{most_bytes} {}
  color_file(color_file&& other) noexcept
      : path_{std::move(other.path_)},
        stride_{other.stride_},
        most_bytes_{other.most_bytes_},
        file_{std::exchange(other.file_, -1)},
        at_{std::move(other.at_)} {}
  color_file& operator=(color_file&&) = delete;
  ~color_file() {
    if (file_ >= 0) ::close(file_);
  }

  /// Stores an image and replaces a previous one with the same number. Returns false if it was not stored.
  bool put(std::uint64_t number, const orbis::image<orbis::rgb8>& color) {
    if (file_ < 0 && at_.empty()) {
      file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
      if (file_ >= 0) ::unlink(path_.c_str());
    }
    const auto known = at_.find(number);
    const std::size_t place = known != at_.end() ? known->second : at_.size();
    const std::vector<orbis::rgb8> pixels = sample(color);
    const std::size_t bytes = pixels.size() * sizeof(orbis::rgb8);
    if (file_ < 0 || (place + 1) * bytes > most_bytes_ ||
        ::pwrite(file_, pixels.data(), bytes, offset(place, bytes)) != static_cast<ssize_t>(bytes))
      return false;
    at_[number] = place;
    return true;
  }
  /// Reads an image; returns false on failure. `out` must have the size of the images; pixels that are not stored
  /// remain unchanged. Thread-safe.
  bool get(std::uint64_t number, orbis::image<orbis::rgb8>& out) const {
    const auto found = at_.find(number);
    if (found == at_.end()) return false;
    std::vector<orbis::rgb8> pixels(samples(out.height()) * samples(out.width()));
    const std::size_t bytes = pixels.size() * sizeof(orbis::rgb8);
    if (::pread(file_, pixels.data(), bytes, offset(found->second, bytes)) != static_cast<ssize_t>(bytes)) return false;
    auto from = pixels.begin();
    for (int y = 0; y < out.height(); y += stride_)
      for (int x = 0; x < out.width(); x += stride_) out(x, y) = *from++;
    return true;
  }

 private:
  /// Number of stored pixels of a row or column.
  [[nodiscard]] std::size_t samples(int size) const { return static_cast<std::size_t>((size + stride_ - 1) / stride_); }
  [[nodiscard]] std::vector<orbis::rgb8> sample(const orbis::image<orbis::rgb8>& color) const {
    std::vector<orbis::rgb8> pixels;
    pixels.reserve(samples(color.height()) * samples(color.width()));
    for (int y = 0; y < color.height(); y += stride_)
      for (int x = 0; x < color.width(); x += stride_) pixels.push_back(color(x, y));
    return pixels;
  }
  [[nodiscard]] static off_t offset(std::size_t place, std::size_t bytes) {
    return static_cast<off_t>(place) * static_cast<off_t>(bytes);
  }

  std::filesystem::path path_;
  int stride_;
  std::uint64_t most_bytes_;
  int file_ = -1;
  std::unordered_map<std::uint64_t, std::size_t> at_;
};

}  // namespace app

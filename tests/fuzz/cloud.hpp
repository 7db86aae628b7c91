// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What must hold for every reader of clouds.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>

#include "fuzz/target.hpp"

namespace orbis::fuzz {

/// `read(bytes)` gives an error with a reason, or a cloud (returned) that takes memory in proportion to the bytes.
template <class Read>
auto check_cloud_reader(std::string_view bytes, std::size_t memory_per_byte, Read&& read) {
  std::optional<decltype(read(bytes))> got;
  const std::size_t peak = peak_bytes_of([&] { got.emplace(read(bytes)); });
  require(peak <= 8192 + memory_per_byte * bytes.size(), "memory in proportion to the file");
  if (!*got) {
    const error& e = got->error();
    require(e.code == errc::malformed || e.code == errc::unsupported, "a damaged file is malformed or unsupported");
    require(!e.message.empty() && e.to_string().size() < 300, "the reason is given, and short");
  }
  return *std::move(got);
}

inline void check_cloud(const point_cloud& cloud) {
  require(cloud.colors.empty() || cloud.colors.size() == cloud.points.size(), "a colour for each point, or none");
}

}  // namespace orbis::fuzz

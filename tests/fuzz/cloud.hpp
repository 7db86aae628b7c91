// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What must hold for every reader of clouds.
#pragma once

#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/cloud_fields.hpp>
#include <orbis/io/detail/files/scalar_type.hpp>

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

/// `read` is `cloud` with fields that have all of their numbers and names of their own.
inline void check_fields(const io::cloud_with_fields& read, const point_cloud& cloud) {
  require(read.cloud.colors == cloud.colors && read.cloud.size() == cloud.size(), "fields do not change the cloud");
  std::set<std::string> names;
  for (const io::cloud_field& field : read.fields) {
    require(field.bytes.size() == cloud.size() * field.count * io::detail::byte_size(field.type),
            "numbers of all points");
    require(!field.name.empty() && names.insert(field.name).second, "fields have different names");
  }
  for (const std::string& note : read.notes) require(!note.empty(), "a note has words");
}

/// Where a cloud may be read from: nearby, in a map's coordinates, and out of all bounds.
[[nodiscard]] inline vec3 some_origin(std::size_t which) {
  constexpr double origins[][3] = {{1.0, -2.5, 3.0}, {4.5e5, 5.6e6, 120.25}, {1e-3, -1e10, 1e300}};
  const auto& o = origins[which % std::size(origins)];
  return {o[0], o[1], o[2]};
}

/// `moved` is `cloud` with `origin` taken off, as far as floats can tell.
inline void check_moved(const point_cloud& cloud, const point_cloud& moved, const vec3& origin) {
  require(moved.size() == cloud.size() && moved.colors == cloud.colors, "an origin changes coordinates only");
  for (std::size_t i = 0; i != cloud.size(); ++i)
    for (int axis = 0; axis != 3; ++axis) {
      const double was = cloud.points[i][axis], is = moved.points[i][axis], wanted = was - origin[axis];
      if (!std::isfinite(was) || !std::isfinite(is) || std::abs(wanted) > 3e38) continue;  // beyond a float's range
      require(std::abs(is - wanted) <= 1.2e-7 * (std::abs(was) + std::abs(wanted)) + 1e-44,
              "an origin is taken off each coordinate");
    }
}

}  // namespace orbis::fuzz

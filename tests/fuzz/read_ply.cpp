// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a PLY file, as it is and with an origin taken off.
#include <cstdint>
#include <string_view>

#include <orbis/io/ply.hpp>

#include "fuzz/cloud.hpp"
#include "fuzz/target.hpp"

using namespace orbis;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto cloud = fuzz::check_cloud_reader({reinterpret_cast<const char*>(data), size}, 128,
                                              [](std::string_view bytes) { return io::parse_ply(bytes, "fuzz.ply"); });
  if (!cloud) return 0;
  fuzz::accept();
  fuzz::check_cloud(*cloud);
  const auto all =
      fuzz::check_cloud_reader({reinterpret_cast<const char*>(data), size}, 128,
                               [](std::string_view bytes) { return io::parse_ply_with_fields(bytes, "fuzz.ply"); });
  fuzz::require(all.has_value(), "a cloud with fields is read where a cloud is");
  fuzz::check_fields(*all, *cloud);
  const vec3 origin = fuzz::some_origin(size);
  const auto moved = io::parse_ply({reinterpret_cast<const char*>(data), size}, "fuzz.ply", origin);
  fuzz::require(moved.has_value(), "an origin does not make a file unreadable");
  fuzz::check_moved(*cloud, *moved, origin);
  return 0;
}

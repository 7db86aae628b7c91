// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a PCD file, in text, binary and compressed, as it is and with an origin taken off.
#include <cstdint>
#include <string_view>

#include <orbis/io/pcd.hpp>

#include "fuzz/cloud.hpp"
#include "fuzz/target.hpp"

using namespace orbis;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // A compressed byte may stand for 88, and a point of three bytes becomes one of 12.
  const auto read = fuzz::check_cloud_reader({reinterpret_cast<const char*>(data), size}, 600,
                                             [](std::string_view bytes) { return io::parse_pcd(bytes, "fuzz.pcd"); });
  if (!read) return 0;
  fuzz::accept();
  fuzz::check_cloud(*read);
  const auto all =
      fuzz::check_cloud_reader({reinterpret_cast<const char*>(data), size}, 900,
                               [](std::string_view bytes) { return io::parse_pcd_with_fields(bytes, "fuzz.pcd"); });
  fuzz::require(all.has_value(), "a cloud with fields is read where a cloud is");
  fuzz::check_fields(*all, *read);
  const vec3 origin = fuzz::some_origin(size);
  const auto moved = io::parse_pcd({reinterpret_cast<const char*>(data), size}, "fuzz.pcd", origin);
  fuzz::require(moved.has_value(), "an origin does not make a file unreadable");
  fuzz::check_moved(*read, *moved, origin);
  return 0;
}

// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a PCD file, in text, binary and compressed.
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
  fuzz::check_cloud(read->cloud);
  fuzz::require(read->width * read->height == read->cloud.size(), "the shape is that of the points");
  return 0;
}

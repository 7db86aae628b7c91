// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a PLY file.
#include <cstdint>
#include <string_view>

#include <orbis/io/ply.hpp>

#include "fuzz/cloud.hpp"
#include "fuzz/target.hpp"

using namespace orbis;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto cloud = fuzz::check_cloud_reader({reinterpret_cast<const char*>(data), size}, 128,
                                              [](std::string_view bytes) { return io::parse_ply(bytes, "fuzz.ply"); });
  if (cloud) fuzz::check_cloud(*cloud);
  return 0;
}

// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a `.bt` file.
#include "fuzz/octree.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace orbis;
  fuzz::check_reader(std::as_bytes(std::span{data, size}), [](auto bytes) { return octree::read_bt(bytes); });
  return 0;
}

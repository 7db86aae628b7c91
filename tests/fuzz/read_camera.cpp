// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a camera file, and as the text of a camera matrix.
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>

#include <orbis/io/camera_file.hpp>
#include <orbis/io/detail/recordings/seven_scenes.hpp>

#include "fuzz/target.hpp"

using namespace orbis;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  std::optional<result<camera::camera_settings>> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(io::parse_camera(text, "fuzz.toml")); });
  fuzz::require(peak <= 65536 + 2048 * size, "memory in proportion to the file");
  if (*got) {
    fuzz::accept();
    const camera::intrinsics& k = (*got)->model.k();
    fuzz::require(k.width > 0 && k.height > 0 && k.fx > 0.0 && k.fy > 0.0, "an image has a size and a focal length");
    fuzz::require(std::isfinite(k.fx + k.fy + k.cx + k.cy), "intrinsics are numbers");
    fuzz::require((*got)->depth_scale > 0.0 && (*got)->fps > 0.0, "scales are above zero");
  } else {
    fuzz::require(got->error().where.starts_with("fuzz.toml"), "an error says where");
    fuzz::require(!got->error().message.empty(), "an error says why");
  }
  if (const auto k = io::detail::parse_camera_matrix(text, "fuzz.txt"))
    fuzz::require(k->allFinite() && (*k)(0, 0) > 0.0 && (*k)(1, 1) > 0.0, "a camera matrix has focal lengths");
  return 0;
}

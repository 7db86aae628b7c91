// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a JPEG file. What can be read is written and read again.
#include <cstdint>
#include <optional>
#include <string_view>

#include <orbis/io/detail/files/jpeg_codec.hpp>
#include <orbis/io/jpeg.hpp>

#include "fuzz/target.hpp"

using namespace orbis;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes{reinterpret_cast<const char*>(data), size};
  {  // most of the time on small images: large ones differ in little but time
    io::detail::jpeg_decoder decoder{bytes};
    if (decoder.read_header() && decoder.width() * std::int64_t{decoder.height()} > 16384 && size % 16 != 0) return 0;
  }
  std::optional<result<image<rgb8>>> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(io::decode_jpeg(bytes)); });
  fuzz::require(peak <= 8192 + sizeof(rgb8) * ((std::size_t{1} << 20U) + 2048 * size),
                "memory in proportion to the file");
  if (!*got) {
    const error& e = got->error();
    fuzz::require(e.code == errc::malformed, "a damaged image is malformed");
    fuzz::require(e.message.size() > 15 && e.message.size() < 300, "the reason is given, and short");
    return 0;
  }
  fuzz::accept();
  if ((*got)->pixels().size() > 16384) return 0;
  const auto written = io::encode_jpeg(**got);
  fuzz::require(written.has_value(), "what was read can be written");
  const auto again = io::decode_jpeg(*written);
  fuzz::require(again && again->width() == (*got)->width() && again->height() == (*got)->height(),
                "what was written can be read");
  return 0;
}

// SPDX-License-Identifier: BSD-3-Clause
//
// A compressed depth image, as a spill file may give it back. The first two bytes are its size and the range of its
// depths; the rest is tried as compressed bytes, as pixels that are compressed, and as changes to what comes of those.
#include <optional>
#include <utility>
#include <vector>

#include <orbis/mapping/detail/depth/depth_codec.hpp>

#include "fuzz/source.hpp"
#include "fuzz/target.hpp"

namespace {

using namespace orbis;
using depth_image = image<std::uint16_t>;

/// Reused by all inputs: images take longer to allocate its table for than to compress.
[[nodiscard]] std::span<const std::byte> encoded(const depth_image& pixels) {
  static mapping::detail::depth_encoder encoder;
  return encoder.encode(pixels);
}

/// Reads any bytes. What comes out, if it does, can be written and read again.
void check(std::span<const std::byte> bytes, int width, int height, bool is_written_again = true) {
  depth_image got(width, height);
  mapping::detail::depth_decoder decoder;
  std::optional<result<void>> done;
  const std::size_t peak = fuzz::peak_bytes_of([&] { done.emplace(decoder.decode(bytes, got.view())); });
  fuzz::require(peak <= 512 * 1024 + 4 * bytes.size(), "memory in proportion to the bytes");
  if (!*done) {
    fuzz::require(done->error().code == errc::malformed, "a damaged image is malformed");
    fuzz::require(!done->error().message.empty(), "the reason is given");
    return;
  }
  fuzz::accept();
  if (!is_written_again) return;
  depth_image again(width, height);
  fuzz::require(static_cast<bool>(decoder.decode(encoded(got), again.view())), "it can be read again");
  fuzz::require(again == got, "with the same pixels");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::source from{{data, size}};
  const unsigned columns = from.byte(), rows = from.byte();
  // Mostly small ones, of which more can be tried.
  const unsigned limit = (columns & rows & 192U) == 192U ? 64 : 24;
  const int width = static_cast<int>(columns % limit), height = static_cast<int>(rows % limit);
  const bool any_depth = (columns & 192U) == 64U;
  const auto rest = std::as_bytes(std::span{data, size}.subspan(size < 2 ? size : 2));
  check(rest, width, height);

  depth_image pixels(width, height);
  for (auto& v : pixels.pixels()) {
    const unsigned low = from.byte();
    const bool is_near = low < 192 || !any_depth;
    v = static_cast<std::uint16_t>(low < 64 ? 0 : is_near ? 900 + 7 * low : low << 8U | from.byte());
  }
  const auto packed = encoded(pixels);
  std::vector<std::byte> bytes(packed.begin(), packed.end());
  depth_image back(width, height);
  mapping::detail::depth_decoder decoder;
  fuzz::require(static_cast<bool>(decoder.decode(bytes, back.view())), "what was compressed can be read");
  fuzz::require(back == pixels, "and has not changed");

  for (std::size_t i = 0; i + 2 < rest.size() && i < 24; i += 3) {
    const std::size_t at =
        std::to_integer<std::size_t>(rest[i]) << 4U | std::to_integer<std::size_t>(rest[i + 1]) >> 4U;
    bytes[at % bytes.size()] ^= rest[i + 2];
    check(bytes, width, height, i == 0);  // writing takes longest
  }
  return 0;
}

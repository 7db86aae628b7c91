// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes, decompressed to the size that the first two of them say, and compressed.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <orbis/io/detail/files/lzf.hpp>

#include "fuzz/target.hpp"

namespace detail = orbis::io::detail;
namespace fuzz = orbis::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::string_view bytes{reinterpret_cast<const char*>(data) + 2, size - 2};
  const std::size_t wanted = data[0] | static_cast<std::size_t>(data[1]) << 8U;
  std::optional<std::string> out;
  const std::size_t peak = fuzz::peak_bytes_of([&] { out = detail::lzf_decompress(bytes, wanted); });
  fuzz::require(peak <= 256 + 100 * size, "memory in proportion to the bytes");
  fuzz::require(!out || out->size() == wanted, "as many bytes as were asked for");

  if (out) fuzz::accept();
  const std::string read = out.value_or("");
  for (const std::string_view text : {bytes, std::string_view{read}}) {
    const std::string packed = detail::lzf_compress(text);
    fuzz::require(packed.size() <= text.size() + text.size() / 32 + 1, "what does not compress grows by little");
    fuzz::require(detail::lzf_decompress(packed, text.size()) == text, "what was compressed can be read");
    fuzz::require(!detail::lzf_decompress(packed, text.size() + 1), "no more than there is");
    fuzz::require(text.empty() || !detail::lzf_decompress(packed, text.size() - 1), "no less than there is");
  }
  return 0;
}

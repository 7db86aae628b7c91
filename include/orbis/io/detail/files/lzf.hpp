// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The LZF compression of `binary_compressed` PCD files.
///
/// The stream is a sequence of items, each starting with a byte c. If c < 32, c + 1 literal bytes follow. Otherwise the
/// item is a copy of length c >> 5 (if that is 7, plus the next byte) plus 2, from ((c & 31) << 8 | next byte) + 1
/// bytes back in the output; source and destination may overlap.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace orbis::io::detail {

/// Maximum number of bytes to which `size` compressed bytes expand: a copy of 264 bytes takes 3.
[[nodiscard]] constexpr std::uint64_t lzf_max_output(std::uint64_t size) noexcept { return size * 88 + 32; }

/// Decompresses exactly `size` bytes; empty if `compressed` is damaged or expands to another size.
template <class = void>
[[nodiscard]] std::optional<std::string> lzf_decompress(std::string_view compressed, std::size_t size) {
  if (size > lzf_max_output(compressed.size())) return std::nullopt;
  std::string out;
  out.reserve(size);
  const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(compressed[i])); };
  std::size_t at = 0;
  while (at != compressed.size()) {
    const std::size_t c = byte(at++);
    if (c < 32) {
      const std::size_t count = c + 1;
      if (count > compressed.size() - at || count > size - out.size()) return std::nullopt;
      out.append(compressed, at, count);
      at += count;
      continue;
    }
    std::size_t length = c >> 5;
    if (compressed.size() - at < (length == 7 ? 2U : 1U)) return std::nullopt;
    if (length == 7) length += byte(at++);
    length += 2;
    const std::size_t distance = ((c & 31) << 8 | byte(at++)) + 1;
    if (distance > out.size() || length > size - out.size()) return std::nullopt;
    for (std::size_t from = out.size() - distance; length != 0; --length) out.push_back(out[from++]);
  }
  if (out.size() != size) return std::nullopt;
  return out;
}

/// Compresses `data` greedily, with one stored position for each hash of three bytes. Incompressible data grows by one
/// byte per 32.
template <class = void>
[[nodiscard]] std::string lzf_compress(std::string_view data) {
  constexpr std::size_t max_distance = 8192, max_length = 264, none = static_cast<std::size_t>(-1);
  constexpr unsigned hash_bits = 14;
  std::array<std::size_t, std::size_t{1} << hash_bits> last{};
  last.fill(none);
  const auto byte = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(data[i])); };
  const auto slot = [&](std::size_t i) -> std::size_t& {
    return last[(byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2)) * 2654435761U >> (32 - hash_bits)];
  };

  std::string out;
  std::size_t literals = 0;  // the first literal not yet written
  const auto write_literals = [&](std::size_t end) {
    while (literals != end) {
      const std::size_t count = std::min<std::size_t>(32, end - literals);
      out.push_back(static_cast<char>(count - 1));
      out.append(data, literals, count);
      literals += count;
    }
  };
  std::size_t at = 0;
  while (data.size() - at >= 3) {
    std::size_t& remembered = slot(at);
    const std::size_t from = remembered;
    remembered = at;
    std::size_t length = 0;
    if (from != none && at - from <= max_distance) {
      const std::size_t limit = std::min(max_length, data.size() - at);
      while (length != limit && data[from + length] == data[at + length]) ++length;
    }
    if (length < 3) {
      ++at;
      continue;
    }
    write_literals(at);
    const std::size_t distance = at - from - 1, coded = length - 2;
    out.push_back(static_cast<char>(std::min<std::size_t>(coded, 7) << 5 | distance >> 8));
    if (coded >= 7) out.push_back(static_cast<char>(coded - 7));
    out.push_back(static_cast<char>(distance & 255));
    for (std::size_t i = at + 1; i != at + length && data.size() - i >= 3; ++i) slot(i) = i;
    at += length;
    literals = at;
  }
  write_literals(data.size());
  return out;
}

}  // namespace orbis::io::detail

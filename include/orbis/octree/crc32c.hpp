// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A checksum: CRC-32C, as iSCSI has it.
///
/// G. Castagnoli, S. Bräuer, M. Herrmann, "Optimization of cyclic redundancy-check codes with 24 and
/// 32 parity bits", IEEE Transactions on Communications 41, 1993.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace orbis::octree {

/// The checksum of `bytes`; of bytes that follow others whose checksum is `before`.
[[nodiscard]] constexpr std::uint32_t crc32c(std::string_view bytes, std::uint32_t before = 0) noexcept {
  constexpr auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i != t.size(); ++i) {
      std::uint32_t c = i;
      for (int bit = 0; bit != 8; ++bit) c = (c >> 1U) ^ ((c & 1U) != 0 ? 0x82f63b78U : 0U);
      t[i] = c;
    }
    return t;
  }();
  std::uint32_t c = ~before;
  for (const char byte : bytes) c = table[(c ^ static_cast<unsigned char>(byte)) & 0xffU] ^ c >> 8U;
  return ~c;
}

}  // namespace orbis::octree

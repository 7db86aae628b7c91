// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How many of many descriptors have each bit set.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <orbis/core/bits.hpp>

namespace orbis::places::detail {

/// Bit k of a byte to the lowest bit of byte k.
[[nodiscard]] constexpr std::array<std::uint64_t, 256> make_spread_bits() noexcept {
  std::array<std::uint64_t, 256> table{};
  for (std::size_t byte = 0; byte != 256; ++byte)
    for (std::size_t k = 0; k != 8; ++k) table[byte] |= std::uint64_t{(byte >> k) & 1U} << (8 * k);
  return table;
}
inline constexpr std::array<std::uint64_t, 256> spread_bits = make_spread_bits();

/// Counts bit by bit, eight counters in a word until one of them could run over.
template <std::size_t Bits>
class bit_votes {
 public:
  void add(const bit_words<Bits>& descriptor) noexcept {
    if (pending_ == 255) flush();
    ++pending_;
    for (std::size_t w = 0; w != Bits / 64; ++w)
      for (std::size_t b = 0; b != 8; ++b) narrow_[8 * w + b] += spread_bits[(descriptor[w] >> (8 * b)) & 0xffU];
  }
  void add(bit_votes& other) noexcept {
    flush();
    other.flush();
    for (std::size_t i = 0; i != Bits; ++i) ones_[i] += other.ones_[i];
    total_ += other.total_;
  }
  [[nodiscard]] std::uint64_t total() const noexcept { return total_ + pending_; }

  /// The bits that more than half have set; of those that exactly half have, what `tie` says.
  [[nodiscard]] bit_words<Bits> majority(const bit_words<Bits>& tie) noexcept {
    flush();
    bit_words<Bits> result{};
    for (std::size_t i = 0; i != Bits; ++i) {
      const std::uint64_t twice = 2 * std::uint64_t{ones_[i]};
      const bool set = twice == total_ ? ((tie[i / 64] >> (i % 64)) & 1U) != 0 : twice > total_;
      if (set) result[i / 64] |= std::uint64_t{1} << (i % 64);
    }
    return result;
  }

 private:
  void flush() noexcept {
    for (std::size_t i = 0; i != Bits; ++i)
      ones_[i] += static_cast<std::uint32_t>((narrow_[i / 8] >> (8 * (i % 8))) & 0xffU);
    narrow_ = {};
    total_ += pending_;
    pending_ = 0;
  }

  std::array<std::uint64_t, Bits / 8> narrow_{};
  std::array<std::uint32_t, Bits> ones_{};
  std::uint64_t total_ = 0;
  std::uint32_t pending_ = 0;
};

}  // namespace orbis::places::detail

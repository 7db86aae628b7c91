// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Entropy coding of small symbols with fixed frequencies (rANS): a symbol of probability p takes -log2 p bits.
///
/// J. Duda, "Asymmetric numeral systems: entropy coding combining speed of Huffman coding with compression rate of
/// arithmetic coding", arXiv:1311.2540, 2013. The state has 32 bits; it is filled and emptied in words of 16. The
/// encoder takes the symbols in reverse order.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace orbis::mapping::detail {

inline constexpr unsigned rans_scale_bits = 12;
inline constexpr std::uint32_t rans_scale = 1U << rans_scale_bits;  ///< what the frequencies of a table add up to
inline constexpr std::uint32_t rans_lowest = 1U << 16U;             ///< the state is never below, and starts here

/// Scales `counts` so that they add up to `rans_scale`, and none that was above zero becomes zero. Without a count
/// above zero all become zero.
/// @pre counts.size() <= rans_scale
inline void normalize_counts(std::span<std::uint32_t> counts) noexcept {
  assert(counts.size() <= rans_scale);
  std::uint64_t total = 0;
  for (const std::uint32_t c : counts) total += c;
  if (total == 0) return;
  std::uint32_t given = 0;
  for (std::uint32_t& c : counts) {
    if (c == 0) continue;
    const auto scaled = static_cast<std::uint32_t>((std::uint64_t{c} * rans_scale + total / 2) / total);
    c = scaled == 0 ? 1 : scaled;
    given += c;
  }
  // Rounding is made good where it costs least: at the largest.
  while (given != rans_scale) {
    std::uint32_t* largest = counts.data();
    for (std::uint32_t& c : counts)
      if (c > *largest) largest = &c;
    if (given < rans_scale) {
      *largest += rans_scale - given;
      given = rans_scale;
    } else {
      const std::uint32_t less = given - rans_scale < *largest / 2 ? given - rans_scale : *largest / 2;
      *largest -= less;
      given -= less;
    }
  }
}

/// A symbol's frequency and the sum of those before it; both at most `rans_scale`.
struct rans_symbol {
  std::uint16_t frequency = 0, start = 0;
};

/// What the encoder wants of a symbol: division by its frequency becomes a product.
struct rans_encoder_symbol {
  std::uint64_t reciprocal = 0;  ///< 2^44 / frequency, rounded up
  std::uint64_t highest = 0;     ///< states from here on have to give a word away first
  std::uint32_t frequency = 0, start = 0;

  rans_encoder_symbol() = default;
  /// @pre 0 < s.frequency
  explicit rans_encoder_symbol(rans_symbol s) noexcept
      : reciprocal{(std::uint64_t{1} << 44U) / s.frequency + 1},
        highest{std::uint64_t{s.frequency} << (32U - rans_scale_bits)},
        frequency{s.frequency},
        start{s.start} {}
};

/// Writes symbols; the last one first. The words go below `end`, downwards.
class rans_encoder {
 public:
  explicit rans_encoder(std::uint16_t* end) noexcept : at_{end} {}

  void put(const rans_encoder_symbol& s) noexcept {
    if (state_ >= s.highest) give_word();
    // state_ < frequency * 2^20 makes the product exact and less than 2^64.
    const auto quotient = static_cast<std::uint32_t>(state_ * s.reciprocal >> 44U);
    state_ = (std::uint64_t{quotient} << rans_scale_bits) + (state_ - quotient * s.frequency) + s.start;
  }
  /// `bits` bits as they are. @pre bits <= 16, value < 2^bits
  void put_bits(std::uint32_t value, unsigned bits) noexcept {
    if (state_ >= std::uint64_t{1} << (32U - bits)) give_word();
    state_ = state_ << bits | value;
  }
  /// The first word written so far, behind which the others follow.
  [[nodiscard]] const std::uint16_t* words() const noexcept { return at_; }
  [[nodiscard]] std::uint32_t state() const noexcept { return static_cast<std::uint32_t>(state_); }

 private:
  void give_word() noexcept {
    *--at_ = static_cast<std::uint16_t>(state_);
    state_ >>= 16U;
  }
  std::uint16_t* at_;
  std::uint64_t state_ = rans_lowest;  // less than 2^32
};

/// The symbols of one table by slot, for the decoder.
template <std::size_t Symbols>
struct rans_decoder_table {
  std::array<rans_symbol, Symbols> symbols{};
  std::array<std::uint8_t, rans_scale> symbol_of{};  ///< of each slot
};

/// Reads what `rans_encoder` wrote. Behind the last word come zeros.
class rans_decoder {
 public:
  rans_decoder() = default;
  /// `words`: two bytes each, little-endian.
  rans_decoder(std::uint32_t state, std::span<const std::byte> words) noexcept
      : at_{words.data()}, end_{words.data() + words.size() / 2 * 2}, state_{state} {}

  template <std::size_t Symbols>
  [[nodiscard]] std::uint32_t get(const rans_decoder_table<Symbols>& table) noexcept {
    const std::uint32_t slot = state_ & (rans_scale - 1);
    const std::uint32_t symbol = table.symbol_of[slot];
    const rans_symbol s = table.symbols[symbol];
    state_ = s.frequency * (state_ >> rans_scale_bits) + slot - s.start;
    take_word_if_low();
    return symbol;
  }
  /// @pre bits <= 16
  [[nodiscard]] std::uint32_t get_bits(unsigned bits) noexcept {
    const std::uint32_t value = state_ & ((1U << bits) - 1);
    state_ >>= bits;
    take_word_if_low();
    return value;
  }
  /// Whether all words have been read and nothing else: what was written has come back.
  [[nodiscard]] bool at_end() const noexcept { return at_ == end_ && state_ == rans_lowest; }

 private:
  /// Without branches: whether a word is due is as random as the symbols are.
  void take_word_if_low() noexcept {
    static constexpr std::array<std::byte, 2> zeros{};
    const bool low = state_ < rans_lowest, left = at_ != end_;
    const std::byte* from = left ? at_ : zeros.data();
    const std::uint32_t word = std::to_integer<std::uint32_t>(from[0]) | std::to_integer<std::uint32_t>(from[1]) << 8U;
    const std::uint32_t filled = state_ << 16U | word;
    state_ = low ? filled : state_;
    at_ += 2 * static_cast<std::ptrdiff_t>(low && left);
  }
  const std::byte* at_ = nullptr;
  const std::byte* end_ = nullptr;
  std::uint32_t state_ = rans_lowest;
};

}  // namespace orbis::mapping::detail

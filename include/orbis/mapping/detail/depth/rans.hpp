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

/// Where encoders write words: below `end`, downwards. Several may share it; then decoders that take turns in the same
/// order, forwards, can share a `rans_source`.
class rans_sink {
 public:
  explicit rans_sink(std::uint16_t* end) noexcept : at_{end} {}
  void put(std::uint16_t word) noexcept { *--at_ = word; }
  /// The first word in the file, which was written last.
  [[nodiscard]] const std::uint16_t* words() const noexcept { return at_; }

 private:
  std::uint16_t* at_;
};

/// Writes symbols; the last one first.
class rans_encoder {
 public:
  void put(const rans_encoder_symbol& s, rans_sink& to) noexcept {
    if (state_ >= s.highest) give_word(to);
    // state_ < frequency * 2^20 makes the product exact and less than 2^64.
    const auto quotient = static_cast<std::uint32_t>(state_ * s.reciprocal >> 44U);
    state_ = (std::uint64_t{quotient} << rans_scale_bits) + (state_ - quotient * s.frequency) + s.start;
  }
  /// `bits` bits as they are. @pre bits <= 16, value < 2^bits
  void put_bits(std::uint32_t value, unsigned bits, rans_sink& to) noexcept {
    if (state_ >= std::uint64_t{1} << (32U - bits)) give_word(to);
    state_ = state_ << bits | value;
  }
  [[nodiscard]] std::uint32_t state() const noexcept { return static_cast<std::uint32_t>(state_); }

 private:
  void give_word(rans_sink& to) noexcept {
    to.put(static_cast<std::uint16_t>(state_));
    state_ >>= 16U;
  }
  std::uint64_t state_ = rans_lowest;  // less than 2^32
};

/// The symbols of one table by slot, for the decoder: 6 bits of the symbol, 12 of the slot less the symbol's first one,
/// 13 of its frequency.
struct rans_decoder_table {
  static constexpr std::uint32_t most_symbols = 64;
  std::array<std::uint32_t, rans_scale> slots{};

  /// Gives `frequency` slots from `start` on to a symbol. @pre they are there; symbol < most_symbols
  void set(std::uint32_t symbol, std::uint32_t start, std::uint32_t frequency) noexcept {
    for (std::uint32_t i = 0; i != frequency; ++i) slots[start + i] = frequency << 18U | i << 6U | symbol;
  }
};

/// Where decoders get words from: two bytes each, little-endian. Behind the last word come zeros.
class rans_source {
 public:
  rans_source() = default;
  explicit rans_source(std::span<const std::byte> words) noexcept
      : at_{words.data()}, end_{words.data() + words.size() / 2 * 2} {}
  /// `state` with the next word, if it has become too low.
  [[nodiscard]] std::uint32_t fill(std::uint32_t state) noexcept {
    if (state >= rans_lowest) return state;
    if (at_ == end_) return state << 16U;
    const std::uint32_t word = std::to_integer<std::uint32_t>(at_[0]) | std::to_integer<std::uint32_t>(at_[1]) << 8U;
    at_ += 2;
    return state << 16U | word;
  }
  /// Whether all words have been read.
  [[nodiscard]] bool at_end() const noexcept { return at_ == end_; }

 private:
  const std::byte* at_ = nullptr;
  const std::byte* end_ = nullptr;
};

/// Reads the next symbol of what a `rans_encoder` wrote. It wrote all if its state is `rans_lowest` in the end.
[[nodiscard]] inline std::uint32_t rans_symbol_of(std::uint32_t& state, const rans_decoder_table& table,
                                                  rans_source& from) noexcept {
  const std::uint32_t slot = table.slots[state & (rans_scale - 1)];
  state = from.fill((slot >> 18U) * (state >> rans_scale_bits) + (slot >> 6U & (rans_scale - 1)));
  return slot & (rans_decoder_table::most_symbols - 1);
}
/// @pre bits <= 16
[[nodiscard]] inline std::uint32_t rans_bits_of(std::uint32_t& state, unsigned bits, rans_source& from) noexcept {
  const std::uint32_t value = state & ((1U << bits) - 1);
  state = from.fill(state >> bits);
  return value;
}

}  // namespace orbis::mapping::detail

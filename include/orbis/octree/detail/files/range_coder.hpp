// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Arithmetic coding of bits: a bit that was expected takes a fraction of a bit.
///
/// I. H. Witten, R. M. Neal, J. G. Cleary, "Arithmetic coding for data compression", Communications
/// of the ACM 30, 1987. The interval is kept in 32 bits, and bytes leave it as soon as both its ends
/// agree on them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace orbis::octree::detail {

/// The expectation that a bit is set, learnt from those seen: their mean at first, later the mean of
/// the last hundred or so.
class bit_expectation {
 public:
  /// In (0, 2^16).
  [[nodiscard]] std::uint32_t set() const noexcept { return state_ >> 16U; }
  void learn(bool bit) noexcept {
    // 24 bits of the expectation, 8 of how often it has learnt.
    const std::uint32_t seen = state_ & 0xffU;
    const auto mean = static_cast<std::int64_t>(state_ >> 8U);
    const std::int64_t wanted = bit ? (1 << 24U) - (1 << 13U) : 1 << 13U;
    const auto moved = static_cast<std::uint32_t>(mean + ((wanted - mean) * rate[seen] >> 16U));
    state_ = moved << 8U | (seen + 1 != rate.size() ? seen + 1 : seen);
  }

 private:
  static constexpr auto rate = [] {
    std::array<std::int32_t, 160> r{};
    for (std::size_t n = 0; n != r.size(); ++n)
      r[n] = static_cast<std::int32_t>(65536.0 / (static_cast<double>(n) + 1.6));
    return r;
  }();
  std::uint32_t state_ = 1U << 31U;
};

/// Writes bits. The decoder has the same members, so that one function can describe both directions.
class range_encoder {
 public:
  static constexpr bool decodes = false;

  /// Writes `bit`, whose chance to be set is `set` / 2^16, and returns it.
  bool code(bool bit, std::uint32_t set) {
    const std::uint32_t middle = low_ + static_cast<std::uint32_t>(std::uint64_t{high_ - low_} * set >> 16U);
    (bit ? high_ : low_) = bit ? middle : middle + 1;
    while (((low_ ^ high_) >> 24U) == 0) {
      bytes_ += static_cast<char>(high_ >> 24U);
      low_ <<= 8U;
      high_ = high_ << 8U | 0xffU;
    }
    return bit;
  }
  /// All bytes; nothing may be coded afterwards.
  [[nodiscard]] std::string finish() {
    bytes_ += static_cast<char>((low_ >> 24U) + 1U);  // and zeros: within the interval, as its ends differ here
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
  std::uint32_t low_ = 0;
  std::uint32_t high_ = ~std::uint32_t{0};
};

/// Reads bits. Behind the last byte come zeros.
class range_decoder {
 public:
  static constexpr bool decodes = true;

  explicit range_decoder(std::span<const std::byte> bytes) noexcept : left_{bytes} {
    for (int i = 0; i != 4; ++i) code_ = code_ << 8U | next();
  }
  /// Reads a bit whose chance to be set is `set` / 2^16.
  bool code(bool /*unknown*/, std::uint32_t set) noexcept {
    const std::uint32_t middle = low_ + static_cast<std::uint32_t>(std::uint64_t{high_ - low_} * set >> 16U);
    const bool bit = code_ <= middle;
    (bit ? high_ : low_) = bit ? middle : middle + 1;
    while (((low_ ^ high_) >> 24U) == 0) {
      low_ <<= 8U;
      high_ = high_ << 8U | 0xffU;
      code_ = code_ << 8U | next();
    }
    return bit;
  }
  /// Whether all bytes have been looked at.
  [[nodiscard]] bool at_end() const noexcept { return left_.empty(); }

 private:
  [[nodiscard]] std::uint32_t next() noexcept {
    if (left_.empty()) return 0;
    const auto byte = std::to_integer<std::uint32_t>(left_.front());
    left_ = left_.subspan(1);
    return byte;
  }

  std::span<const std::byte> left_;
  std::uint32_t low_ = 0;
  std::uint32_t high_ = ~std::uint32_t{0};
  std::uint32_t code_ = 0;
};

}  // namespace orbis::octree::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The values of an octree's leaves, arithmetically coded as ranks in a list of those there are, the
/// most frequent first.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/octree/detail/files/range_coder.hpp>

namespace orbis::octree::detail {

/// Codes ranks of several kinds. A rank is the number of its bits, expected from the previous rank of
/// its kind, and those bits behind the first.
template <class Coder>
class rank_coder {
 public:
  explicit rank_coder(Coder& coder) : coder_{coder} {}

  /// Writes a rank of one of two kinds and returns it, or reads one, which may not be below `count`.
  /// @pre rank < count
  std::uint32_t code(unsigned kind, std::uint32_t rank, std::uint32_t count) {
    kind_model& m = kinds_[kind];
    const auto most = static_cast<unsigned>(std::bit_width(count - 1));
    const auto wanted = static_cast<unsigned>(std::bit_width(rank));
    unsigned bits = 0;
    while (bits != most && code_bit(m.more[m.before][bits], bits < wanted)) ++bits;
    m.before = bits;
    std::uint32_t value = bits == 0 ? 0 : 1;
    for (unsigned left = bits; left > 1; --left) {
      // The first few bits depend on those before them, the last ones hardly on anything.
      const std::size_t place = bits - left < 4 ? value : 16 + left;
      value = value << 1U | std::uint32_t{code_bit(m.rest[bits][place], (rank >> (left - 2) & 1U) != 0)};
    }
    return value;
  }

 private:
  struct kind_model {
    unsigned before = 0;
    std::array<std::array<bit_expectation, 33>, 33> more{};
    std::array<std::array<bit_expectation, 48>, 33> rest{};
  };
  bool code_bit(bit_expectation& e, bool bit) {
    bit = coder_.code(bit, e.set());
    e.learn(bit);
    return bit;
  }

  Coder& coder_;
  std::array<kind_model, 2> kinds_{};
};

}  // namespace orbis::octree::detail

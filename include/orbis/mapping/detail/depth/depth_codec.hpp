// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images of 16 bits, compressed without loss.
///
/// A depth camera that measures disparity has few distinct depths: some hundreds in an image, centimetres apart where
/// they are far. So pixels are coded by their *rank* among the distinct depths of their image, which makes equal steps
/// of the sensor out of steps that grow with the square of the depth. A rank is predicted from its neighbours, and the
/// difference is coded with frequencies that depend on how much the neighbours differ.
///
/// Prediction and contexts: M. J. Weinberger, G. Seroussi, G. Sapiro, "The LOCO-I lossless image compression algorithm:
/// principles and standardization into JPEG-LS", IEEE Transactions on Image Processing 9(8), 2000, sections III.A and
/// III.B; but frequencies are counted first and coded (rANS), and a pixel without measurement (0) is a symbol of its
/// own, which predicts nothing.
///
/// The image is cut into bands of rows that are coded apart, but take turns pixel by pixel in one stream of words, so
/// that the decoder has a band in each lane of a vector.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/mapping/detail/depth/rans.hpp>

namespace orbis::mapping::detail {

/// Residuals as symbols: 0 is a pixel without depth, then come the residuals 0, -1, 1, -2, ..., later ones by their
/// highest two bits, with the rest behind as it is.
struct depth_symbol {
  static constexpr std::uint32_t no_depth = 0;
  static constexpr std::uint32_t direct = 24;                ///< so many residuals have a symbol of their own
  static constexpr std::size_t count = 1 + direct + 2 * 13;  ///< residuals have 17 bits, the sign among them

  std::uint32_t symbol;
  std::uint32_t rest;

  [[nodiscard]] static depth_symbol of(std::int32_t residual) noexcept {
    const std::uint32_t folded =
        residual < 0 ? ~(static_cast<std::uint32_t>(residual) << 1U) : static_cast<std::uint32_t>(residual) << 1U;
    if (folded < direct) return {1 + folded, 0};
    const auto below = static_cast<unsigned>(std::bit_width(folded)) - 2;  // at least 3
    return {1 + direct + 2 * (below - 3) + (folded >> below & 1U), folded & ((1U << below) - 1)};
  }
  /// How many bits stand behind the symbol; at most 15.
  [[nodiscard]] static unsigned rest_bits(std::uint32_t symbol) noexcept {
    return symbol <= direct ? 0U : 3U + (symbol - direct - 1) / 2;
  }
  /// The residual of a symbol but `no_depth`.
  [[nodiscard]] static std::uint32_t residual(std::uint32_t symbol, std::uint32_t rest) noexcept {
    std::uint32_t folded = symbol - 1;
    if (symbol > direct) folded = (2U + ((symbol - direct - 1) & 1U)) << rest_bits(symbol) | rest;
    return folded >> 1U ^ (0U - (folded & 1U));  // modulo 2^32
  }
};

/// What the pixels before a pixel say about it. Ranks; 0: no depth.
struct depth_neighbors {
  std::uint32_t west = 0, north = 0, north_west = 0, north_east = 0;
  std::uint32_t last = 0;  ///< the last pixel with a depth, in the order of rows

  static constexpr std::size_t levels = 12;
  /// From where on the differences of the neighbours, added up, count as one level more.
  static constexpr std::array<std::int32_t, levels - 1> first_steps{1, 2, 3, 4, 6, 9, 14, 21, 33, 61, 151};
  static constexpr std::size_t contexts = levels + 15;

  struct prediction {
    std::uint32_t context, rank;
  };
  [[nodiscard]] prediction predict() const noexcept {
    if (west != 0 && north != 0 && north_west != 0 && north_east != 0) {
      const auto w = static_cast<std::int32_t>(west), n = static_cast<std::int32_t>(north);
      const auto nw = static_cast<std::int32_t>(north_west), ne = static_cast<std::int32_t>(north_east);
      const auto steps = static_cast<std::uint32_t>(std::abs(w - nw) + std::abs(n - nw) + std::abs(n - ne));
      // Values, not std::clamp's references, so that no branch is made of them: it would be a random one.
      const std::int32_t low = w < n ? w : n, high = w < n ? n : w, plane = w + n - nw;
      const std::int32_t above = plane < low ? low : plane;
      const std::uint32_t most = level_of.size() - 1;
      return {level_of[steps < most ? steps : most], static_cast<std::uint32_t>(above < high ? above : high)};
    }
    const std::uint32_t known =
        (west != 0 ? 1U : 0U) | (north != 0 ? 2U : 0U) | (north_west != 0 ? 4U : 0U) | (north_east != 0 ? 8U : 0U);
    const std::uint32_t rank = west != 0         ? west
                               : north != 0      ? north
                               : north_west != 0 ? north_west
                               : north_east != 0 ? north_east
                                                 : last;
    return {static_cast<std::uint32_t>(levels) + known, rank};
  }
  /// Goes on to the next pixel of the row: this one was `rank`, and `next` is at the north-east of the next one.
  void advance(std::uint32_t rank, std::uint32_t next) noexcept {
    north_west = std::exchange(north, std::exchange(north_east, next));
    west = rank;
    if (rank != 0) last = rank;
  }
  /// Goes on to the first pixel of a row; `north_row` has the ranks of the row before.
  void begin_row(const std::uint16_t* north_row, int width) noexcept {
    west = north_west = 0;
    north = north_row[0];
    north_east = width > 1 ? north_row[1] : 0U;
  }

 private:
  static constexpr auto level_of = [] {
    std::array<std::uint8_t, first_steps.back() + 1> of{};
    for (const std::int32_t first : first_steps)
      for (auto steps = static_cast<std::size_t>(first); steps != of.size(); ++steps) ++of[steps];
    return of;
  }();
};

/// The bands of an image: equally many rows each, but for the last one, which has the rest as well.
struct depth_bands {
  static constexpr int count = 16;
  int rows_each, rows_last;
  explicit depth_bands(int height) noexcept : rows_each{height / count}, rows_last{height - (count - 1) * rows_each} {}
  [[nodiscard]] int first_row(int band) const noexcept { return band * rows_each; }
  [[nodiscard]] int rows(int band) const noexcept { return band + 1 == count ? rows_last : rows_each; }
};

inline void append_varint(std::vector<std::byte>& to, std::uint32_t value) {
  for (; value >= 128; value >>= 7U) to.push_back(static_cast<std::byte>(value | 128U));
  to.push_back(static_cast<std::byte>(value));
}
/// Takes a number off the front of `from`; false where there is none.
[[nodiscard]] inline bool take_varint(std::span<const std::byte>& from, std::uint32_t& value) noexcept {
  value = 0;
  for (unsigned shift = 0; shift < 32 && !from.empty(); shift += 7) {
    const auto byte = std::to_integer<std::uint32_t>(from.front());
    from = from.subspan(1);
    value |= (byte & 127U) << shift;
    if (byte < 128) return true;
  }
  return false;
}

/// How the pixels of a compressed image are written: its first byte.
enum class depth_coding : std::uint8_t {
  plain,   ///< two bytes each, little-endian: what cannot be made smaller
  values,  ///< predicted and coded
  ranks    ///< the same, as ranks in the list of distinct depths that stands before
};

/// Compresses depth images. Keeps its buffers, about 10 bytes a pixel, from one image to the next.
class depth_encoder {
 public:
  /// The compressed image, until the next call; at most 1 byte longer than the pixels. Linear.
  [[nodiscard]] std::span<const std::byte> encode(image_view<const std::uint16_t> depth) {
    const auto pixels = static_cast<std::size_t>(depth.width()) * static_cast<std::size_t>(depth.height());
    out_.clear();
    list_depths(depth);
    if (pixels != 0) code(depth, pixels);
    if (pixels == 0 || out_.size() > 1 + 2 * pixels) write_plain(depth);
    return out_;
  }

  /// On the heap.
  [[nodiscard]] std::size_t bytes() const noexcept {
    return out_.capacity() + seen_.capacity() + coded_.capacity() * sizeof(coded) +
           (rank_of_.capacity() + rows_.capacity() + words_.capacity()) * sizeof(std::uint16_t);
  }

 private:
  using neighbors = depth_neighbors;

  /// Fills `rank_of_`, and begins the output with what the decoder needs to know of it.
  void list_depths(image_view<const std::uint16_t> depth) {
    constexpr std::size_t values = std::size_t{1} << 16U;
    seen_.assign(values, 0);
    for (int y = 0; y != depth.height(); ++y)
      for (const std::uint16_t v : depth.row(y)) seen_[v] = 1;
    seen_[0] = 0;
    std::size_t distinct = 0, first = 0, last = 0;
    for (std::size_t v = 1; v != values; ++v) {
      if (seen_[v] == 0) continue;
      if (distinct++ == 0) first = v;
      last = v;
    }
    rank_of_.resize(values);
    if (4 * distinct > last - first) {  // the list would cost more than it is good for
      out_.push_back(static_cast<std::byte>(depth_coding::values));
      for (std::size_t v = 0; v != values; ++v) rank_of_[v] = static_cast<std::uint16_t>(v);
      return;
    }
    out_.push_back(static_cast<std::byte>(depth_coding::ranks));
    append_varint(out_, static_cast<std::uint32_t>(distinct));
    std::size_t before = 0, rank = 0;
    for (std::size_t v = 1; v != values; ++v) {
      if (seen_[v] == 0) continue;
      append_varint(out_, static_cast<std::uint32_t>(v - std::exchange(before, v)));
      rank_of_[v] = static_cast<std::uint16_t>(++rank);
    }
    rank_of_[0] = 0;
  }

  void code(image_view<const std::uint16_t> depth, std::size_t pixels) {
    const int width = depth.width();
    const auto columns = static_cast<std::size_t>(width);
    coded_.resize(pixels);
    rows_.assign(2 * columns, 0);
    counts_ = {};
    const depth_bands bands{depth.height()};
    coded* to = coded_.data();
    for (int band = 0; band != depth_bands::count; ++band) {
      std::uint16_t *above = rows_.data(), *here = rows_.data() + columns;
      std::fill_n(above, columns, std::uint16_t{0});
      neighbors near{};
      for (int y = bands.first_row(band), end = y + bands.rows(band); y != end; ++y, std::swap(above, here)) {
        near.begin_row(above, width);
        const std::uint16_t* from = depth.row(y).data();
        for (int x = 0; x != width; ++x) {
          const std::uint32_t rank = rank_of_[from[x]];
          const neighbors::prediction expected = near.predict();
          const depth_symbol s = rank == 0 ? depth_symbol{depth_symbol::no_depth, 0}
                                           : depth_symbol::of(static_cast<std::int32_t>(rank - expected.rank));
          ++counts_[expected.context][s.symbol];
          *to++ = {static_cast<std::uint8_t>(expected.context), static_cast<std::uint8_t>(s.symbol),
                   static_cast<std::uint16_t>(s.rest)};
          here[x] = static_cast<std::uint16_t>(rank);
          near.advance(rank, x + 2 < width ? above[x + 2] : 0U);
        }
      }
    }
    write_tables();
    write_bands(bands, columns);
  }

  void write_tables() {
    for (std::size_t context = 0; context != neighbors::contexts; ++context) {
      auto& counts = counts_[context];
      normalize_counts(counts);
      std::size_t used = counts.size();
      while (used != 0 && counts[used - 1] == 0) --used;
      append_varint(out_, static_cast<std::uint32_t>(used));
      std::uint16_t start = 0;
      for (std::size_t s = 0; s != used; ++s) {
        append_varint(out_, counts[s]);
        if (counts[s] == 0) continue;
        symbols_[context][s] = rans_encoder_symbol{{static_cast<std::uint16_t>(counts[s]), start}};
        start = static_cast<std::uint16_t>(start + counts[s]);
      }
    }
  }

  /// Pixel by pixel, in each of them band by band, in the reverse order: what comes last is the rest of the last band.
  void write_bands(const depth_bands& bands, std::size_t columns) {
    words_.resize(2 * coded_.size());  // a symbol and its rest take at most a word each
    std::uint16_t* const stop = words_.data() + words_.size();
    rans_sink sink{stop};
    std::array<rans_encoder, depth_bands::count> encoders;
    const auto put_rest = [&](rans_encoder& encoder, const coded& c) {
      if (const unsigned bits = depth_symbol::rest_bits(c.symbol); bits != 0) encoder.put_bits(c.rest, bits, sink);
    };
    const auto put_symbol = [&](rans_encoder& encoder, const coded& c) {
      encoder.put(symbols_[c.context][c.symbol], sink);
    };
    const std::size_t shared = columns * static_cast<std::size_t>(bands.rows_each);  // pixels that every band has
    for (std::size_t i = coded_.size(); i-- != shared * depth_bands::count;) {
      put_rest(encoders.back(), coded_[i]);
      put_symbol(encoders.back(), coded_[i]);
    }
    for (std::size_t i = shared; i-- != 0;) {
      for (std::size_t b = encoders.size(); b-- != 0;) put_rest(encoders[b], coded_[b * shared + i]);
      for (std::size_t b = encoders.size(); b-- != 0;) put_symbol(encoders[b], coded_[b * shared + i]);
    }
    const std::span<const std::uint16_t> words{sink.words(), stop};
    append_varint(out_, static_cast<std::uint32_t>(words.size()));
    for (const rans_encoder& e : encoders) append_varint(out_, e.state());
    append_words(words);
  }

  void write_plain(image_view<const std::uint16_t> depth) {
    out_.assign(1, static_cast<std::byte>(depth_coding::plain));
    for (int y = 0; y != depth.height(); ++y) append_words(depth.row(y));
  }
  void append_words(std::span<const std::uint16_t> words) {
    const std::size_t at = out_.size();
    out_.resize(at + 2 * words.size());
    std::byte* to = out_.data() + at;
    if constexpr (std::endian::native == std::endian::little) {
      if (!words.empty()) std::memcpy(to, words.data(), words.size_bytes());
    } else {
      for (const std::uint16_t w : words) {
        *to++ = static_cast<std::byte>(w);
        *to++ = static_cast<std::byte>(w >> 8U);
      }
    }
  }

  struct coded {
    std::uint8_t context, symbol;
    std::uint16_t rest;
  };
  std::vector<std::byte> out_;
  std::vector<std::uint8_t> seen_;
  std::vector<std::uint16_t> rank_of_;
  std::vector<std::uint16_t> rows_;  // ranks of this row and the one above
  std::vector<coded> coded_;
  std::vector<std::uint16_t> words_;
  std::array<std::array<std::uint32_t, depth_symbol::count>, neighbors::contexts> counts_{};
  std::array<std::array<rans_encoder_symbol, depth_symbol::count>, neighbors::contexts> symbols_{};
};

/// What the decoder of the rows that all bands have goes on with, from row to row.
struct depth_row_reader {
  static constexpr std::size_t lanes = depth_bands::count;
  const std::uint32_t* slots = nullptr;  ///< of the contexts' tables, one after the other
  int width = 0;
  /// Of each column a rank for each band: of the row above, then of this one. Two columns more, with zeros.
  std::vector<std::int32_t> ranks{};
  alignas(64) std::array<std::int32_t, lanes> last{};  ///< depth_neighbors::last
  alignas(64) std::array<std::uint32_t, lanes> states{};
  rans_source words{};
};

/// Decodes a row of every band: `depth_neighbors` and `rans_symbol_of` for all of them at once.
struct read_depth_ranks {
  using signature = void(depth_row_reader&);
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(depth_row_reader& row) {
    constexpr std::size_t lanes = depth_row_reader::lanes;
    using ints = simd::vec<std::int32_t, lanes, Target>;
    using words = simd::vec<std::uint32_t, lanes, Target>;
    const ints none = 0;
    const auto load = [&](int x) ORBIS_INLINE_LAMBDA {
      return ints::load(row.ranks.data() + static_cast<std::size_t>(x) * lanes);
    };
    const auto distance = [](const ints& a, const ints& b) ORBIS_INLINE_LAMBDA { return max(a - b, b - a); };
    ints west = 0, north_west = 0, north = load(0), north_east = load(1), last = ints::load(row.last.data());
    words state = words::load(row.states.data());
    for (int x = 0; x != row.width; ++x) {
      // What is expected: see depth_neighbors::predict.
      const ints steps = distance(west, north_west) + distance(north, north_west) + distance(north, north_east);
      ints context = 0;
      for (const std::int32_t first : depth_neighbors::first_steps)
        context = context + select(steps >= ints(first), ints(1), none);
      ints rank = min(max(west + north - north_west, min(west, north)), max(west, north));
      const auto inside = (min(min(west, north), min(north_west, north_east)) > none);
      if (!all(inside)) {
        const auto bit = [&](const ints& neighbor, std::int32_t value)
                             ORBIS_INLINE_LAMBDA { return select(neighbor > none, ints(value), none); };
        const ints known = bit(west, 1) | bit(north, 2) | bit(north_west, 4) | bit(north_east, 8);
        const auto first_of = [&](const ints& a, const ints& b) ORBIS_INLINE_LAMBDA { return select(a > none, a, b); };
        context = select(inside, context, ints(depth_neighbors::levels) + known);
        rank = select(inside, rank, first_of(west, first_of(north, first_of(north_west, first_of(north_east, last)))));
      }
      const words slot = simd::gather(row.slots, (context << static_cast<int>(rans_scale_bits)) |
                                                     (simd::bits_as<std::int32_t>(state) & ints(rans_scale - 1)));
      state = (slot >> 18) * (state >> static_cast<int>(rans_scale_bits)) + ((slot >> 6) & words(rans_scale - 1));
      const ints symbol = simd::bits_as<std::int32_t>(slot) & ints(rans_decoder_table::most_symbols - 1);
      const ints folded = symbol - ints(1);
      const ints residual =
          simd::bits_as<std::int32_t>(simd::bits_as<std::uint32_t>(folded) >> 1) ^ (none - (folded & ints(1)));
      ints found = select(symbol > none, (rank + residual) & ints(0xffff), none);
      // Some bands have a word to take now and then, and some symbols have bits behind them.
      const auto is_low = simd::bits_as<std::int32_t>(state >> 16) == none;
      const auto is_long = symbol > ints(static_cast<std::int32_t>(depth_symbol::direct));
      if (any(is_low | is_long)) {
        alignas(64) std::uint32_t states[lanes];
        state.store(states);
        for (std::uint32_t left = bits(is_low); left != 0; left &= left - 1) {
          const auto b = static_cast<std::size_t>(std::countr_zero(left));
          states[b] = row.words.fill(states[b]);
        }
        if (any(is_long)) {
          alignas(64) std::int32_t expected[lanes], symbols[lanes], ranks[lanes];
          rank.store(expected);
          symbol.store(symbols);
          found.store(ranks);
          for (std::uint32_t left = bits(is_long); left != 0; left &= left - 1) {
            const auto b = static_cast<std::size_t>(std::countr_zero(left));
            const auto s = static_cast<std::uint32_t>(symbols[b]);
            const std::uint32_t rest = rans_bits_of(states[b], depth_symbol::rest_bits(s), row.words);
            ranks[b] = static_cast<std::int32_t>(
                (static_cast<std::uint32_t>(expected[b]) + depth_symbol::residual(s, rest)) & 0xffffU);
          }
          found = ints::load(ranks);
        }
        state = words::load(states);
      }
      found.store(row.ranks.data() + static_cast<std::size_t>(x) * lanes);
      last = select(found > none, found, last);
      north_west = north;
      north = north_east;
      north_east = load(x + 2);
      west = found;
    }
    last.store(row.last.data());
    state.store(row.states.data());
  }
};

/// Reads compressed depth images. Keeps its buffers, about 450 kB, and 64 bytes a column.
class depth_decoder {
 public:
  /// Puts the image into `out`, which has its size. Errors: malformed, with nothing said of what `out` holds then; any
  /// bytes are safe to give. Linear.
  [[nodiscard]] result<void> decode(std::span<const std::byte> bytes, image_view<std::uint16_t> out) {
    if (bytes.empty()) return damaged("it is empty");
    const auto coding = std::to_integer<std::uint8_t>(bytes.front());
    bytes = bytes.subspan(1);
    switch (static_cast<depth_coding>(coding)) {
      case depth_coding::plain: return read_plain(bytes, out);
      case depth_coding::values: depths_.clear(); break;
      case depth_coding::ranks:
        if (!read_depths(bytes)) return damaged("its list of depths is wrong");
        break;
      default: return damaged("its coding is unknown");
    }
    if (!read_tables(bytes)) return damaged("its frequencies are wrong");
    if (!open_words(bytes)) return damaged("its length is wrong");
    if (!read_ranks(out)) return damaged("its pixels do not end where they should");
    if (static_cast<depth_coding>(coding) == depth_coding::ranks && !to_depths(out))
      return damaged("a pixel's depth is not in the list of depths");
    return {};
  }

 private:
  using neighbors = depth_neighbors;
  using table = rans_decoder_table;

  [[nodiscard]] static tl::unexpected<error> damaged(const char* what) {
    return fail(errc::malformed, "compressed depth image", what);
  }

  [[nodiscard]] static result<void> read_plain(std::span<const std::byte> bytes, image_view<std::uint16_t> out) {
    const auto columns = static_cast<std::size_t>(out.width());
    if (bytes.size() != 2 * columns * static_cast<std::size_t>(out.height())) return damaged("its length is wrong");
    for (int y = 0; y != out.height(); ++y)
      for (std::uint16_t& v : out.row(y)) {
        v = static_cast<std::uint16_t>(std::to_integer<unsigned>(bytes[0]) | std::to_integer<unsigned>(bytes[1]) << 8U);
        bytes = bytes.subspan(2);
      }
    return {};
  }

  [[nodiscard]] bool read_depths(std::span<const std::byte>& from) {
    std::uint32_t count = 0;
    if (!take_varint(from, count) || count > std::numeric_limits<std::uint16_t>::max()) return false;
    depths_.assign(1, 0);
    std::uint32_t depth = 0;
    for (std::uint32_t i = 0; i != count; ++i) {
      std::uint32_t step = 0;
      if (!take_varint(from, step) || step == 0 || step > std::numeric_limits<std::uint16_t>::max() - depth)
        return false;
      depths_.push_back(static_cast<std::uint16_t>(depth += step));
    }
    return true;
  }

  /// Frequencies, each table's adding up to the scale, or none: then its one symbol is "no depth".
  [[nodiscard]] bool read_tables(std::span<const std::byte>& from) {
    tables_.resize(neighbors::contexts);
    for (table& t : tables_) {
      std::uint32_t used = 0, start = 0;
      if (!take_varint(from, used) || used > depth_symbol::count) return false;
      for (std::uint32_t s = 0; s != used; ++s) {
        std::uint32_t frequency = 0;
        if (!take_varint(from, frequency) || frequency > rans_scale - start) return false;
        t.set(s, start, frequency);
        start += frequency;
      }
      if (used == 0) {
        t.set(depth_symbol::no_depth, 0, rans_scale);
      } else if (start != rans_scale) {
        return false;
      }
    }
    return true;
  }

  [[nodiscard]] bool open_words(std::span<const std::byte> from) {
    std::uint32_t words = 0;
    if (!take_varint(from, words)) return false;
    for (std::uint32_t& s : row_.states)
      if (!take_varint(from, s) || s < rans_lowest) return false;
    if (from.size() != 2 * std::size_t{words}) return false;
    row_.words = rans_source{from};
    return true;
  }

  [[nodiscard]] bool read_ranks(image_view<std::uint16_t> out) {
    if (out.empty()) return false;  // an image without pixels is written plain
    constexpr std::size_t lanes = depth_row_reader::lanes;
    const depth_bands bands{out.height()};
    const auto width = static_cast<std::size_t>(out.width());
    row_.slots = tables_.front().slots.data();
    row_.width = out.width();
    row_.last.fill(0);
    row_.ranks.assign((width + 2) * lanes, 0);
    const auto read_row = simd::kernel<read_depth_ranks, read_depth_ranks::signature>();
    for (int y = 0; y != bands.rows_each; ++y) {
      read_row(row_);
      std::array<std::uint16_t*, lanes> to{};
      for (std::size_t b = 0; b != lanes; ++b) to[b] = out.row(bands.first_row(static_cast<int>(b)) + y).data();
      for (std::size_t x = 0; x != width; ++x)
        for (std::size_t b = 0; b != lanes; ++b) to[b][x] = static_cast<std::uint16_t>(row_.ranks[x * lanes + b]);
    }
    read_rest(bands, out);
    return row_.words.at_end() &&
           std::ranges::all_of(row_.states, [](std::uint32_t state) { return state == rans_lowest; });
  }
  /// The rows that only the last band has.
  void read_rest(const depth_bands& bands, image_view<std::uint16_t> out) {
    const std::vector<std::uint16_t> no_row(static_cast<std::size_t>(out.width()), 0);
    std::uint32_t& state = row_.states.back();
    neighbors near{};
    near.last = static_cast<std::uint32_t>(row_.last.back());
    const int first = bands.first_row(depth_bands::count - 1);
    for (int y = first + bands.rows_each; y < out.height(); ++y) {
      const std::uint16_t* const above = y == first ? no_row.data() : out.row(y - 1).data();
      std::uint16_t* const here = out.row(y).data();
      near.begin_row(above, out.width());
      for (int x = 0; x != out.width(); ++x) {
        const neighbors::prediction expected = near.predict();
        const std::uint32_t symbol = rans_symbol_of(state, tables_[expected.context], row_.words);
        std::uint32_t rank = 0;
        if (symbol != depth_symbol::no_depth) {
          const unsigned bits = depth_symbol::rest_bits(symbol);
          const std::uint32_t rest = bits == 0 ? 0 : rans_bits_of(state, bits, row_.words);
          rank = (expected.rank + depth_symbol::residual(symbol, rest)) & 0xffffU;
        }
        here[x] = static_cast<std::uint16_t>(rank);
        near.advance(rank, x + 2 < out.width() ? above[x + 2] : 0U);
      }
    }
  }

  [[nodiscard]] bool to_depths(image_view<std::uint16_t> ranks) const {
    std::uint16_t highest = 0;
    for (int y = 0; y != ranks.height(); ++y)
      for (const std::uint16_t r : ranks.row(y)) highest = std::max(highest, r);
    if (highest >= depths_.size()) return false;
    for (int y = 0; y != ranks.height(); ++y)
      for (std::uint16_t& r : ranks.row(y)) r = depths_[r];
    return true;
  }

  std::vector<std::uint16_t> depths_;  // by rank
  std::vector<table> tables_;
  depth_row_reader row_;
};

}  // namespace orbis::mapping::detail

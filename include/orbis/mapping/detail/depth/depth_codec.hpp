// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Lossless compression of 16-bit depth images.
///
/// A. D. Wilson, "Fast lossless depth image compression", ISS 2017 (RVL): run lengths and, between the runs,
/// zigzag-encoded differences, written in groups of bits, each with a bit that indicates whether another group follows.
/// In RVL, runs consist of pixels without depth, and a pixel is predicted by the previous one. In this codec,
///
/// - a pixel is coded by its *rank* among the distinct depths of the image. A depth camera that measures disparity has
///   only a few hundred of them, centimetres apart at long range; in ranks, all steps of the sensor are equal.
/// - the prediction of a pixel uses the adjacent pixels to the west, north and north-west, as in M. J. Weinberger, G.
///   Seroussi, G. Sapiro, "The LOCO-I lossless image compression algorithm", IEEE Transactions on Image Processing
///   9(8), 2000, section III.A.
/// - a run consists of pixels, with depth or without (0), that equal their prediction.
/// - a difference is relative to the prediction or, if that is 0, to the last nonzero rank that was coded in the row.
///   The difference 0 to a prediction with depth means a pixel without depth.
/// - a group has one data bit in a run length and two in a difference, because most of these numbers are small.
///
/// A row depends on the row above only through ranks, so the decoder computes the ranks of eight rows at the same time,
/// each two pixels behind the row above it.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/mask.hpp>
#include <orbis/core/simd/shuffle.hpp>
#include <orbis/core/simd/vec.hpp>

namespace orbis::mapping::detail {

/// Coding of the pixels, stored in the first byte of a compressed image.
enum class depth_coding : std::uint8_t {
  plain,  ///< two bytes per pixel, little-endian: for images that do not compress
  runs    ///< the number of distinct depths, the steps between them, then alternating runs and differences
};

/// Zigzag encoding: maps the signed numbers 0, -1, 1, -2 ... to 0, 1, 2, 3 ...
[[nodiscard]] inline std::uint32_t folded(std::int32_t value) noexcept {
  return static_cast<std::uint32_t>(value) << 1U ^ (value < 0 ? ~0U : 0U);
}
[[nodiscard]] inline std::uint32_t unfolded(std::uint32_t value) noexcept {  // modulo 2^32
  return value >> 1U ^ (0U - (value & 1U));
}

/// Writes numbers in groups of bits, the lowest first, each preceded by a bit that indicates whether another group
/// follows.
class group_writer {
 public:
  explicit group_writer(std::span<std::byte> to) noexcept : at_{to.data()}, end_{to.data() + to.size()} {}
  template <unsigned Bits>
  void put(std::uint32_t value) noexcept {
    do {
      const std::uint32_t group = value & ((1U << Bits) - 1);
      value >>= Bits;
      bits_ = bits_ << (Bits + 1) | group | (value != 0 ? 1U << Bits : 0U);
      used_ += Bits + 1;
      if (used_ >= 32) put_word();
    } while (value != 0);
  }
  /// Returns true if the buffer was too small; in that case the output is incomplete.
  [[nodiscard]] bool is_full() const noexcept { return full_; }
  /// Writes the remaining bits. Returns the end of the written bytes.
  [[nodiscard]] std::byte* finish() noexcept {
    const std::ptrdiff_t bytes = (used_ + 7) / 8;
    bits_ <<= 32U - used_;
    used_ = 32;
    put_word();
    return full_ ? at_ : at_ - (4 - bytes);
  }

 private:
  void put_word() noexcept {
    used_ -= 32;
    full_ = full_ || end_ - at_ < 4;
    if (full_) return;
    for (const unsigned shift : {24U, 16U, 8U, 0U}) *at_++ = static_cast<std::byte>(bits_ >> (used_ + shift));
  }
  std::byte *at_, *end_;
  std::uint64_t bits_ = 0;
  unsigned used_ = 0;
  bool full_ = false;
};

inline constexpr unsigned run_bits = 1, step_bits = 2;

/// A difference and the run that follows it, with the number of bits of both.
struct step_and_run {
  std::uint8_t step = 0, run = 0, bits = 0;
};
inline constexpr unsigned listed_bits = 10;
/// The difference and the run at the beginning of each sequence of `listed_bits` bits; `bits` is 0 if they are longer.
inline constexpr auto steps_and_runs = [] {
  std::array<step_and_run, std::size_t{1} << listed_bits> out{};
  for (unsigned sequence = 0; sequence != out.size(); ++sequence) {
    unsigned left = listed_bits;
    const auto get = [&](unsigned data_bits) -> std::optional<std::uint8_t> {
      unsigned value = 0;
      for (unsigned shift = 0; left > data_bits; shift += data_bits) {
        left -= data_bits + 1;
        const unsigned group = sequence >> left;
        value |= (group & ((1U << data_bits) - 1)) << shift;
        if ((group >> data_bits & 1U) == 0) return static_cast<std::uint8_t>(value);
      }
      return std::nullopt;
    };
    const auto step = get(step_bits);
    const auto run = step ? get(run_bits) : step;
    if (run) out[sequence] = {*step, *run, static_cast<std::uint8_t>(listed_bits - left)};
  }
  return out;
}();

/// Reads numbers written by a `group_writer`.
class group_reader {
 public:
  explicit group_reader(std::span<const std::byte> from) noexcept : from_{from} {}
  /// Returns the next difference and the run that follows it.
  [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> get_step_and_run() noexcept {
    if (left_ < listed_bits) fill();
    const step_and_run listed = steps_and_runs[bits_ >> (64U - listed_bits)];
    if (listed.bits == 0) {
      const std::uint32_t step = get<step_bits>();
      return {step, get<run_bits>()};
    }
    bits_ <<= listed.bits;
    left_ -= listed.bits;
    return {listed.step, listed.run};
  }
  /// Returns the next number; bits after the end of the data are 0.
  template <unsigned Bits>
  [[nodiscard]] std::uint32_t get() noexcept {
    std::uint32_t value = 0, group = 0;
    unsigned shift = 0;
    do {
      if (left_ <= Bits) fill();
      group = static_cast<std::uint32_t>(bits_ >> (63U - Bits));
      bits_ <<= Bits + 1;
      left_ -= Bits + 1;
      value |= (group & ((1U << Bits) - 1)) << shift;
      shift += Bits;
    } while (group >> Bits != 0 && shift != 32);
    return value;
  }
  /// Returns true if the last number ended in the last byte.
  [[nodiscard]] bool is_at_end() const noexcept { return (8 * at_ - left_ + 7) / 8 == from_.size(); }

 private:
  void fill() noexcept {
    std::uint32_t word = 0;
    if (at_ + 4 <= from_.size())
      word = load_number<std::uint32_t>(reinterpret_cast<const char*>(from_.data() + at_), std::endian::big);
    else
      for (std::size_t i = at_; i != at_ + 4; ++i)
        word = word << 8U | (i < from_.size() ? std::to_integer<std::uint32_t>(from_[i]) : 0U);
    at_ += 4;
    bits_ |= std::uint64_t{word} << (32U - left_);
    left_ += 32;
  }
  std::span<const std::byte> from_;
  std::size_t at_ = 0;
  std::uint64_t bits_ = 0;
  unsigned left_ = 0;
};

/// Predicts the ranks of pixels from the ranks of their neighbours to the west, north and north-west. 0: no depth.
template <simd::vector V>
[[nodiscard]] ORBIS_ALWAYS_INLINE V expected_ranks(const V& west, const V& north, const V& north_west) noexcept {
  const V low = min(west, north), high = max(west, north), zero(0);
  const auto no_plane = (low == zero) | (north_west == zero);
  return select(no_plane, select(west == zero, north, west), max(low, min(high, west + north - north_west)));
}

/// Predicts the ranks of a row from its own ranks and those of the row above.
struct predict_row {
  /// Compares `width` ranks with their predictions. All arrays are filled up to a multiple of eight entries, and `here`
  /// and `above` are preceded by a zero. `expected`: the predictions; `wrong`: a byte for eight of them, bit i of which
  /// is set if the i-th is wrong; bits of pixels after the row are unspecified.
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::int32_t* here, const std::int32_t* above, std::size_t width,
                                      std::int32_t* expected, std::uint8_t* wrong) {
    using lanes = simd::vec<std::int32_t, 8, Target>;
    for (std::size_t x = 0; x < width; x += 8) {
      const lanes rank = lanes::load(here + x);
      const lanes guess = expected_ranks(lanes::load(here + x - 1), lanes::load(above + x), lanes::load(above + x - 1));
      guess.store(expected + x);
      wrong[x / 8] = static_cast<std::uint8_t>(simd::bits(rank != guess));
    }
  }
};

/// Compresses depth images. Reuses its buffers, which take about 2 bytes per pixel plus 150 kB.
template <class = void>
class basic_depth_encoder {
 public:
  /// Returns the compressed image, valid until the next call; at most 1 byte longer than the pixels. Linear.
  [[nodiscard]] std::span<const std::byte> encode(image_view<const std::uint16_t> depth) {
    const std::size_t plain =
        1 + 2 * static_cast<std::size_t>(depth.width()) * static_cast<std::size_t>(depth.height());
    if (out_.size() < plain + 4) out_.resize(plain + 4);
    const std::span<std::byte> out{out_};
    if (plain > 1)
      if (const std::size_t size = write_runs(depth, out.first(plain + 4)); size != 0 && size <= plain)
        return out.first(size);
    write_plain(depth);
    return out.first(plain);
  }

  /// Heap memory in bytes.
  [[nodiscard]] std::size_t bytes() const noexcept {
    return out_.capacity() + rank_of_.capacity() * sizeof(std::uint16_t) + wrong_.capacity() +
           (above_.capacity() + here_.capacity() + expected_.capacity()) * sizeof(std::int32_t);
  }

 private:
  /// Returns the number of bytes written, 0 if `out` is too small.
  [[nodiscard]] std::size_t write_runs(image_view<const std::uint16_t> depth, std::span<std::byte> out) {
    out[0] = static_cast<std::byte>(depth_coding::runs);
    group_writer to{out.subspan(1)};
    list_depths(depth, to);
    const auto width = static_cast<std::size_t>(depth.width());
    above_.assign(width + 9, 0);
    here_ = expected_ = above_;
    wrong_.assign((width + 7) / 8, 0);
    const auto predict = simd::kernel<predict_row, void(const std::int32_t*, const std::int32_t*, std::size_t,
                                                        std::int32_t*, std::uint8_t*)>();
    std::uint32_t run = 0;
    for (int y = 0; y != depth.height() && !to.is_full(); ++y, above_.swap(here_)) {
      std::transform(depth.row(y).begin(), depth.row(y).end(), here_.begin() + 1,
                     [&](std::uint16_t stored) { return std::int32_t{rank_of_[stored]}; });
      predict(here_.data() + 1, above_.data() + 1, width, expected_.data(), wrong_.data());
      std::int32_t last = 0;  // last nonzero rank written in this row
      std::size_t begin = 0;
      if (width % 8 != 0) wrong_.back() &= static_cast<std::uint8_t>((1U << width % 8) - 1);
      for (std::size_t x = 0; x < width; x += 8)
        for (std::uint32_t wrong = wrong_[x / 8]; wrong != 0; wrong &= wrong - 1) {
          const std::size_t at = x + static_cast<std::size_t>(std::countr_zero(wrong));
          to.put<run_bits>(run + static_cast<std::uint32_t>(at - begin));
          run = 0;
          begin = at + 1;
          const std::int32_t rank = here_[at + 1], expected = expected_[at];
          to.put<step_bits>(rank == 0 ? 0 : folded(rank - (expected != 0 ? expected : last)));
          if (rank != 0) last = rank;
        }
      run += static_cast<std::uint32_t>(width - begin);
    }
    to.put<run_bits>(run);
    const std::byte* const end = to.finish();
    return to.is_full() ? 0 : static_cast<std::size_t>(end - out.data());
  }

  /// Fills `rank_of_`, and writes the list of depths for the decoder.
  void list_depths(image_view<const std::uint16_t> depth, group_writer& to) {
    constexpr std::size_t values = std::size_t{1} << 16U;
    rank_of_.assign(values, 0);
    for (int y = 0; y != depth.height(); ++y)
      for (const std::uint16_t v : depth.row(y)) rank_of_[v] = 1;
    rank_of_[0] = 0;
    to.put<step_bits>(static_cast<std::uint32_t>(std::count(rank_of_.begin(), rank_of_.end(), 1)));
    std::uint16_t rank = 0;
    for (std::size_t v = 1, before = 0; v != values; ++v) {
      if (rank_of_[v] == 0) continue;
      rank_of_[v] = ++rank;
      to.put<step_bits>(static_cast<std::uint32_t>(v - std::exchange(before, v) - 1));
    }
  }

  void write_plain(image_view<const std::uint16_t> depth) {
    std::byte* to = out_.data();
    *to++ = static_cast<std::byte>(depth_coding::plain);
    for (int y = 0; y != depth.height(); ++y)
      for (const std::uint16_t v : depth.row(y)) {
        *to++ = static_cast<std::byte>(v);
        *to++ = static_cast<std::byte>(v >> 8U);
      }
  }

  std::vector<std::byte> out_;
  std::vector<std::uint16_t> rank_of_;
  std::vector<std::int32_t> above_, here_;  // ranks of two rows, after a zero
  std::vector<std::int32_t> expected_;      // predictions of the ranks of a row
  std::vector<std::uint8_t> wrong_;         // see predict_row
};
using depth_encoder = basic_depth_encoder<>;

/// Computes the ranks of eight rows. Entry 8 t + i of `entries` belongs to column t - 2 i of row i.
struct restore_ranks {
  static constexpr std::size_t rows = 8, lag = 2 * (rows - 1);

  /// Replaces differences by ranks in `8 (width + lag)` entries; a difference d is given as 2 d + 1, and 0 marks a
  /// pixel that equals its prediction. `above`: the ranks of the row above the first one, then `lag` zeros. Returns the
  /// largest rank; it is too large if a difference is invalid.
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE std::uint32_t run(const std::int32_t* above, std::size_t width, std::int32_t* entries) {
    constexpr std::size_t lanes_per_part = std::min(rows, Target::bytes / sizeof(std::int32_t));
    using lanes = simd::vec<std::int32_t, lanes_per_part, Target>;
    using numbers = simd::vec<std::uint32_t, lanes_per_part, Target>;
    struct part {
      lanes west{0}, north{0}, before{0}, last{0};  // `before`: the ranks two steps ago
    };
    std::array<part, rows / lanes_per_part> parts;
    numbers largest(0);
    for (std::size_t t = 0; t != width + lag; ++t) {
      lanes upper(above[t]);
      for (std::size_t p = 0; p != parts.size(); ++p) {
        part& rows_of = parts[p];
        std::int32_t* const entry = entries + rows * t + lanes_per_part * p;
        const lanes value = lanes::load(entry), zero(0);
        const lanes north = shifted_in(rows_of.before, upper, std::make_index_sequence<lanes_per_part - 1>{});
        const lanes expected = expected_ranks(rows_of.west, north, rows_of.north);
        const auto is_unknown = expected == zero, is_coded = value != zero;
        const auto is_hole = (value == lanes(1)) & !is_unknown;
        const lanes coded = select(is_hole, zero, select(is_unknown, rows_of.last, expected) + (value >> 1));
        const lanes rank = select(is_coded, coded, expected);
        rank.store(entry);
        const auto is_wrong = is_coded & (coded == zero) & !is_hole;  // the encoder writes no such difference
        largest = max(largest, simd::bits_as<std::uint32_t>(select(is_wrong, lanes(-1), rank)));
        rows_of.last = select(is_coded & (rank != zero), rank, rows_of.last);
        upper = rows_of.before;
        rows_of.before = rows_of.west;
        rows_of.west = rank;
        rows_of.north = north;
      }
    }
    std::array<std::uint32_t, lanes_per_part> each;
    largest.store(each.data());
    return *std::max_element(each.begin(), each.end());
  }

 private:
  /// The last lane of `upper`, then all lanes of `lower` but the last.
  template <class V, std::size_t... I>
  [[nodiscard]] static ORBIS_ALWAYS_INLINE V shifted_in(const V& lower, const V& upper, std::index_sequence<I...>) {
    return simd::shuffle<2 * V::count - 1, I...>(lower, upper);
  }
};

/// Decompresses depth images. Reuses its buffers: two bytes for each distinct depth, and 36 bytes per column.
template <class = void>
class basic_depth_decoder {
 public:
  /// Decompresses an image into `out`, which must have the size of the image. Error: malformed; the content of `out` is
  /// then unspecified. Safe for any input bytes. Linear.
  [[nodiscard]] result<void> decode(std::span<const std::byte> bytes, image_view<std::uint16_t> out) {
    if (bytes.empty()) return damaged("is empty");
    const auto coding = static_cast<depth_coding>(bytes.front());
    bytes = bytes.subspan(1);
    if (coding == depth_coding::plain) return read_plain(bytes, out);
    if (coding != depth_coding::runs) return damaged("has an unknown coding");
    if (out.empty()) return damaged("has the wrong length");  // an image without pixels is stored as `plain`
    group_reader from{bytes};
    if (!read_depths(from)) return damaged("has an invalid list of depths");
    return read_runs(from, out);
  }

 private:
  [[nodiscard]] static tl::unexpected<error> damaged(const char* what) {
    return fail(errc::malformed, "compressed depth image", what);
  }

  [[nodiscard]] static result<void> read_plain(std::span<const std::byte> bytes, image_view<std::uint16_t> out) {
    const auto columns = static_cast<std::size_t>(out.width());
    if (bytes.size() != 2 * columns * static_cast<std::size_t>(out.height())) return damaged("has the wrong length");
    for (int y = 0; y != out.height(); ++y)
      for (std::uint16_t& v : out.row(y)) {
        v = static_cast<std::uint16_t>(std::to_integer<unsigned>(bytes[0]) | std::to_integer<unsigned>(bytes[1]) << 8U);
        bytes = bytes.subspan(2);
      }
    return {};
  }

  [[nodiscard]] bool read_depths(group_reader& from) {
    constexpr std::uint32_t highest = std::numeric_limits<std::uint16_t>::max();
    const std::uint32_t count = from.get<step_bits>();
    if (count > highest) return false;
    depths_.assign(1, 0);
    std::uint32_t depth = 0;
    for (std::uint32_t i = 0; i != count; ++i) {
      const std::uint32_t between = from.get<step_bits>();
      if (between >= highest - depth) return false;
      depths_.push_back(static_cast<std::uint16_t>(depth += between + 1));
    }
    return true;
  }

  [[nodiscard]] result<void> read_runs(group_reader& from, image_view<std::uint16_t> out) {
    constexpr std::size_t rows = restore_ranks::rows;
    const auto restore = simd::kernel<restore_ranks, std::uint32_t(const std::int32_t*, std::size_t, std::int32_t*)>();
    const auto width = static_cast<std::size_t>(out.width());
    above_.assign(width + restore_ranks::lag, 0);
    std::uint32_t run = from.get<run_bits>();
    for (int y = 0; y < out.height(); y += static_cast<int>(rows)) {
      const std::size_t count = std::min(rows, static_cast<std::size_t>(out.height() - y));
      entries_.assign(rows * (width + restore_ranks::lag), 0);
      for (std::size_t i = 0; i != count; ++i) {
        std::int32_t* const row = entries_.data() + 2 * rows * i + i;
        std::size_t x = 0;
        for (; run < width - x; ++x) {
          x += run;
          const auto [step, next_run] = from.get_step_and_run();
          row[rows * x] = static_cast<std::int32_t>(2 * unfolded(step) + 1);
          run = next_run;
        }
        run -= static_cast<std::uint32_t>(width - x);
      }
      if (restore(above_.data(), width, entries_.data()) >= depths_.size())
        return damaged("a pixel refers to a depth that is not in the list");
      for (std::size_t i = 0; i != count; ++i) {
        const std::int32_t* const row = entries_.data() + 2 * rows * i + i;
        std::uint16_t* const to = out.row(y + static_cast<int>(i)).data();
        for (std::size_t x = 0; x != width; ++x) to[x] = depths_[static_cast<std::size_t>(row[rows * x])];
      }
      const std::int32_t* const last_row = entries_.data() + 2 * rows * (rows - 1) + rows - 1;
      for (std::size_t x = 0; x != width; ++x) above_[x] = last_row[rows * x];
    }
    if (run != 0 || !from.is_at_end()) return damaged("has too few or too many bytes for its pixels");
    return {};
  }

  std::vector<std::uint16_t> depths_;  // indexed by rank
  std::vector<std::int32_t> above_;    // ranks of a row
  std::vector<std::int32_t> entries_;  // see restore_ranks
};
using depth_decoder = basic_depth_decoder<>;

/// Encodes the zeros of an image: lengths of alternating runs of nonzero and zero pixels, row by row. O(pixels).
template <class = void>
[[nodiscard]] std::vector<std::byte> encode_zeros(image_view<const std::uint16_t> image) {
  std::vector<std::uint32_t> runs(1, 0);
  bool is_zero = false;
  for (int y = 0; y != image.height(); ++y)
    for (const std::uint16_t v : image.row(y)) {
      if ((v == 0) != is_zero) {
        runs.push_back(0);
        is_zero = !is_zero;
      }
      ++runs.back();
    }
  std::vector<std::byte> out(7 * runs.size() + 4);  // at most 48 bits each
  group_writer to{out};
  for (const std::uint32_t run : runs) to.put<step_bits>(run);
  out.resize(static_cast<std::size_t>(to.finish() - out.data()));
  out.shrink_to_fit();
  return out;
}
/// Sets to 0 the pixels that were 0 in the image from which `zeros` was encoded. O(pixels). @pre the images have the
/// same size
template <class = void>
void set_zeros(std::span<const std::byte> zeros, image_view<std::uint16_t> image) {
  if (zeros.empty()) return;
  group_reader from{zeros};
  std::uint32_t left = from.get<step_bits>();
  bool is_zero = false;
  for (int y = 0; y != image.height(); ++y)
    for (std::span<std::uint16_t> rest = image.row(y); !rest.empty();) {
      if (left == 0) {
        left = from.get<step_bits>();
        is_zero = !is_zero;
      }
      const std::size_t length = std::min<std::size_t>(left, rest.size());
      if (is_zero) std::fill_n(rest.begin(), length, std::uint16_t{0});
      rest = rest.subspan(length);
      left -= static_cast<std::uint32_t>(length);
    }
}

}  // namespace orbis::mapping::detail

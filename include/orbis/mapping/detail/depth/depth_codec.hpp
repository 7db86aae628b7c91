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
/// - a group has one data bit in a run length and two in a difference, because most of these numbers are small.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

namespace orbis::mapping::detail {

/// Coding of the pixels, stored in the first byte of a compressed image.
enum class depth_coding : std::uint8_t {
  plain,  ///< two bytes per pixel, little-endian: for images that do not compress
  runs    ///< the number of distinct depths, the steps between them, then alternating runs and differences
};

/// Predicts the rank of a pixel from the ranks of its neighbours to the west, north and north-west. 0: no depth.
[[nodiscard]] inline std::int32_t expected_rank(std::int32_t west, std::int32_t north,
                                                std::int32_t north_west) noexcept {
  if (west == 0 || north == 0 || north_west == 0) return west != 0 ? west : north;
  // Uses values, not std::clamp's references, so that the compiler emits no branch, which would be unpredictable.
  const std::int32_t low = west < north ? west : north, high = west < north ? north : west;
  const std::int32_t plane = west + north - north_west, above = plane < low ? low : plane;
  return above < high ? above : high;
}

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

/// Reads numbers written by a `group_writer`.
class group_reader {
 public:
  explicit group_reader(std::span<const std::byte> from) noexcept : from_{from} {}
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

inline constexpr unsigned run_bits = 1, step_bits = 2;

/// Compresses depth images. Reuses its buffers, which take about 2 bytes per pixel plus 130 kB.
class depth_encoder {
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
    return out_.capacity() + (rank_of_.capacity() + above_.capacity() + here_.capacity()) * sizeof(std::uint16_t);
  }

 private:
  /// Returns the number of bytes written, 0 if `out` is too small.
  [[nodiscard]] std::size_t write_runs(image_view<const std::uint16_t> depth, std::span<std::byte> out) {
    out[0] = static_cast<std::byte>(depth_coding::runs);
    group_writer to{out.subspan(1)};
    list_depths(depth, to);
    above_.assign(static_cast<std::size_t>(depth.width()), 0);
    here_ = above_;
    std::uint32_t run = 0;
    std::int32_t last = 0;  // value written last
    for (int y = 0; y != depth.height() && !to.is_full(); ++y, above_.swap(here_)) {
      const std::uint16_t *const from = depth.row(y).data(), *const above = above_.data();
      std::uint16_t* const here = here_.data();
      std::int32_t west = 0, north_west = 0;
      for (int x = 0; x != depth.width(); ++x) {
        const std::int32_t north = above[x], rank = rank_of_[from[x]];
        const std::int32_t expected = expected_rank(west, north, north_west);
        if (rank == expected) {
          ++run;
        } else {
          to.put<run_bits>(std::exchange(run, 0));
          to.put<step_bits>(rank == 0 ? 0 : folded(rank - (expected != 0 ? expected : last)));
          if (rank != 0) last = rank;
        }
        here[x] = static_cast<std::uint16_t>(rank);
        west = rank;
        north_west = north;
      }
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
  std::vector<std::uint16_t> above_, here_;  // ranks of two rows
};

/// Decompresses depth images. Reuses its buffers: two bytes for each distinct depth, and 4 bytes per column.
class depth_decoder {
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
    above_.assign(static_cast<std::size_t>(out.width()), 0);
    here_ = above_;
    std::uint32_t run = from.get<run_bits>(), last = 0;
    for (int y = 0; y != out.height(); ++y, above_.swap(here_)) {
      const std::uint16_t* const above = above_.data();
      std::uint16_t *const here = here_.data(), *const to = out.row(y).data();
      std::int32_t west = 0, north_west = 0;
      for (int x = 0;; ++x) {
        const auto take = std::min(run, static_cast<std::uint32_t>(out.width() - x));
        run -= take;
        for (const int end = x + static_cast<int>(take); x != end; ++x) {
          const std::int32_t north = above[x];
          west = expected_rank(west, north, north_west);
          here[x] = static_cast<std::uint16_t>(west);
          north_west = north;
        }
        if (x == out.width()) break;
        const auto expected = static_cast<std::uint32_t>(expected_rank(west, above[x], north_west));
        const std::uint32_t step = from.get<step_bits>();
        std::uint32_t rank = 0;
        if (expected == 0 || step != 0) {
          rank = last = (expected != 0 ? expected : last) + unfolded(step);
          if (rank == 0 || rank >= depths_.size()) return damaged("a pixel refers to a depth that is not in the list");
        }
        here[x] = static_cast<std::uint16_t>(rank);
        west = static_cast<std::int32_t>(rank);
        north_west = above[x];
        run = from.get<run_bits>();
      }
      for (int x = 0; x != out.width(); ++x) to[x] = depths_[here[x]];
    }
    if (run != 0 || !from.is_at_end()) return damaged("has too few or too many bytes for its pixels");
    return {};
  }

  std::vector<std::uint16_t> depths_;        // indexed by rank
  std::vector<std::uint16_t> above_, here_;  // ranks of two rows
};

/// Encodes the zeros of an image: lengths of alternating runs of nonzero and zero pixels, row by row. O(pixels).
[[nodiscard]] inline std::vector<std::byte> encode_zeros(image_view<const std::uint16_t> image) {
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
inline void set_zeros(std::span<const std::byte> zeros, image_view<std::uint16_t> image) {
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

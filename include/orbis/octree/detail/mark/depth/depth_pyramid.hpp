// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finds the nearest and the farthest ray end in any box of pixels with four look-ups.
///
/// Uses the min/max mipmaps of A. Tevs, I. Ihrke, H.-P. Seidel, "Maximum mipmaps for fast, accurate, and
/// scalable dynamic height field rendering", I3D 2008, with overlapping cells.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/simd.hpp>

namespace orbis::octree::detail {

/// Function pointer to a kernel's code, selected when the object is constructed. The kernel is compiled only in
/// translation units that construct objects, not in every one that includes the class with this member.
template <class Kernel, class Signature, simd::target... Targets>
struct chosen_kernel {
  Signature* run = simd::kernel<Kernel, Signature, Targets...>();

  operator Signature*() const noexcept { return run; }  // enables calls through the object
};

/// Combines two cells of the pyramid. The upper half of a cell is the farthest depth in it, rounded up; the lower half
/// is 65535 minus the nearest depth, rounded down. Both halves are thus maxima.
[[nodiscard]] constexpr std::uint32_t larger_halves(std::uint32_t a, std::uint32_t b) noexcept {
  return std::max(a & 0xffff0000U, b & 0xffff0000U) | std::max(a & 0xffffU, b & 0xffffU);
}

/// Combines two vectors of cells.
template <class Cells>
[[nodiscard]] ORBIS_ALWAYS_INLINE Cells max_halves(const Cells& a, const Cells& b) noexcept {
  return simd::bits_as<std::uint32_t>(max(simd::bits_as<std::uint16_t>(a), simd::bits_as<std::uint16_t>(b)));
}

/// Reduces two rows of depths to one row of cells of 2x2 pixels. In `strict`, a missing depth counts as 0; in `some`,
/// it is ignored, and a cell without any depth is 0. Reads up to 16 values beyond the last cell.
struct first_cells_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const float* upper, const float* lower, float scale, int cells,
                                      std::uint32_t* strict, std::uint32_t* some) noexcept {
    using floats = simd::native_vec<float, Target>;
    using words = simd::native_vec<std::uint32_t, Target>;
    constexpr int n = static_cast<int>(words::count);
    const auto word = [&](const float* p) ORBIS_INLINE_LAMBDA {
      const floats z = floats::load(p);
      const words q = simd::bits_as<std::uint32_t>(simd::convert<std::int32_t>(z * scale));
      // (q + 1) << 16 | (65535 - q), as one sum
      return select(z > 0.0F, (q << 16) - q + words(65536U + 65535U), words(0U));
    };
    for (int i = 0; i < cells; i += n) {
      const words a = word(upper + 2 * i), b = word(upper + 2 * i + n);
      const words c = word(lower + 2 * i), d = word(lower + 2 * i + n);
      const words left = max_halves(a, c), right = max_halves(b, d);
      const words any = max_halves(unzip_even(left, right), unzip_odd(left, right));
      const auto gap_mask = [](const words& x, const words& y) ORBIS_INLINE_LAMBDA {
        return select((x == 0U) | (y == 0U), words(0xffffU), words(0U));
      };
      const words gap_left = gap_mask(a, c), gap_right = gap_mask(b, d);
      any.store(some + i);
      (any | unzip_even(gap_left, gap_right) | unzip_odd(gap_left, gap_right)).store(strict + i);
    }
  }
};

/// Sets `out[i]` to the combination of `a[i]`, `a[i + 1]`, `b[i]` and `b[i + 1]`. @pre a[count], b[count] readable
struct overlap_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::uint32_t* a, const std::uint32_t* b, int count,
                                      std::uint32_t* out) noexcept {
    using words = simd::native_vec<std::uint32_t, Target>;
    constexpr int n = static_cast<int>(words::count);
    int i = 0;
    for (; i + n <= count; i += n)
      max_halves(max_halves(words::load(a + i), words::load(a + i + 1)),
                 max_halves(words::load(b + i), words::load(b + i + 1)))
          .store(out + i);
    for (; i != count; ++i) out[i] = larger_halves(larger_halves(a[i], a[i + 1]), larger_halves(b[i], b[i + 1]));
  }
};

/// Level k >= 1 has cells of 2^k x 2^k pixels; its entry (i, j) covers the cells i, i + 1 of the rows j, j + 1. A box
/// that touches at most four cells along an axis is covered along this axis by the entries of its first and its
/// second-to-last cell.
///
/// There are three kinds of entries with different definitions of the nearest end. Kind 0: the nearest end of all
/// pixels, 0 if any pixel has no end. Kind 1: pixels without an end are ignored unless their whole aligned tile of 2x2
/// pixels has none, which gives 0. Kind 2: as kind 1, with tiles of 4x4 pixels.
template <class = void>
class basic_depth_pyramid {
 public:
  static constexpr int max_levels = 16;

  /// Builds the pyramid. `row(v)`: depths at which the rays of image row v end, 0 where a ray has no end, followed by
  /// 16 zeros. `max_z`: the largest depth. O(pixels).
  template <class Row>
  void build(int width, int height, float max_z, Row&& row) {
    lay_out(width, height);
    if (width == 0 || height == 0) return;
    scale_ = max_z > 0.0F ? 65533.0F / max_z : 1.0F;
    // Tiles may extend beyond the image: at the bottom, the last row counts twice; on the right, ends are missing.
    for (int j = 0; j != height_[1]; ++j)
      first_(row(2 * j), row(std::min(2 * j + 1, height - 1)), scale_, width_[1], strict_.data() + j * row_size_,
             some_.data() + j * row_size_);
    raise(0, 1, strict_);
    for (int j = 0; j != height_[1]; ++j)
      for (int i = 0; i != width_[1]; ++i) {
        const std::uint32_t cell = some_[static_cast<std::size_t>(j * row_size_ + i)];
        strict_[static_cast<std::size_t>(j * row_size_ + i)] = cell == 0 ? 0xffffU : cell;
      }
    raise(1, 1, strict_);
    std::copy_n(entries(1, 1), width_[1] * height_[1], entries(2, 1));
    if (levels_ < 2) return;
    overlap(1, some_, scratch_.data());
    for (int j = 0; j != height_[2]; ++j)
      for (int i = 0; i != width_[2]; ++i) {
        const std::uint32_t cell = scratch_[static_cast<std::size_t>(2 * j * width_[1] + 2 * i)];
        some_[static_cast<std::size_t>(j * row_size_ + i)] = cell == 0 ? 0xffffU : cell;
      }
    raise(2, 2, some_);
  }

  /// Returns true if a ray of the aligned tile of `size` x `size` pixels at (u, v) may end at `z` or beyond.
  /// @pre size is a power of two > 2
  [[nodiscard]] bool reaches(std::int32_t u, std::int32_t v, std::int32_t size, float z) const noexcept {
    const int level = std::countr_zero(static_cast<std::uint32_t>(size)) - 1;
    if (level > levels_) return true;
    const auto k = static_cast<std::size_t>(level);
    return static_cast<float>(cells_[static_cast<std::size_t>(begin_[k] + (v >> level) * width_[k] + (u >> level))] >>
                              16U) >= z * scale_;
  }
  /// Factor from depths to the values of entries.
  [[nodiscard]] float scale() const noexcept { return scale_; }
  [[nodiscard]] int levels() const noexcept { return levels_; }
  /// Offset of each level's entries within a kind, and row length of each level.
  [[nodiscard]] const std::array<std::int32_t, max_levels>& begin() const noexcept { return begin_; }
  [[nodiscard]] const std::array<std::int32_t, max_levels>& width() const noexcept { return width_; }
  [[nodiscard]] const std::uint32_t* data() const noexcept { return cells_.data(); }
  [[nodiscard]] std::size_t family() const noexcept { return family_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return (cells_.capacity() + strict_.capacity() + some_.capacity() + scratch_.capacity()) * sizeof(std::uint32_t);
  }

 private:
  using first_signature = void(const float*, const float*, float, int, std::uint32_t*, std::uint32_t*);
  using overlap_signature = void(const std::uint32_t*, const std::uint32_t*, int, std::uint32_t*);
  static constexpr std::size_t padding = 16;

  void lay_out(int width, int height) {
    levels_ = 0;
    std::int32_t size = 0;
    int w = width, h = height;
    do {  // the highest level has at most four cells along each axis
      ++levels_;
      w = (w + 1) / 2;
      h = (h + 1) / 2;
      const auto k = static_cast<std::size_t>(levels_);
      begin_[k] = size;
      width_[k] = w;
      height_[k] = h;
      size += w * h;
    } while (std::max(w, h) > 4 && levels_ + 1 < max_levels);
    family_ = static_cast<std::size_t>(size);
    cells_.resize(3 * family_ + padding);
    row_size_ = static_cast<std::ptrdiff_t>(width_[1]) + static_cast<std::ptrdiff_t>(padding);
    const auto buffer = static_cast<std::size_t>(row_size_) * static_cast<std::size_t>(height_[1] + 1);
    strict_.resize(buffer);
    some_.resize(buffer);
    scratch_.resize(static_cast<std::size_t>(begin_[1] + width_[1] * height_[1]) + padding);
  }
  [[nodiscard]] std::uint32_t* entries(std::size_t kind, int level) noexcept {
    return cells_.data() + kind * family_ + begin_[static_cast<std::size_t>(level)];
  }
  /// Computes the entries of a level from its cells.
  void overlap(int level, std::vector<std::uint32_t>& cells, std::uint32_t* out) {
    const int w = width_[static_cast<std::size_t>(level)], h = height_[static_cast<std::size_t>(level)];
    const auto at = [&](int j) { return cells.data() + j * row_size_; };
    for (int j = 0; j != h; ++j) at(j)[w] = at(j)[w - 1];
    std::copy_n(at(h - 1), w + 1, at(h));
    for (int j = 0; j != h; ++j) overlap_(at(j), at(j + 1), w, out + static_cast<std::ptrdiff_t>(j) * w);
  }
  /// Computes the entries of `level` and all higher levels from the cells of `level`; overwrites `cells`.
  void raise(std::size_t kind, int level, std::vector<std::uint32_t>& cells) {
    for (;; ++level) {
      const std::uint32_t* const out = entries(kind, level);
      overlap(level, cells, entries(kind, level));
      if (level == levels_) return;
      const auto above = static_cast<std::size_t>(level + 1);
      for (int j = 0; j != height_[above]; ++j)
        for (int i = 0; i != width_[above]; ++i)  // every other entry is a cell of the level above
          cells[static_cast<std::size_t>(j * row_size_ + i)] =
              out[static_cast<std::ptrdiff_t>(2 * j) * width_[above - 1] + 2 * i];
    }
  }

  chosen_kernel<first_cells_kernel, first_signature, simd::avx2> first_;
  chosen_kernel<overlap_kernel, overlap_signature, simd::avx2> overlap_;
  std::vector<std::uint32_t> cells_, strict_, some_, scratch_;
  std::array<std::int32_t, max_levels> begin_{}, width_{}, height_{};
  std::size_t family_ = 0;
  std::ptrdiff_t row_size_ = 0;
  int levels_ = 0;
  float scale_ = 1.0F;
};
using depth_pyramid = basic_depth_pyramid<>;

}  // namespace orbis::octree::detail

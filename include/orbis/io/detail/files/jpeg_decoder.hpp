// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A JPEG decoder over bytes in memory.
///
/// libjpeg reports errors by `longjmp` here. Every function that calls `setjmp` keeps nothing but
/// trivial locals, so that no destructor is jumped over.
#pragma once

#include <algorithm>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstdio>  // jpeglib.h needs it
#include <cstring>
#include <string>
#include <string_view>

#include <jpeglib.h>

#include <orbis/core/image.hpp>
#include <orbis/io/detail/files/jpeg_errors.hpp>

namespace orbis::io::detail {

/// A decoder over bytes in memory.
class jpeg_decoder {
 public:
  explicit jpeg_decoder(std::string_view bytes) : size_{bytes.size()} {
    info_.err = errors_.manager();
    // A decoder that goes on after a bad code makes up pixels.
    errors_.base.emit_message = [](j_common_ptr info, int level) {
      jpeg_errors& own = jpeg_errors::of(info->err);
      if (level >= 0 || info->err->num_warnings++ != 0) return;
      info->err->format_message(info, own.message);
      if (own.ends_at_warning) std::longjmp(own.jump, 1);
    };

    source_.next_input_byte = reinterpret_cast<const JOCTET*>(bytes.data());
    source_.bytes_in_buffer = bytes.size();
    source_.init_source = [](j_decompress_ptr) {};
    source_.term_source = [](j_decompress_ptr) {};
    source_.resync_to_restart = jpeg_resync_to_restart;
    source_.fill_input_buffer = [](j_decompress_ptr info) -> boolean { out_of_data(info); };
    source_.skip_input_data = [](j_decompress_ptr info, long count) {
      if (count <= 0) return;
      if (static_cast<std::size_t>(count) > info->src->bytes_in_buffer) out_of_data(info);
      info->src->next_input_byte += count;
      info->src->bytes_in_buffer -= static_cast<std::size_t>(count);
    };
  }
  jpeg_decoder(const jpeg_decoder&) = delete;
  jpeg_decoder& operator=(const jpeg_decoder&) = delete;
  ~jpeg_decoder() { jpeg_destroy_decompress(&info_); }

  /// Reads up to the pixels. False: see `message`.
  bool read_header() {
    if (setjmp(errors_.jump) != 0) return false;
    jpeg_create_decompress(&info_);
    info_.src = &source_;
    jpeg_read_header(&info_, TRUE);
    // A Huffman-coded block of 64 pixels takes a bit at least; arithmetic coding a little less.
    const std::uint64_t pixels = std::uint64_t{info_.image_width} * info_.image_height;
    const std::uint64_t pixels_of_byte = info_.arith_code != FALSE ? 2048 : 512;
    if (pixels > (std::uint64_t{1} << 28) || (pixels > (1U << 20) && pixels > pixels_of_byte * size_))
      return give_up("claims more pixels than the file can hold");
    if (jpeg_has_multiple_scans(&info_) != FALSE) {
      // Each scan goes over all pixels again, and a scan of few bytes may say nothing; the coefficients are all kept.
      if (pixels > (std::uint64_t{1} << 26)) return give_up("has several scans, and too many pixels for that");
      progress_.most_scans =
          static_cast<int>(std::clamp<std::uint64_t>((std::uint64_t{1} << 30) / (pixels + 1), 16, 500));
      progress_.base.progress_monitor = [](j_common_ptr common) {
        auto* const info = reinterpret_cast<j_decompress_ptr>(common);
        if (info->input_scan_number > reinterpret_cast<const progress*>(info->progress)->most_scans)
          end_with(info, "has too many scans");
      };
      info_.progress = &progress_.base;
    }
    return true;
  }

  /// Decodes to 8-bit colour. False: see `message`. @pre read_header() was true
  bool read_pixels(rgb8* to) {
    if (setjmp(errors_.jump) != 0) return false;
    info_.out_color_space = JCS_RGB;
    info_.err->num_warnings = 0;  // what a header is warned about does not change pixels
    errors_.ends_at_warning = true;
    jpeg_start_decompress(&info_);
    while (info_.output_scanline < info_.output_height) {
      auto* row = reinterpret_cast<JSAMPROW>(to + std::size_t{info_.output_scanline} * info_.output_width);
      jpeg_read_scanlines(&info_, &row, 1);
    }
    errors_.ends_at_warning = false;  // nor does what follows them
    jpeg_finish_decompress(&info_);
    return true;
  }

  [[nodiscard]] int width() const { return static_cast<int>(info_.image_width); }
  [[nodiscard]] int height() const { return static_cast<int>(info_.image_height); }
  [[nodiscard]] std::string message() const { return errors_.message; }

 private:
  struct progress {
    jpeg_progress_mgr base{};  // first: libjpeg hands a pointer to it back to us
    int most_scans = 0;
  };

  [[noreturn]] static void end_with(j_decompress_ptr info, const char* why) {
    jpeg_errors& own = jpeg_errors::of(info->err);
    std::strncpy(own.message, why, sizeof own.message - 1);
    std::longjmp(own.jump, 1);
  }
  [[noreturn]] static void out_of_data(j_decompress_ptr info) { end_with(info, "the file ends early"); }
  bool give_up(const char* why) {
    std::strncpy(errors_.message, why, sizeof errors_.message - 1);
    return false;
  }

  jpeg_decompress_struct info_{};
  jpeg_errors errors_{};
  jpeg_source_mgr source_{};
  progress progress_{};
  std::size_t size_;
};

}  // namespace orbis::io::detail

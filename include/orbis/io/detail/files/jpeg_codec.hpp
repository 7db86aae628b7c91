// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A JPEG decoder and encoder for bytes in memory.
///
/// Errors in libjpeg end in a `longjmp`; their message is stored instead of printed. Functions that call `setjmp` have
/// only trivial local variables, so that no destructor is skipped.
#pragma once

#include <algorithm>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstdio>  // jpeglib.h needs it
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include <jerror.h>
#include <jpeglib.h>

#include <orbis/core/image.hpp>

namespace orbis::io::detail {

/// Error state of libjpeg. Callers of libjpeg set `jump` first.
struct jpeg_errors {
  jpeg_error_mgr base{};  // must be first: libjpeg passes a pointer to it back
  std::jmp_buf jump{};
  char message[JMSG_LENGTH_MAX] = "";
  bool ends_at_warning = false;  ///< treats warnings as errors; for decoders only

  /// The error manager to pass to libjpeg. Valid as long as this object is not moved.
  [[nodiscard]] jpeg_error_mgr* manager() {
    jpeg_std_error(&base);
    base.error_exit = [](j_common_ptr info) {
      jpeg_errors& own = of(info->err);
      info->err->format_message(info, own.message);
      std::longjmp(own.jump, 1);
    };
    base.output_message = [](j_common_ptr) {};
    return &base;
  }
  [[nodiscard]] static jpeg_errors& of(jpeg_error_mgr* manager) { return *reinterpret_cast<jpeg_errors*>(manager); }
};

/// A decoder for a JPEG file in memory.
class jpeg_decoder {
 public:
  explicit jpeg_decoder(std::string_view bytes) : size_{bytes.size()} {
    info_.err = errors_.manager();
    // After an invalid code, libjpeg would continue with arbitrary pixels.
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

  /// Reads the header. Returns false on an error; see `message`.
  bool read_header() {
    if (setjmp(errors_.jump) != 0) return false;
    jpeg_create_decompress(&info_);
    info_.src = &source_;
    jpeg_read_header(&info_, TRUE);
    // A Huffman-coded block of 64 pixels takes at least one bit; an arithmetic-coded one slightly less.
    const std::uint64_t pixels = std::uint64_t{info_.image_width} * info_.image_height;
    const std::uint64_t pixels_of_byte = info_.arith_code != FALSE ? 2048 : 512;
    if (pixels > (std::uint64_t{1} << 28) || (pixels > (1U << 20) && pixels > pixels_of_byte * size_))
      return give_up("specifies more pixels than the file can hold");
    if (jpeg_has_multiple_scans(&info_) != FALSE) {
      // Each scan processes all pixels again, and may consist of only a few bytes; all coefficients are kept in memory.
      if (pixels > (std::uint64_t{1} << 26)) return give_up("has too many pixels for an image with several scans");
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

  /// Decodes to 8-bit colour. Returns false on an error; see `message`. @pre read_header() returned true
  bool read_pixels(rgb8* to) {
    if (setjmp(errors_.jump) != 0) return false;
    info_.out_color_space = JCS_RGB;
    info_.err->num_warnings = 0;  // warnings about the header do not affect the pixels
    errors_.ends_at_warning = true;
    jpeg_start_decompress(&info_);
    while (info_.output_scanline < info_.output_height) {
      auto* row = reinterpret_cast<JSAMPROW>(to + std::size_t{info_.output_scanline} * info_.output_width);
      jpeg_read_scanlines(&info_, &row, 1);
    }
    errors_.ends_at_warning = false;  // warnings about data after the pixels do not affect them either
    jpeg_finish_decompress(&info_);
    return true;
  }

  [[nodiscard]] int width() const { return static_cast<int>(info_.image_width); }
  [[nodiscard]] int height() const { return static_cast<int>(info_.image_height); }
  [[nodiscard]] std::string message() const { return errors_.message; }

 private:
  struct progress {
    jpeg_progress_mgr base{};  // must be first: libjpeg passes a pointer to it back
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

class jpeg_encoder {
 public:
  jpeg_encoder() {
    info_.err = errors_.manager();
    // `jpeg_mem_dest` is not used because after an error it is unknown whether its buffer was freed.
    info_.client_data = this;
    destination_.init_destination = [](j_compress_ptr info) { make_room(info); };
    destination_.empty_output_buffer = [](j_compress_ptr info) -> boolean {
      make_room(info);  // the buffer is full, regardless of `free_in_buffer`
      return TRUE;
    };
    destination_.term_destination = [](j_compress_ptr info) {
      auto* own = static_cast<jpeg_encoder*>(info->client_data);
      own->bytes_.resize(own->bytes_.size() - info->dest->free_in_buffer);
    };
  }
  jpeg_encoder(const jpeg_encoder&) = delete;
  jpeg_encoder& operator=(const jpeg_encoder&) = delete;
  ~jpeg_encoder() { jpeg_destroy_compress(&info_); }

  /// Encodes an image. Returns false on an error; see `out_of_memory` and `message`. Call it once.
  bool write(image_view<const rgb8> pixels, int quality) {
    if (setjmp(errors_.jump) != 0) return false;
    jpeg_create_compress(&info_);
    info_.dest = &destination_;
    info_.image_width = static_cast<JDIMENSION>(pixels.width());
    info_.image_height = static_cast<JDIMENSION>(pixels.height());
    info_.input_components = 3;
    info_.in_color_space = JCS_RGB;
    jpeg_set_defaults(&info_);
    jpeg_set_quality(&info_, quality, TRUE);
    jpeg_start_compress(&info_, TRUE);
    while (info_.next_scanline < info_.image_height) {
      const rgb8* const row = pixels.data() + static_cast<std::ptrdiff_t>(info_.next_scanline) * pixels.stride();
      auto* bytes = const_cast<JSAMPLE*>(reinterpret_cast<const JSAMPLE*>(row));  // libjpeg does not change it
      jpeg_write_scanlines(&info_, &bytes, 1);
    }
    jpeg_finish_compress(&info_);
    return true;
  }

  /// Returns the JPEG, moved out of this object. @pre write() returned true
  [[nodiscard]] std::string take() { return std::move(bytes_); }
  /// Returns true if `write` failed because it ran out of memory.
  [[nodiscard]] bool out_of_memory() const { return errors_.base.msg_code == JERR_OUT_OF_MEMORY; }
  [[nodiscard]] std::string message() const { return errors_.message; }

 private:
  [[nodiscard]] bool grow() noexcept {
    constexpr std::size_t least = std::size_t{1} << 14U;
    try {
      bytes_.resize(std::max(least, 2 * bytes_.size()));
    } catch (...) {
      return false;
    }
    return true;
  }
  /// Extends the buffer after the written bytes. Exceptions do not propagate through libjpeg.
  static void make_room(j_compress_ptr info) {
    auto* own = static_cast<jpeg_encoder*>(info->client_data);
    const std::size_t full = own->bytes_.size();
    if (!own->grow()) ERREXIT1(info, JERR_OUT_OF_MEMORY, 0);
    info->dest->next_output_byte = reinterpret_cast<JOCTET*>(own->bytes_.data() + full);
    info->dest->free_in_buffer = own->bytes_.size() - full;
  }

  jpeg_compress_struct info_{};
  jpeg_errors errors_{};
  jpeg_destination_mgr destination_{};
  std::string bytes_;
};

}  // namespace orbis::io::detail

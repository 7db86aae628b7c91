// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A JPEG encoder into memory.
///
/// libjpeg reports errors by `longjmp` here, so `write` keeps nothing but trivial locals.
#pragma once

#include <algorithm>
#include <csetjmp>
#include <cstddef>
#include <cstdio>  // jpeglib.h needs it
#include <string>
#include <utility>

#include <jerror.h>
#include <jpeglib.h>

#include <orbis/core/image.hpp>
#include <orbis/io/detail/files/jpeg_errors.hpp>

namespace orbis::io::detail {

class jpeg_encoder {
 public:
  jpeg_encoder() {
    info_.err = errors_.manager();
    // Not `jpeg_mem_dest`: after an error nobody knows whether its buffer was freed.
    info_.client_data = this;
    destination_.init_destination = [](j_compress_ptr info) { make_room(info); };
    destination_.empty_output_buffer = [](j_compress_ptr info) -> boolean {
      make_room(info);  // all of it is full, whatever `free_in_buffer` says
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

  /// Encodes an image. False: see `out_of_memory` and `message`. @pre it was not called before
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
      auto* bytes = const_cast<JSAMPLE*>(reinterpret_cast<const JSAMPLE*>(row));  // which libjpeg does not change
      jpeg_write_scanlines(&info_, &bytes, 1);
    }
    jpeg_finish_compress(&info_);
    return true;
  }

  /// The JPEG, which is given away. @pre write() was true
  [[nodiscard]] std::string take() { return std::move(bytes_); }
  /// Whether it was want of memory that ended `write`.
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
  /// Room behind what is full. No exception goes through libjpeg.
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

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A JPEG encoder into memory.
///
/// libjpeg reports errors by `longjmp` here, so `write` keeps nothing but trivial locals.
#pragma once

#include <csetjmp>
#include <cstddef>
#include <cstdio>  // jpeglib.h needs it
#include <cstdlib>
#include <string>
#include <string_view>

#include <jpeglib.h>

#include <orbis/core/image.hpp>

namespace orbis::io::detail {

class jpeg_encoder {
 public:
  jpeg_encoder() {
    info_.err = jpeg_std_error(&trouble_.base);
    trouble_.base.error_exit = [](j_common_ptr info) {
      auto* own = reinterpret_cast<struct trouble*>(info->err);
      info->err->format_message(info, own->message);
      std::longjmp(own->jump, 1);
    };
    trouble_.base.output_message = [](j_common_ptr) {};
  }
  jpeg_encoder(const jpeg_encoder&) = delete;
  jpeg_encoder& operator=(const jpeg_encoder&) = delete;
  ~jpeg_encoder() {
    jpeg_destroy_compress(&info_);
    std::free(data_);
  }

  /// Encodes an image. False: see `message`. @pre it was not called before
  bool write(image_view<const rgb8> pixels, int quality) {
    if (setjmp(trouble_.jump) != 0) return false;
    jpeg_create_compress(&info_);
    jpeg_mem_dest(&info_, &data_, &size_);
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

  [[nodiscard]] std::string_view bytes() const { return {reinterpret_cast<const char*>(data_), size_}; }
  [[nodiscard]] std::string message() const { return trouble_.message; }

 private:
  struct trouble {
    jpeg_error_mgr base;  // first: libjpeg hands a pointer to it back to us
    std::jmp_buf jump;
    char message[JMSG_LENGTH_MAX] = "";
  };

  jpeg_compress_struct info_{};
  trouble trouble_{};
  unsigned char* data_ = nullptr;
  unsigned long size_ = 0;
};

}  // namespace orbis::io::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How libjpeg reports errors here: by `longjmp`, with a message and nothing printed.
#pragma once

#include <csetjmp>
#include <cstdio>  // jpeglib.h needs it

#include <jpeglib.h>

namespace orbis::io::detail {

/// What an error of libjpeg leaves behind. Whoever calls libjpeg sets `jump` before.
struct jpeg_errors {
  jpeg_error_mgr base{};  // first: libjpeg hands a pointer to it back to us
  std::jmp_buf jump{};
  char message[JMSG_LENGTH_MAX] = "";
  bool ends_at_warning = false;  ///< of a decoder

  /// What libjpeg is to be given. Valid as long as this stays where it is.
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

}  // namespace orbis::io::detail

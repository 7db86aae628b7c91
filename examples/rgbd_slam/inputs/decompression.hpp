// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Decompression with the libraries that this build includes: LZ4 frames, Zstandard and bzip2.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <orbis/core/result.hpp>

namespace app {

struct decompressed {
  std::string bytes;
  bool is_complete = false;  ///< false if the input is truncated or damaged; `bytes` is then the part before the damage
};

/// Decompresses "lz4", "zstd" or "bz2", up to `most` bytes of output; memory is allocated as the output is produced.
/// Errors: unsupported (another method, or no library for the method), with the name of the missing package.
[[nodiscard]] orbis::result<decompressed> decompress(std::string_view method, std::string_view bytes, std::size_t most,
                                                     const std::string& where);

/// Returns true if `bytes` begin with a Zstandard frame.
[[nodiscard]] inline bool is_zstd(std::string_view bytes) { return bytes.starts_with("\x28\xb5\x2f\xfd"); }

}  // namespace app

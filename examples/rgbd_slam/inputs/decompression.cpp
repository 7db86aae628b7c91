// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/decompression.hpp"

#include <algorithm>
#include <memory>
#include <new>

#ifdef RGBD_SLAM_BZ2
#include <bzlib.h>
#endif
#ifdef RGBD_SLAM_LZ4
#include <lz4frame.h>
#endif
#ifdef RGBD_SLAM_ZSTD
#include <zstd.h>
#endif

#include <orbis/core/quote.hpp>

namespace app {
namespace {

/// Progress of a decompressor: the bytes that it has read and written, and its state.
struct progress {
  std::size_t read = 0, written = 0;
  bool is_end = false, is_bad = false;
};

/// Calls `step(input, output, room)` until decompression ends or there are `most` bytes of output.
template <class Step>
decompressed run(std::string_view bytes, std::size_t most, const Step& step) {
  decompressed out;
  std::size_t size = 0;
  while (true) {
    if (size == out.bytes.size() && size != most)
      out.bytes.resize(std::min(most, std::max<std::size_t>(2 * size, 65536)));
    const progress p = step(bytes, out.bytes.data() + size, out.bytes.size() - size);
    bytes.remove_prefix(p.read);
    size += p.written;
    if (p.is_end || size == most) out.is_complete = true;
    if (p.is_end || p.is_bad || size == most || (p.read == 0 && p.written == 0)) break;
  }
  out.bytes.resize(size);
  return out;
}

}  // namespace

orbis::result<decompressed> decompress(std::string_view method, [[maybe_unused]] std::string_view bytes,
                                       [[maybe_unused]] std::size_t most, const std::string& where) {
  std::string package;
  if (method == "lz4") {
#ifdef RGBD_SLAM_LZ4
    LZ4F_dctx* made = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) throw std::bad_alloc{};
    const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> state{made,
                                                                                     &LZ4F_freeDecompressionContext};
    return run(bytes, most, [&](std::string_view in, char* to, std::size_t room) {
      std::size_t read = in.size(), written = room;
      const std::size_t left = LZ4F_decompress(state.get(), to, &written, in.data(), &read, nullptr);
      if (LZ4F_isError(left) != 0) return progress{.is_bad = true};
      return progress{read, written, left == 0};
    });
#endif
    package = "liblz4-dev";
  } else if (method == "zstd") {
#ifdef RGBD_SLAM_ZSTD
    const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> state{ZSTD_createDStream(), &ZSTD_freeDStream};
    if (state == nullptr) throw std::bad_alloc{};
    return run(bytes, most, [&](std::string_view in, char* to, std::size_t room) {
      ZSTD_inBuffer from{in.data(), in.size(), 0};
      ZSTD_outBuffer out{to, room, 0};
      const std::size_t left = ZSTD_decompressStream(state.get(), &out, &from);
      return progress{from.pos, out.pos, left == 0, ZSTD_isError(left) != 0};
    });
#endif
    package = "libzstd-dev";
  } else if (method == "bz2") {
#ifdef RGBD_SLAM_BZ2
    bz_stream stream{};
    if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::bad_alloc{};
    const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> end{&stream, &BZ2_bzDecompressEnd};
    return run(bytes, most, [&](std::string_view in, char* to, std::size_t room) {
      const auto piece = [](std::size_t n) { return static_cast<unsigned>(std::min<std::size_t>(n, 1U << 30U)); };
      stream.next_in = const_cast<char*>(in.data());  // not changed
      stream.avail_in = piece(in.size());
      stream.next_out = to;
      stream.avail_out = piece(room);
      const int state = BZ2_bzDecompress(&stream);
      return progress{piece(in.size()) - stream.avail_in, piece(room) - stream.avail_out, state == BZ_STREAM_END,
                      state != BZ_OK && state != BZ_STREAM_END};
    });
#endif
    package = "libbz2-dev";
  }
  if (package.empty())
    return orbis::fail(orbis::errc::unsupported, where,
                       "the compression " + orbis::in_quotes(method) + " is not supported; use none, lz4, zstd or bz2");
  return orbis::fail(
      orbis::errc::unsupported, where,
      "is compressed with " + std::string{method} + ", for which this build has no library (" + package + ")");
}

}  // namespace app

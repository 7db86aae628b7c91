// SPDX-License-Identifier: BSD-3-Clause
//
// Depth images in little memory, without loss: ours beside RVL, from which it comes (A. D. Wilson, "Fast lossless depth
// image compression", ISS 2017), and PNG (zlib's usual level). Bytes a second are those of the images as they are;
// `ratio` is what is left of them.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>
#include <png.h>

#include <orbis/io/png.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/mapping/depth_store.hpp>

#include "mapping/depth_keyframes.hpp"

namespace orbis::bench {
namespace {

using depth_image = image<std::uint16_t>;
using bytes = std::vector<std::byte>;

/// RVL: lengths of runs without and with depth, then the differences between neighbours, in groups of three bits.
struct rvl {
  static bytes encode(const depth_image& depth) {
    std::vector<std::uint32_t> words(depth.pixels().size() / 2 + 16 + depth.pixels().size());
    std::uint32_t* to = words.data();
    std::uint32_t word = 0;
    int free = 8;
    const auto put = [&](std::uint32_t value) {
      do {
        std::uint32_t nibble = value & 7U;
        value >>= 3U;
        if (value != 0) nibble |= 8U;
        word = word << 4U | nibble;
        if (--free == 0) *to++ = word, free = 8, word = 0;
      } while (value != 0);
    };
    const std::uint16_t *at = depth.data(), *const end = at + depth.pixels().size();
    std::int32_t before = 0;
    while (at != end) {
      const std::uint16_t* run = at;
      while (at != end && *at == 0) ++at;
      put(static_cast<std::uint32_t>(at - run));
      run = at;
      while (run != end && *run != 0) ++run;
      put(static_cast<std::uint32_t>(run - at));
      for (; at != run; ++at) {
        const std::int32_t step = *at - before;
        put(static_cast<std::uint32_t>(step << 1) ^ static_cast<std::uint32_t>(step >> 31));
        before = *at;
      }
    }
    if (free != 8) *to++ = word << (4U * static_cast<unsigned>(free));
    const auto used = std::as_bytes(std::span{words.data(), to});
    return {used.begin(), used.end()};
  }
  static void decode(const bytes& packed, depth_image& out) {
    const auto* from = reinterpret_cast<const std::uint32_t*>(packed.data());
    std::uint32_t word = 0;
    int left = 0;
    const auto get = [&] {
      std::uint32_t value = 0, nibble = 0, shift = 0;
      do {
        if (left == 0) word = *from++, left = 8;
        nibble = word >> 28U;
        word <<= 4U;
        --left;
        value |= (nibble & 7U) << shift;
        shift += 3;
      } while ((nibble & 8U) != 0);
      return value;
    };
    std::uint16_t *to = out.data(), *const end = to + out.pixels().size();
    std::int32_t before = 0;
    while (to != end) {
      for (std::uint32_t n = get(); n != 0; --n) *to++ = 0;
      for (std::uint32_t n = get(); n != 0; --n) {
        const std::uint32_t folded = get();
        before += static_cast<std::int32_t>(folded >> 1U) ^ -static_cast<std::int32_t>(folded & 1U);
        *to++ = static_cast<std::uint16_t>(before);
      }
    }
  }
};

struct png {
  static bytes encode(const depth_image& depth) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(depth.width());
    image.height = static_cast<png_uint_32>(depth.height());
    image.format = PNG_FORMAT_LINEAR_Y;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    bytes out(size);
    if (png_image_write_to_memory(&image, out.data(), &size, 0, depth.data(), 0, nullptr) == 0) std::abort();
    out.resize(size);
    return out;
  }
  static void decode(const bytes& packed, depth_image& out) {
    out = *io::decode_png_depth({reinterpret_cast<const char*>(packed.data()), packed.size()});
  }
};

struct ours {
  static bytes encode(const depth_image& depth) {
    static mapping::detail::depth_encoder encoder;
    const auto packed = encoder.encode(depth);
    return {packed.begin(), packed.end()};
  }
  static void decode(const bytes& packed, depth_image& out) {
    mapping::detail::depth_decoder decoder;
    if (!decoder.decode(packed, out.view())) std::abort();
  }
};

/// Ten images of the simulated room, or of a recording; none where that is not at hand.
const std::vector<depth_image>& images_of(const std::string& name) {
  static std::map<std::string, std::vector<depth_image>> all;
  const auto [at, is_new] = all.try_emplace(name);
  if (!is_new) return at->second;
  if (name == "room") {
    for (std::size_t i = 0; i < depth_keyframes::room().size(); i += 4)
      at->second.push_back(depth_keyframes::room().frames[i].depth);
  } else if (const auto recording = io::open_recording(std::filesystem::path{ORBIS_DATA_DIR} / name)) {
    for (std::size_t i = 0; i < recording->size(); i += std::max<std::size_t>(1, recording->size() / 10))
      if (auto frame = recording->frame(i)) at->second.push_back(std::move(frame->depth));
  }
  return at->second;
}

template <class Codec>
void compress(benchmark::State& state, const std::string& name) {
  const auto& images = images_of(name);
  if (images.empty()) return state.SkipWithError("the recording is not at hand");
  std::size_t raw = 0, packed = 0;
  for (auto _ : state)
    for (const depth_image& depth : images) {
      const bytes out = Codec::encode(depth);
      raw += depth.pixels().size_bytes();
      packed += out.size();
    }
  state.SetBytesProcessed(static_cast<std::int64_t>(raw));
  state.counters["ratio"] = static_cast<double>(packed) / static_cast<double>(raw);
}

template <class Codec>
void expand(benchmark::State& state, const std::string& name) {
  const auto& images = images_of(name);
  if (images.empty()) return state.SkipWithError("the recording is not at hand");
  std::vector<bytes> packed;
  std::size_t raw = 0;
  for (const depth_image& depth : images) packed.push_back(Codec::encode(depth));
  depth_image out(images.front().width(), images.front().height());
  for (auto _ : state)
    for (std::size_t i = 0; i != images.size(); ++i) {
      Codec::decode(packed[i], out);
      raw += out.pixels().size_bytes();
    }
  for (std::size_t i = 0; i != images.size(); ++i) {
    Codec::decode(packed[i], out);
    if (!(out == images[i])) return state.SkipWithError("an image has changed");
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(raw));
}

const int registered = [] {
  for (const std::string name : {"room", "kitchen", "livingroom", "fr1_desk_9"}) {
    const auto add = [&]<class Codec>(const std::string& codec, Codec) {
      benchmark::RegisterBenchmark(("depth_store/compress/" + name + "/" + codec).c_str(), compress<Codec>, name)
          ->Unit(benchmark::kMillisecond);
      benchmark::RegisterBenchmark(("depth_store/expand/" + name + "/" + codec).c_str(), expand<Codec>, name)
          ->Unit(benchmark::kMillisecond);
    };
    add("orbis", ours{});
    add("rvl", rvl{});
    add("png", png{});
  }
  return 0;
}();

}  // namespace
}  // namespace orbis::bench

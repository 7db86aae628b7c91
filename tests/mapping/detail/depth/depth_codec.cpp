// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/mapping/detail/depth/depth_codec.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"

namespace {

using orbis::image;
using orbis::mapping::detail::depth_decoder;
using orbis::mapping::detail::depth_encoder;
using orbis::mapping::detail::folded;
using orbis::mapping::detail::group_reader;
using orbis::mapping::detail::group_writer;
using orbis::mapping::detail::unfolded;
using depth_image = image<std::uint16_t>;

std::vector<std::byte> packed(const depth_image& depth) {
  depth_encoder encoder;
  const auto bytes = encoder.encode(depth);
  return {bytes.begin(), bytes.end()};
}

/// Bytes per byte of the image, which must be restored on every instruction set from the same bytes.
double ratio(const depth_image& depth) {
  const auto bytes = packed(depth);
  for (const orbis::simd::level level : orbis::simd::available_levels()) {
    const orbis::simd::level_limit limit{level};
    const bool is_same = packed(depth) == bytes;
    REQUIRE(is_same);
    depth_image back(depth.width(), depth.height(), 12345);
    depth_decoder decoder;
    REQUIRE(decoder.decode(bytes, back.view()));
    REQUIRE(back == depth);
  }
  CHECK(bytes.size() <= depth.pixels().size_bytes() + 1);
  return static_cast<double>(bytes.size()) / static_cast<double>(depth.pixels().size_bytes());
}

depth_image made(int width, int height, const std::function<std::uint32_t(int, int)>& pixel) {
  depth_image out(width, height);
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x) out(x, y) = static_cast<std::uint16_t>(pixel(x, y));
  return out;
}

template <unsigned Bits>
void check_groups() {
  std::vector<std::uint32_t> numbers;
  for (unsigned bits = 0; bits != 32; ++bits)
    for (std::uint32_t near = 0; near != 3; ++near) numbers.push_back((1U << bits) + near - 1);
  numbers.push_back(0xffffffffU);
  std::vector<std::byte> bytes(1000);
  for (std::size_t count = 1; count <= numbers.size(); ++count) {
    group_writer to{bytes};
    for (std::size_t i = 0; i != count; ++i) to.put<Bits>(numbers[i]);
    const auto size = static_cast<std::size_t>(to.finish() - bytes.data());
    REQUIRE_FALSE(to.is_full());
    group_reader whole{std::span{bytes}.first(size)}, cut{std::span{bytes}.first(size - 1)},
        longer{std::span{bytes}.first(size + 1)};
    for (std::size_t i = 0; i != count; ++i) {
      REQUIRE(whole.get<Bits>() == numbers[i]);
      REQUIRE(longer.get<Bits>() == numbers[i]);
      static_cast<void>(cut.get<Bits>());
    }
    REQUIRE(whole.is_at_end());
    REQUIRE_FALSE(longer.is_at_end());
    REQUIRE_FALSE(cut.is_at_end());
  }
  group_writer small{std::span{bytes}.first(6)};
  for (int i = 0; i != 40; ++i) small.put<Bits>(3);
  CHECK(small.is_full());
}

TEST_CASE("numbers come back from groups of bits, and what is missing or left over is seen") {
  check_groups<1>();
  check_groups<2>();
}

TEST_CASE("a difference and the run after it are read as one after the other") {
  orbis::random_bits random{11};
  std::vector<std::byte> bytes(400);
  for (auto& b : bytes) b = static_cast<std::byte>(random.below(4) == 0 ? random.below(256) : random.below(40));
  group_reader together{bytes}, apart{bytes};
  for (int i = 0; i != 1000; ++i) {  // also behind the end
    const auto [step, run] = together.get_step_and_run();
    REQUIRE(step == apart.get<2>());
    REQUIRE(run == apart.get<1>());
    REQUIRE(together.is_at_end() == apart.is_at_end());
  }
}

TEST_CASE("differences of ranks come back from folding") {
  for (std::int32_t value = -65535; value <= 65535; ++value)
    if (static_cast<std::int32_t>(unfolded(folded(value))) != value || folded(value) > 131070) FAIL("value " << value);
  CHECK(folded(0) == 0);
  CHECK(folded(-1) == 1);
  CHECK(folded(1) == 2);
}

TEST_CASE("images of every size come back from compression") {
  orbis::random_bits random{1};
  for (int height = 0; height != 11; ++height)
    for (int width = 0; width != 11; ++width)
      for (const std::uint32_t range : {1U, 2U, 700U, 65536U})
        ratio(made(width, height, [&](int, int) { return random.below(range); }));
}

TEST_CASE("images come back with holes and long differences") {
  orbis::random_bits random{7};
  for (const int height : {15, 16, 17, 31, 40, 67})
    for (const int width : {1, 2, 3, 50})
      for (const std::uint32_t jumps : {0U, 3U, 60U})
        ratio(made(width, height, [&](int x, int y) {
          if (random.below(20) == 0) return 0U;
          const auto near = 1000U + static_cast<std::uint32_t>(3 * x + 2 * y) + random.below(4);
          return random.below(100) < jumps ? random.below(65536) : near;
        }));
}

TEST_CASE("pure noise stays as large as it is") {
  orbis::random_bits random{2};
  CHECK(ratio(made(320, 240, [&](int, int) { return random.below(65536); })) <= 1.0001);
}

TEST_CASE("an image without anything to say is next to nothing") {
  CHECK(ratio(depth_image(640, 480)) < 0.0005);
  CHECK(ratio(depth_image(640, 480, 65535)) < 0.0005);
  CHECK(ratio(depth_image(640, 480, 1234)) < 0.0005);
  CHECK(ratio(made(640, 480, [](int x, int) { return static_cast<std::uint32_t>(1000 + x); })) < 0.002);
}

TEST_CASE("values, ranks and holes come back from compression") {
  orbis::random_bits random{3};
  const auto with_holes = [&](std::uint32_t step, std::uint32_t noise, std::uint32_t holes) {
    return made(97, 53, [&](int x, int y) {
      if (random.below(100) < holes) return 0U;
      return 65535U - step * (static_cast<std::uint32_t>(x / 3 + y / 2) + random.below(noise));
    });
  };
  for (const std::uint32_t step : {1U, 50U})
    for (const std::uint32_t noise : {1U, 5U, 300U})
      for (const std::uint32_t holes : {0U, 10U, 90U}) ratio(with_holes(step, noise, holes));
}

TEST_CASE("a part of a larger image is compressed alone") {
  orbis::random_bits random{4};
  const depth_image all =
      made(40, 30, [&](int x, int) { return 900 + static_cast<std::uint32_t>(x) + random.below(3); });
  const orbis::image_view<const std::uint16_t> part{all.data() + 5 * 40 + 7, 20, 15, 40};
  depth_encoder encoder;
  const auto bytes = encoder.encode(part);
  depth_image back(40, 30, 7);
  depth_decoder decoder;
  REQUIRE(decoder.decode(bytes, {back.data() + 40 + 3, 20, 15, 40}));
  for (int y = 0; y != 15; ++y)
    for (int x = 0; x != 20; ++x) REQUIRE(back(x + 3, y + 1) == part(x, y));
  CHECK(back(2, 1) == 7);
  CHECK(back(23, 1) == 7);
}

TEST_CASE("the encoder and the decoder can be used again") {
  depth_encoder encoder;
  depth_decoder decoder;
  orbis::random_bits random{5};
  for (int trial = 0; trial != 40; ++trial) {
    const auto size = [&] { return static_cast<int>(1 + random.below(40)); };
    const std::uint32_t range = 1 + random.below(400), step = 1 + random.below(20);
    const depth_image depth = made(size(), size(), [&](int, int) { return random.below(range) * step; });
    const auto bytes = encoder.encode(depth);
    const auto fresh = packed(depth);
    REQUIRE(std::vector(bytes.begin(), bytes.end()) == fresh);
    depth_image back(depth.width(), depth.height());
    REQUIRE(decoder.decode(bytes, back.view()));
    REQUIRE(back == depth);
  }
}

TEST_CASE("a compressed image that was cut short or changed is told from a whole one, or gives some image",
          "[mapping]") {
  orbis::random_bits random{6};
  const depth_image depth = made(31, 23, [&](int x, int) {
    return random.below(9) == 0 ? 0U : 700 + 13 * (static_cast<std::uint32_t>(x) / 4 + random.below(3));
  });
  const auto bytes = packed(depth);
  depth_decoder decoder;
  depth_image back(31, 23);
  for (std::size_t size = 0; size != bytes.size(); ++size) {
    const auto cut = decoder.decode(std::span{bytes}.first(size), back.view());
    REQUIRE_FALSE(cut);
    REQUIRE(cut.error().code == orbis::errc::malformed);
  }
  auto longer = bytes;
  longer.push_back(std::byte{0});
  CHECK_FALSE(decoder.decode(longer, back.view()));
  depth_image other(30, 23);
  CHECK_FALSE(decoder.decode(bytes, other.view()));
  for (std::size_t i = 0; i != bytes.size(); ++i)
    for (int bit = 0; bit != 8; ++bit) {
      auto changed = bytes;
      changed[i] ^= static_cast<std::byte>(1U << static_cast<unsigned>(bit));
      if (const auto done = decoder.decode(changed, back.view()); !done)  // any answer, but no harm
        REQUIRE(done.error().code == orbis::errc::malformed);
    }
}

TEST_CASE("depth of a simulated sensor takes less than a quarter") {
  const orbis::io::synthetic_recording room{orbis::io::synthetic_options{.frames = 4, .width = 320, .height = 240}};
  for (const std::size_t i : {0U, 2U}) CHECK(ratio(room.frame(i).value().depth) < 0.22);
}

TEST_CASE("depth of real sensors takes about a tenth") {
  for (const auto& [name, most] : {std::pair{"kitchen", 0.10}, {"livingroom", 0.24}, {"fr1_desk_9", 0.11}}) {
    ORBIS_NEEDS_DATA(name);
    const auto recording = orbis::io::open_recording(orbis::test::data_dir() / name).value();
    const std::size_t step = recording.size() / 3;
    for (std::size_t i = 0; i < recording.size(); i += step) {
      INFO(name << " " << i);
      CHECK(ratio(recording.frame(i).value().depth) < most);
    }
  }
}

}  // namespace

// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <orbis/features/descriptor.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

TEST_CASE("the bits of a descriptor are those of its words, lowest first") {
  binary_descriptor<128> d;
  d.words = {std::uint64_t{1} << 5, std::uint64_t{1} << 63};
  for (std::size_t i = 0; i != 128; ++i) CHECK(d.bit(i) == (i == 5 || i == 127));
}

TEST_CASE("the bytes of a descriptor are those of a row of OpenCV's matrix") {
  std::array<unsigned char, 32> row{};
  for (std::size_t i = 0; i != row.size(); ++i) row[i] = static_cast<unsigned char>(i + 1);
  binary_descriptor<256> d;
  std::memcpy(d.words.data(), row.data(), row.size());
  for (std::size_t i = 0; i != 256; ++i) CHECK(d.bit(i) == ((row[i / 8] >> (i % 8) & 1) != 0));
}

TEST_CASE("features are equal if keypoints and descriptors are") {
  orbis::features::features a;
  CHECK(a.empty());
  a.keypoints.resize(2);
  a.descriptors.resize(2);
  CHECK(a.size() == 2);
  auto b = a;
  CHECK(a == b);
  b.descriptors[1].words[3] = 1;
  CHECK_FALSE(a == b);
  b = a;
  b.keypoints[0].octave = 1;
  CHECK_FALSE(a == b);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/voxel_layer.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

/// Keyed by Morton code, so that its order is the one the layer promises.
template <class T>
using reference = std::map<std::uint64_t, T>;

template <class T>
reference<T> contents(const voxel_layer<T>& layer) {
  reference<T> all;
  layer.for_each([&](const voxel_key& k, const T& v) {
    const std::uint64_t code = morton_code(k);
    REQUIRE((all.empty() || all.rbegin()->first < code));  // sorted, each once
    all.emplace(code, v);
  });
  return all;
}

template <class T>
T make_value(std::uint32_t n) {
  if constexpr (std::is_same_v<T, std::array<double, 9>>)
    return {1.0 * n, 0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, n / 7.0};  // larger than a page's share
  else
    return static_cast<T>(n);
}

template <class T>
void erase_node(reference<T>& all, std::uint64_t code, unsigned shift) {
  all.erase(all.lower_bound(code >> shift << shift), all.lower_bound(((code >> shift) + 1) << shift));
}

}  // namespace

TEMPLATE_TEST_CASE("A layer holds what a standard map holds through any sequence of changes", "", std::uint8_t,
                   std::uint32_t, (std::array<double, 9>)) {
  random_bits random{71};
  for (const std::uint32_t extent : {6U, 24U, 200U, 1U << 21U}) {
    voxel_layer<TestType> layer;
    reference<TestType> expected;
    CHECK(layer.empty());
    CHECK(layer.find({0, 0, 0}) == nullptr);
    for (int step = 0; step != 6000; ++step) {
      const voxel_key key{random.below(extent), random.below(extent), random.below(extent)};
      const std::uint64_t code = morton_code(key);
      const auto value = make_value<TestType>(random.below(1000));
      const std::size_t before = expected.size();
      switch (random.below(8)) {
        case 0: REQUIRE(layer.erase(key) == (expected.erase(code) == 1)); break;
        case 1:
          erase_node(expected, code, 6);
          REQUIRE(layer.erase_octant(key) == before - expected.size());
          break;
        case 2:
          if (random.below(4) != 0) break;
          erase_node(expected, code, 9);
          REQUIRE(layer.erase_brick(key) == before - expected.size());
          break;
        default:
          if (expected.find(code) == expected.end()) REQUIRE(layer.make(key) == TestType{});
          layer.make(key) = value;
          expected[code] = value;
      }
      const voxel_key asked{random.below(extent), random.below(extent), random.below(extent)};
      const auto it = expected.find(morton_code(asked));
      const TestType* found = std::as_const(layer).find(asked);
      REQUIRE((found != nullptr) == (it != expected.end()));
      if (found != nullptr) REQUIRE(*found == it->second);
      REQUIRE(layer.empty() == expected.empty());
    }
    REQUIRE(layer.size() == expected.size());
    REQUIRE(contents(layer) == expected);

    const voxel_layer<TestType> copy = layer;
    voxel_layer<TestType> moved = std::move(layer);
    layer.clear();
    CHECK(layer.empty());
    CHECK(layer.size() == 0);
    CHECK(layer.memory_bytes() == 0);
    layer.make({1, 2, 3}) = make_value<TestType>(5);  // a cleared layer can be filled again
    CHECK(layer.size() == 1);
    CHECK(contents(moved) == expected);
    moved.clear();
    CHECK(contents(copy) == expected);
  }
}

TEST_CASE("References hold while other voxels come and go") {
  voxel_layer<std::uint32_t> layer;
  std::uint32_t& first = layer.make({7, 8, 9});
  first = 42;
  random_bits random{4};
  for (int i = 0; i != 20000; ++i) {
    const voxel_key key{100 + random.below(500), random.below(500), random.below(500)};
    if (random.below(3) == 0)
      layer.erase_brick(key);
    else
      layer.make(key) = 1;
  }
  CHECK(&layer.make({7, 8, 9}) == &first);
  CHECK(first == 42);
}

TEST_CASE("A layer that moves along needs no more memory than its widest moment") {
  voxel_layer<rgb_mean> layer;
  std::size_t widest = 0;
  for (std::uint32_t x = 0; x != 4000; ++x) {
    for (std::uint32_t y = 0; y != 40; ++y) layer.make({x, y, 5}).update({10, 20, 30});
    if (x >= 64)
      for (std::uint32_t y = 0; y != 40; ++y) CHECK(layer.erase({x - 64, y, 5}));
    if (x == 200) widest = layer.memory_bytes();
  }
  CHECK(layer.size() == 64 * 40);
  CHECK(layer.memory_bytes() == widest);
}

static_assert(voxel_payload<rgb_mean> && sizeof(rgb_mean) == 8);

namespace {

rgb8 random_color(orbis::random_bits& random, std::uint32_t low, std::uint32_t high) {
  const auto c = [&] { return static_cast<std::uint8_t>(low + random.below(high - low + 1)); };
  return {c(), c(), c()};
}

}  // namespace

TEST_CASE("A mean colour is exact over its first 257 observations") {
  orbis::random_bits random{1};
  for (int run = 0; run != 20; ++run) {
    rgb_mean mean;
    CHECK(mean.color() == rgb8{});
    std::array<double, 3> sum{};
    for (int n = 1; n != 258; ++n) {
      const rgb8 c = run == 0 ? rgb8{255, 255, 255} : random_color(random, 0, 255);
      mean.update(c);
      sum[0] += c.r;
      sum[1] += c.g;
      sum[2] += c.b;
      REQUIRE(mean.count() == static_cast<std::uint32_t>(n));
      REQUIRE(mean.color().r == static_cast<int>(std::floor(sum[0] / n + 0.5)));
      REQUIRE(mean.color().g == static_cast<int>(std::floor(sum[1] / n + 0.5)));
      REQUIRE(mean.color().b == static_cast<int>(std::floor(sum[2] / n + 0.5)));
    }
  }
}

TEST_CASE("A mean colour of many observations stays near their mean and follows a change") {
  orbis::random_bits random{2};
  rgb_mean mean;
  for (int i = 0; i != 100000; ++i) {
    mean.update(random_color(random, 90, 110));
    REQUIRE(mean.count() <= 257);
    if (i > 257) REQUIRE(std::abs(mean.color().g - 100) <= 3);
  }
  for (int i = 0; i != 2000; ++i) mean.update({255, 0, 7});
  CHECK(mean.color() == rgb8{255, 0, 7});
  for (int i = 0; i != 100000; ++i) mean.update({255, 255, 255});
  CHECK(mean.color() == rgb8{255, 255, 255});
}

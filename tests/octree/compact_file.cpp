// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <orbis/octree/compact_file.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

[[nodiscard]] std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span{text}); }

template <class Model = log_odds<>>
[[nodiscard]] occupancy_octree<Model> some_map(std::uint64_t seed, double resolution, int scans, std::size_t points,
                                               int depth = default_tree_depth) {
  random_bits random{seed};
  occupancy_octree<Model> map{resolution, depth};
  for (int i = 0; i != scans; ++i) {
    const vec3f origin = test::random_points(random, 1, 0.3)[0];
    map.integrate(test::shell_scan(random, points, origin), origin);
  }
  return map;
}

/// The same voxels, known to be the same.
template <class Map>
void check_equal(const Map& a, const Map& b) {
  CHECK(a.resolution() == b.resolution());
  CHECK(a.tree_depth() == b.tree_depth());
  CHECK(a.counts().nodes == b.counts().nodes);
  a.for_each_leaf([&](const typename Map::leaf& leaf) {
    REQUIRE(b.value(leaf.key) == a.value(leaf.key));
    const std::uint32_t last = node_cells(a.tree_depth() - leaf.depth) - 1;
    REQUIRE(b.value(voxel_key{leaf.key.x + last, leaf.key.y + last, leaf.key.z + last}) == a.value(leaf.key));
  });
}

/// The place of the content of a section, its length, and its checksum put right again.
[[nodiscard]] std::size_t section(const std::string& file, const char* tag) { return file.find(tag) + 12; }
[[nodiscard]] std::uint64_t length_of(const std::string& file, std::size_t content) {
  std::uint64_t length = 0;
  for (std::size_t i = 0; i != 8; ++i)
    length |= std::uint64_t{static_cast<unsigned char>(file[content - 8 + i])} << (8 * i);
  return length;
}
[[nodiscard]] std::string resealed(std::string file, const char* tag) {
  const std::size_t content = section(file, tag), size = static_cast<std::size_t>(length_of(file, content));
  const std::uint32_t sum = orbis::crc32c(std::as_bytes(std::span{file}).subspan(content - 12, 12 + size));
  for (std::size_t i = 0; i != 4; ++i) file[content + size + i] = static_cast<char>(sum >> (8 * i) & 0xffU);
  return file;
}

}  // namespace

TEMPLATE_TEST_CASE("A compact file holds every value", "", log_odds<>, log_odds<double>, log_odds<std::int16_t>,
                   log_odds<std::int8_t>) {
  for (const double resolution : {0.03, 0.05, 0.1234567890123456}) {
    const auto map = some_map<TestType>(72, resolution, 6, 400);
    const std::string file = compact_bytes(map);
    const auto again = read_compact<TestType>(bytes_of(file));
    REQUIRE(again);
    check_equal(map, *again);
    check_equal(*again, map);
    CHECK(compact_bytes(*again) == file);
  }
}

TEST_CASE("A compact file of occupancy is a .bt file in less room") {
  const auto map = some_map(73, 0.05, 8, 2000);
  const std::string file = compact_bytes(map, {.occupancy_only = true});
  const auto again = read_compact(bytes_of(file));
  REQUIRE(again);
  CHECK(bt_bytes(*again) == bt_bytes(map));
  CHECK(compact_bytes(*again, {.occupancy_only = true}) == file);
  CHECK(file.size() < bt_bytes(map).size() * 6 / 10);
  CHECK(compact_bytes(map).size() < ot_bytes(map).size() / 5);
  // Any model reads it, and takes its own bounds.
  const auto small = read_compact<log_odds<std::int8_t>>(bytes_of(file));
  REQUIRE(small);
  again->for_each_leaf([&](const occupancy_octree<>::leaf& leaf) {
    using model = log_odds<std::int8_t>;
    REQUIRE(small->value(leaf.key) == (leaf.occupied ? model::clamp_max : model::clamp_min));
  });
}

TEST_CASE("Trees of any depth and leaves of any size fit a compact file") {
  for (const int depth : {5, 6, 8, default_tree_depth, max_tree_depth}) {
    const auto scanned = some_map(74, 0.2, 2, 100, depth);
    check_equal(scanned, read_compact(bytes_of(compact_bytes(scanned))).value());
    for (int level = 0; level <= depth; ++level) {
      occupancy_octree<> map{0.1, depth};
      map.set_unknown_node({}, depth - level, -0.5F);
      if (level != depth) {
        const std::uint32_t last = (std::uint32_t{1} << static_cast<unsigned>(depth)) - node_cells(level);
        map.set_unknown_node({last, last, last}, depth - level, 2.5F);
        map.set_unknown_node({last, 0, 0}, depth - level, 2.5F);
      }
      for (const bool occupancy_only : {false, true}) {
        const auto again = read_compact(bytes_of(compact_bytes(map, {.occupancy_only = occupancy_only})));
        REQUIRE(again);
        if (!occupancy_only) check_equal(map, *again);
        CHECK(again->num_occupied_leaves() == map.num_occupied_leaves());
        CHECK(again->num_free_leaves() == map.num_free_leaves());
      }
    }
  }
}

TEST_CASE("Octants of any values fit a compact file") {
  random_bits random{75};
  for (const std::uint32_t values : {1U, 2U, 7U, 33U, 100000U}) {
    occupancy_octree<> map{0.1};
    for (std::uint32_t x = 0; x != 16; ++x)
      for (std::uint32_t y = 0; y != 16; ++y)
        for (std::uint32_t z = 0; z != 16; ++z)
          if (random.below(4) != 0)
            map.set_unknown_node({32760 + x, 32760 + y, 32760 + z}, default_tree_depth,
                                 0.1F * static_cast<float>(random.below(values)) - 1.0F);
    const auto again = read_compact(bytes_of(compact_bytes(map)));
    REQUIRE(again);
    check_equal(map, *again);
  }
}

TEST_CASE("An empty map has a compact file too") {
  const occupancy_octree<> map{0.05, 9};
  for (const bool occupancy_only : {false, true}) {
    const auto again = read_compact(bytes_of(compact_bytes(map, {.occupancy_only = occupancy_only})));
    REQUIRE(again);
    CHECK(again->empty());
    CHECK(again->tree_depth() == 9);
    CHECK(again->resolution() == 0.05);
  }
}

TEST_CASE("A compact file says what it is without being read") {
  const auto map = some_map<log_odds<std::int16_t>>(76, 0.25, 1, 50, 12);
  const std::string file = compact_bytes(map);
  const auto info = read_compact_info(bytes_of(file));
  REQUIRE(info);
  CHECK(info->resolution == 0.25);
  CHECK(info->tree_depth == 12);
  CHECK(info->value == compact_value::int16);
  CHECK_FALSE(info->occupancy_only);
  CHECK(info->scale == 1000.0);
  CHECK(info->hit == 847.0);
  CHECK(info->miss == -405.0);
  CHECK(info->clamp_min == -2000.0);
  CHECK(info->clamp_max == 3511.0);
  CHECK(info->occupancy_threshold == 0.0);
  CHECK(info->inner_nodes == map.counts().nodes - map.counts().leaves);
  CHECK(read_compact<log_odds<>>(bytes_of(file)).error().code == errc::unsupported);
  CHECK(read_compact<log_odds<std::int8_t>>(bytes_of(file)).error().code == errc::unsupported);
  CHECK(read_compact_info(bytes_of(compact_bytes(map, {.occupancy_only = true})))->occupancy_only);
}

TEST_CASE("Compact files go through paths and streams") {
  const auto map = some_map(77, 0.1, 2, 200);
  const auto folder = std::filesystem::temp_directory_path() / "orbis_compact_files";
  std::filesystem::create_directories(folder);
  REQUIRE(write_compact(map, folder / "map.orbis"));
  check_equal(map, read_compact(folder / "map.orbis").value());
  std::stringstream stream;
  REQUIRE(write_compact(map, stream, {.occupancy_only = true}));
  CHECK(bt_bytes(read_compact(stream).value()) == bt_bytes(map));
  CHECK(read_compact(folder / "none.orbis").error().code == errc::not_found);
  CHECK(write_compact(map, folder / "no" / "such" / "folder.orbis").error().code == errc::write_failed);
  std::ofstream closed;
  closed.setstate(std::ios::badbit);
  CHECK(write_compact(map, closed).error().code == errc::write_failed);
  std::filesystem::remove_all(folder);
}

TEST_CASE("Every damaged, shortened or lengthened compact file is refused") {
  const std::string file = compact_bytes(some_map(78, 0.2, 1, 30));
  for (std::size_t n = 0; n != file.size(); ++n) {
    REQUIRE(read_compact(bytes_of(file.substr(0, n))).error().code == errc::malformed);
    for (const unsigned bit : {0U, 3U, 7U}) {
      std::string damaged = file;
      damaged[n] = static_cast<char>(damaged[n] ^ static_cast<char>(1U << bit));
      const auto refused = read_compact(bytes_of(damaged));
      REQUIRE_FALSE(refused);
      const bool in_version = n >= 8 && n < 12;
      REQUIRE(refused.error().code == (in_version ? errc::unsupported : errc::malformed));
      REQUIRE_FALSE(refused.error().message.empty());
    }
  }
  CHECK(read_compact(bytes_of(file + '\0')).error().code == errc::malformed);
  CHECK(read_compact(bytes_of(file + file)).error().code == errc::malformed);
}

TEST_CASE("Sections that nobody knows are passed over, those that must be there are missed") {
  const auto map = some_map(79, 0.2, 1, 30);
  const std::string file = compact_bytes(map);
  const std::size_t end = file.size() - 16;
  std::string more = file.substr(0, end);
  octree::detail::put_section(more, "rgb ", "any bytes at all");
  CHECK(compact_bytes(read_compact(bytes_of(more + file.substr(end))).value()) == file);

  for (const char* tag : {"head", "vals", "tree"}) {
    const std::size_t content = section(file, tag), size = static_cast<std::size_t>(length_of(file, content));
    std::string twice = file.substr(0, end) + file.substr(content - 12, 12 + size + 4) + file.substr(end);
    CHECK(read_compact(bytes_of(twice)).error().code == errc::malformed);
    std::string without = file;
    without.erase(content - 12, 12 + size + 4);
    CHECK(read_compact(bytes_of(without)).error().code == errc::malformed);
  }
}

TEST_CASE("A compact file with right checksums and wrong content is refused or read without harm") {
  const std::string file = compact_bytes(some_map(80, 0.2, 1, 30));
  // The head, byte by byte: it is small enough for all there is.
  const std::size_t head = section(file, "head");
  int refused = 0;
  for (std::size_t i = 0; i != length_of(file, head); ++i) {
    for (int value = 0; value != 256; ++value) {
      std::string damaged = file;
      damaged[head + i] = static_cast<char>(value);
      const auto map = read_compact(bytes_of(resealed(damaged, "head")));
      refused += map ? 0 : 1;
      if (map) REQUIRE(map->memory_bytes() < 512000 + 4096 * file.size());
    }
  }
  CHECK(refused > 5000);
  using limits = std::numeric_limits<double>;
  for (const double resolution : {0.0, -1.0, limits::infinity(), limits::quiet_NaN()}) {
    std::string damaged = file;
    std::memcpy(damaged.data() + head, &resolution, sizeof resolution);
    CHECK(read_compact(bytes_of(resealed(damaged, "head"))).error().code == errc::malformed);
  }
  random_bits random{81};
  for (const char* tag : {"vals", "tree"}) {
    const std::size_t content = section(file, tag), size = static_cast<std::size_t>(length_of(file, content));
    for (int i = 0; i != 2000; ++i) {
      std::string damaged = file;
      damaged[content + random.below(static_cast<std::uint32_t>(size))] = static_cast<char>(random.below(256));
      const auto map = read_compact(bytes_of(resealed(damaged, tag)));
      if (map)
        REQUIRE(map->memory_bytes() < 512000 + 4096 * file.size());
      else
        REQUIRE(map.error().code == errc::malformed);
    }
  }
}

TEST_CASE("A map that codes to next to nothing is padded to what readers accept") {
  // A checkerboard of bricks: nothing merges, and everything is expected.
  occupancy_octree<> map{0.1};
  const voxel_key base{32768, 32768, 32768};
  for (std::uint32_t i = 0; i != 32 * 32 * 32; ++i) {
    const std::uint32_t x = i & 31U, y = i >> 5U & 31U, z = i >> 10U;
    map.set_unknown_node({base.x + 8 * x, base.y + 8 * y, base.z + 8 * z}, default_tree_depth - brick_level,
                         (x + y + z) % 2 == 0 ? 1.0F : -1.0F);
  }
  const std::string file = compact_bytes(map);
  CHECK(file.find("pad ") != std::string::npos);
  const auto again = read_compact(bytes_of(file));
  REQUIRE(again);
  check_equal(map, *again);
  CHECK(again->memory_bytes() < 512000 + 4096 * file.size());
  // Without the padding it claims too much.
  std::string without = file;
  const std::size_t content = section(file, "pad ");
  without.erase(content - 12, 12 + static_cast<std::size_t>(length_of(file, content)) + 4);
  CHECK(read_compact(bytes_of(without)).error().code == errc::malformed);
}

TEST_CASE("A real corridor takes a third of its .bt file") {
  ORBIS_NEEDS_DATA("octomap/geb079.bt");
  const auto map = read_bt(test::data_dir() / "octomap/geb079.bt").value();
  const std::string file = compact_bytes(map, {.occupancy_only = true});
  CHECK(3 * file.size() < bt_bytes(map).size());
  CHECK(bt_bytes(read_compact(bytes_of(file)).value()) == bt_bytes(map));
  CHECK(ot_bytes(read_compact(bytes_of(compact_bytes(map))).value()) == ot_bytes(map));
}

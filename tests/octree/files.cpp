// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <orbis/core/file.hpp>
#include <orbis/octree/files.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

[[nodiscard]] std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span{text}); }

[[nodiscard]] occupancy_octree<> some_map(std::uint64_t seed, double resolution, int scans, std::size_t points,
                                          octomap::OcTree* reference = nullptr) {
  random_bits random{seed};
  occupancy_octree<> map{resolution};
  for (int i = 0; i != scans; ++i) {
    const vec3f origin = test::random_points(random, 1, 0.3)[0];
    const auto scan = test::shell_scan(random, points, origin);
    map.integrate(scan, origin);
    if (reference != nullptr) test::insert(*reference, scan, origin, {});
  }
  return map;
}

[[nodiscard]] std::string with_header(const std::string& first_line, const std::string& rest) {
  return first_line + "\n# comment\n" + rest;
}
const std::string bt_line = "# Octomap OcTree binary file";
const std::string ot_line = "# Octomap OcTree file";

}  // namespace

TEST_CASE("Files are byte for byte what OctoMap writes for the same scans") {
  for (const double resolution : {0.02, 0.05, 0.1, 0.0123456789}) {
    octomap::OcTree reference{resolution};
    const auto map = some_map(41, resolution, 8, 300, &reference);
    CHECK(bt_bytes(map) == test::bt_of(reference));
    CHECK(ot_bytes(map) == test::ot_of(reference));
  }
}

TEST_CASE("An empty map is a header alone as with OctoMap") {
  const occupancy_octree<> map{0.05};
  const octomap::OcTree reference{0.05};
  CHECK(bt_bytes(map) == test::bt_of(reference));
  CHECK(ot_bytes(map) == test::ot_of(reference));
  const auto again = read_bt(bytes_of(bt_bytes(map)));
  REQUIRE(again);
  CHECK(again->empty());
  CHECK(read_ot(bytes_of(ot_bytes(map)))->empty());
}

TEST_CASE("What is written reads back as the same map") {
  const auto map = some_map(42, 0.05, 10, 1000);
  const std::string ot = ot_bytes(map), bt = bt_bytes(map);
  const auto from_ot = read_ot(bytes_of(ot));
  REQUIRE(from_ot);
  CHECK(ot_bytes(*from_ot) == ot);
  CHECK(from_ot->resolution() == 0.05);
  const auto from_bt = read_bt(bytes_of(bt));
  REQUIRE(from_bt);
  CHECK(bt_bytes(*from_bt) == bt);
  map.for_each_leaf([&](const occupancy_octree<>::leaf& leaf) {
    REQUIRE(from_ot->log_odds(leaf.center) == leaf.log_odds);
    REQUIRE(from_bt->log_odds(leaf.center) == (leaf.occupied ? log_odds<>::clamp_max : log_odds<>::clamp_min));
  });
}

TEST_CASE("OctoMap reads what we write") {
  const auto map = some_map(43, 0.05, 5, 500);
  const test::quiet silence;
  std::istringstream bt{bt_bytes(map)}, ot{ot_bytes(map)};
  octomap::OcTree binary{0.1};
  REQUIRE(binary.readBinary(bt));
  CHECK(test::bt_of(binary) == bt_bytes(map));
  const std::unique_ptr<octomap::AbstractOcTree> full{octomap::AbstractOcTree::read(ot)};
  REQUIRE(full);
  CHECK(test::ot_of(dynamic_cast<const octomap::OcTree&>(*full)) == ot_bytes(map));
}

TEST_CASE("A map that was read can be added to like OctoMap's") {
  octomap::OcTree reference{0.1};
  const auto map = some_map(44, 0.1, 6, 500, &reference);
  const test::quiet silence;
  std::istringstream bt{test::bt_of(reference)};
  octomap::OcTree theirs{0.1};
  REQUIRE(theirs.readBinary(bt));
  auto ours = read_bt(bytes_of(bt_bytes(map)));
  REQUIRE(ours);
  random_bits random{45};
  const auto scan = test::random_points(random, 500, 2.0);
  test::insert(theirs, scan, {0.0F, 0.0F, 0.0F}, {});
  ours->integrate(scan, vec3f{0.0F, 0.0F, 0.0F});
  CHECK(ot_bytes(*ours) == test::ot_of(theirs));
}

TEST_CASE("Files go through paths") {
  const auto map = some_map(46, 0.1, 2, 200);
  const auto folder = std::filesystem::temp_directory_path() / "orbis_octree_files";
  std::filesystem::create_directories(folder);
  REQUIRE(write_bt(map, folder / "map.bt"));
  REQUIRE(write_ot(map, folder / "map.ot"));
  CHECK(bt_bytes(read_bt(folder / "map.bt").value()) == bt_bytes(map));
  CHECK(ot_bytes(read_ot(folder / "map.ot").value()) == ot_bytes(map));

  CHECK(read_bt(folder / "none.bt").error().code == errc::not_found);
  CHECK(read_ot(folder / "map.bt").error().code == errc::malformed);
  CHECK(read_bt(folder / "map.ot").error().code == errc::malformed);
  CHECK(write_bt(map, folder / "no" / "such" / "folder.bt").error().code == errc::write_failed);
  std::filesystem::remove_all(folder);
}

TEST_CASE("Every truncation and every surplus of a file is an error") {
  const auto map = some_map(47, 0.2, 1, 30);
  const std::string bt = bt_bytes(map), ot = ot_bytes(map);
  for (std::size_t n = 0; n != bt.size(); ++n) {
    const auto damaged = read_bt(bytes_of(bt.substr(0, n)));
    REQUIRE_FALSE(damaged);
    REQUIRE(damaged.error().code == errc::malformed);
  }
  for (std::size_t n = 0; n != ot.size(); ++n) REQUIRE_FALSE(read_ot(bytes_of(ot.substr(0, n))));
  for (const std::string& surplus : {std::string(1, '\0'), bt, ot}) {
    CHECK(read_bt(bytes_of(bt + surplus)).error().code == errc::malformed);
    CHECK(read_ot(bytes_of(ot + surplus)).error().code == errc::malformed);
  }
}

TEST_CASE("Any damage to a file gives an error or a map that can be written") {
  const auto map = some_map(48, 0.2, 1, 30);
  const std::string bt = bt_bytes(map), ot = ot_bytes(map);
  random_bits random{49};
  int refused = 0;
  for (int i = 0; i != 1500; ++i) {
    std::string b = bt, o = ot;
    for (std::uint32_t n = 1 + random.below(4); n != 0; --n) {
      b[random.below(static_cast<std::uint32_t>(b.size()))] = static_cast<char>(random.below(256));
      o[random.below(static_cast<std::uint32_t>(o.size()))] = static_cast<char>(random.below(256));
    }
    const auto from_b = read_bt(bytes_of(b));
    const auto from_o = read_ot(bytes_of(o));
    if (from_b) CHECK(bt_bytes(*from_b).size() > 0);
    if (from_o) CHECK(ot_bytes(*from_o).size() > 0);
    refused += (from_b ? 0 : 1) + (from_o ? 0 : 1);
  }
  CHECK(refused > 500);
}

TEST_CASE("Headers that lie or lack something are refused with a reason") {
  const std::string node{"\x02\x00", 2};  // one occupied child of the root
  const auto bt = [&](const std::string& rest) { return read_bt(bytes_of(with_header(bt_line, rest))); };
  REQUIRE(bt("id OcTree\nsize 2\nres 0.1\ndata\n" + node));
  REQUIRE(bt("res 0.1\r\nid OcTree\r\nsize 2\r\ndata\n" + node));
  CHECK(bt("id ColorOcTree\nsize 2\nres 0.1\ndata\n" + node).error().code == errc::unsupported);
  for (const std::string header :
       {"id OcTree\nsize 3\nres 0.1\ndata\n", "id OcTree\nsize 0\nres 0.1\ndata\n",
        "id OcTree\nsize 99999999999999\nres 0.1\ndata\n", "id OcTree\nsize -2\nres 0.1\ndata\n",
        "id OcTree\nsize 2\nres 0\ndata\n", "id OcTree\nsize 2\nres -1\ndata\n", "id OcTree\nsize 2\nres nan\ndata\n",
        "id OcTree\nsize 2\nres inf\ndata\n", "id OcTree\nsize 2\nres 0.1x\ndata\n", "id OcTree\nsize 2\ndata\n",
        "id OcTree\nres 0.1\ndata\n", "size 2\nres 0.1\ndata\n", "id OcTree\nsize 2\nres 0.1\nwhat 1\ndata\n", ""}) {
    INFO(header);
    const auto map = bt(header + node);
    if (header.find("size 0") == std::string::npos) {
      REQUIRE_FALSE(map);
      CHECK(map.error().code == errc::malformed);
      CHECK_FALSE(map.error().message.empty());
    }
  }
  CHECK_FALSE(read_bt(bytes_of("")));
  CHECK_FALSE(read_bt(bytes_of("# some other file\ndata\n")));
}

TEST_CASE("A hostile file takes memory in proportion to its size") {
  // Chains of inner nodes down to one voxel each.
  std::string data;
  std::size_t nodes = 1;
  data += std::string{"\xff\xff", 2};
  for (int child = 0; child != 8; ++child) {
    for (int depth = 1; depth != 15; ++depth) data += std::string{"\x03\x00", 2};
    data += std::string{"\x01\x00", 2};
    nodes += 16;
  }
  const std::string header = "id OcTree\nsize " + std::to_string(nodes) + "\nres 0.1\ndata\n";
  const auto map = read_bt(bytes_of(with_header(bt_line, header + data)));
  REQUIRE(map);
  CHECK(map->num_leaves() == 8);
  CHECK(map->memory_bytes() < 8192 + 400 * data.size());

  // Each node is eight leaves of the size of a brick: the most storage a byte can ask for.
  constexpr int brick_level = 3;  // 8 x 8 x 8 voxels
  std::string bricks{"\xff\xff", 2};
  std::size_t brick_nodes = 1;
  const auto fill = [&](auto&& self, int level) -> void {
    for (int child = 0; child != 8; ++child) {
      ++brick_nodes;
      if (level == brick_level + 1) {
        bricks += std::string{"\x66\x66", 2};
        brick_nodes += 8;
      } else if (level < brick_level + 4) {
        bricks += std::string{"\xff\xff", 2};
        self(self, level - 1);
      } else {
        bricks += std::string{"\x03\x00", 2};
        for (int l = level - 1; l != brick_level + 3; --l, ++brick_nodes) bricks += std::string{"\x03\x00", 2};
        ++brick_nodes;
        bricks += std::string{"\xff\xff", 2};
        self(self, brick_level + 2);
      }
    }
  };
  fill(fill, default_tree_depth - 1);
  const auto wide = read_bt(
      bytes_of(with_header(bt_line, "id OcTree\nsize " + std::to_string(brick_nodes) + "\nres 0.1\ndata\n" + bricks)));
  REQUIRE(wide);
  CHECK(wide->size() == brick_nodes);
  CHECK(wide->memory_bytes() < 8192 + 400 * bricks.size());

  // One leaf that covers an eighth of the world.
  const auto large =
      read_bt(bytes_of(with_header(bt_line, "id OcTree\nsize 2\nres 0.1\ndata\n" + std::string{"\x02\x00", 2})));
  REQUIRE(large);
  CHECK(large->num_leaves() == 1);
  CHECK(large->memory_bytes() < 8000);
  CHECK(large->state(vec3{-1000.0, -20.0, -0.05}) == occupancy::occupied);

  // A chain that goes on below the deepest level.
  std::string deep;
  for (int depth = 0; depth != 20; ++depth) deep += std::string{"\x03\x00", 2};
  CHECK_FALSE(read_bt(bytes_of(with_header(bt_line, "id OcTree\nsize 20\nres 0.1\ndata\n" + deep))));
  std::string deep_ot;
  for (int depth = 0; depth != 20; ++depth) deep_ot += std::string{"\0\0\0\0\x01", 5};
  CHECK_FALSE(read_ot(bytes_of(with_header(ot_line, "id OcTree\nsize 20\nres 0.1\ndata\n" + deep_ot))));
  const std::string not_a_number{"\0\0\xc0\x7f\0", 5};
  CHECK_FALSE(read_ot(bytes_of(with_header(ot_line, "id OcTree\nsize 1\nres 0.1\ndata\n" + not_a_number))));
}

TEST_CASE("Leaves of every size survive reading and writing") {
  for (int depth = 1; depth <= default_tree_depth; ++depth) {
    std::string data;
    for (int d = 1; d != depth; ++d) data += std::string{"\x03\x00", 2};
    data += std::string{"\x06\x00", 2};  // an occupied and a free child
    const std::string file =
        with_header(bt_line, "id OcTree\nsize " + std::to_string(depth + 2) + "\nres 0.1\ndata\n" + data);
    const auto map = read_bt(bytes_of(file));
    REQUIRE(map);
    const std::string again = bt_bytes(*map);
    CHECK(again.substr(again.find("data\n") + 5) == data);
    CHECK(map->num_leaves() == 2);
  }
}

TEST_CASE("A map that is one leaf is written as eight where a file cannot hold one") {
  for (const float value : {-1.0F, 1.0F}) {
    occupancy_octree<> map{0.1};
    map.set_unknown_node({}, 0, value);
    CHECK(map.size() == 1);
    const auto from_ot = read_ot(bytes_of(ot_bytes(map)));
    REQUIRE(from_ot);
    CHECK(from_ot->size() == 1);
    const auto from_bt = read_bt(bytes_of(bt_bytes(map)));
    REQUIRE(from_bt);
    CHECK(from_bt->num_leaves() == 8);
    CHECK(from_bt->state(vec3{-1.0, 100.0, 0.0}) == map.state(vec3{-1.0, 100.0, 0.0}));
    const test::quiet silence;
    std::istringstream stream{bt_bytes(map)};
    octomap::OcTree theirs{0.1};
    REQUIRE(theirs.readBinary(stream));
    CHECK(test::bt_of(theirs) == bt_bytes(map));
  }
}

TEST_CASE("What OctoMap leaves unpruned stays unpruned in its files") {
  // OctoMap prunes from below and stops at the first level at which nothing merges. `merges` are the
  // levels at which eight leaves differ in their log-odds, but not in what is likelier.
  const int top = default_tree_depth - 1;
  for (const auto& merges : {std::vector<int>{},
                             {1},
                             {2},
                             {3},
                             {4},
                             {6},
                             {1, 2},
                             {1, 3},
                             {2, 3},
                             {1, 2, 3},
                             {1, 2, 4},
                             {1, 2, 3, 4, 5},
                             {1, 3, 4}}) {
    for (const bool occupied : {false, true}) {
      occupancy_octree<> map{0.1};
      for (const int level : merges) {
        // Each in an eighth of the world of its own.
        const voxel_key base = child_key({}, static_cast<unsigned>(level), node_cells(top));
        for (unsigned i = 0; i != 8; ++i)
          map.set_unknown_node(child_key(base, i, node_cells(level - 1)), default_tree_depth - level + 1,
                               (occupied ? 1.0F : -1.0F) + 0.01F * static_cast<float>(i));
      }
      if (merges.empty()) map.set_unknown_node({}, default_tree_depth, 1.0F);
      std::string levels;
      for (const int level : merges) levels += std::to_string(level) + ' ';
      INFO("levels " << levels);
      const test::quiet silence;
      std::istringstream ot{ot_bytes(map)};
      const std::unique_ptr<octomap::AbstractOcTree> theirs{octomap::AbstractOcTree::read(ot)};
      REQUIRE(theirs);
      CHECK(test::ot_of(dynamic_cast<const octomap::OcTree&>(*theirs)) == ot_bytes(map));
      CHECK(test::bt_of(dynamic_cast<const octomap::OcTree&>(*theirs)) == bt_bytes(map));
    }
  }
}

TEST_CASE("Octants of any values are written as OctoMap writes them") {
  // From few values, of which groups are equal, to a different one for each voxel.
  random_bits random{411};
  for (const std::uint32_t values : {2U, 3U, 5U, 16U, 40U, 1000U}) {
    occupancy_octree<> map{0.1};
    for (std::uint32_t octant = 0; octant != 32; ++octant) {
      const voxel_key base{32768 + 4 * (octant & 1U), 32768 + 4 * (octant >> 1U & 1U), 32768 + 4 * (octant >> 2U)};
      const bool whole = random.below(3) != 0;
      for (unsigned group = 0; group != 8; ++group) {
        const bool equal = random.below(2) == 0;
        const auto value = [&] { return 0.01F * static_cast<float>(static_cast<int>(random.below(values))) - 0.1F; };
        const float one = value();
        for (unsigned i = 0; i != 8; ++i)
          if (whole || random.below(4) != 0)
            map.set_unknown_node(child_key(child_key(base, group, 2), i, 1), default_tree_depth, equal ? one : value());
      }
    }
    const std::string ot = ot_bytes(map);
    const auto again = read_ot(bytes_of(ot));
    REQUIRE(again);
    CHECK(ot_bytes(*again) == ot);
    const test::quiet silence;
    std::istringstream in{ot};
    const std::unique_ptr<octomap::AbstractOcTree> theirs{octomap::AbstractOcTree::read(in)};
    REQUIRE(theirs);
    dynamic_cast<octomap::OcTree&>(*theirs).updateInnerOccupancy();
    CHECK(test::ot_of(dynamic_cast<const octomap::OcTree&>(*theirs)) == ot);
    CHECK(test::bt_of(dynamic_cast<const octomap::OcTree&>(*theirs)) == bt_bytes(map));
  }
}

TEST_CASE("Maps deeper or shallower than OctoMap's are not written in its formats") {
  for (const int depth : {8, 18}) {
    const occupancy_octree<> map{0.1, depth};
    const auto path = std::filesystem::temp_directory_path() / "orbis_octree_files_deep.bt";
    CHECK(write_bt(map, path).error().code == errc::unsupported);
    CHECK(write_ot(map, path).error().code == errc::unsupported);
    CHECK_FALSE(std::filesystem::exists(path));
  }
}

TEST_CASE("Headers may lack their comments and hold others") {
  const auto map = some_map(410, 0.2, 1, 30);
  const std::string bt = bt_bytes(map);
  const std::string data = bt.substr(bt.find("data\n"));
  const std::string size = "size " + std::to_string(read_bt(bytes_of(bt))->size()) + "\n";
  for (const std::string& header :
       {"id OcTree\n" + size + "res 0.2\n", "#\n" + size + "# more\n\nres 0.2\nid OcTree\n"})
    CHECK(bt_bytes(read_bt(bytes_of(bt_line + "\n" + header + data)).value()) == bt);
}

TEST_CASE("A real corridor reads and rewrites to the same bytes") {
  ORBIS_NEEDS_DATA("octomap/geb079.bt");
  const auto path = test::data_dir() / "octomap/geb079.bt";
  const auto map = read_bt(path);
  REQUIRE(map);
  CHECK(map->size() == 532566);
  CHECK(map->resolution() == 0.08);
  const std::string file = read_file(path).value(), ours = bt_bytes(*map);
  CHECK(ours.substr(ours.find("data\n")) == file.substr(file.find("data\n")));
  const test::quiet silence;
  const octomap::OcTree theirs{path.string()};
  CHECK(ours == test::bt_of(theirs));
  CHECK(ot_bytes(*map) == test::ot_of(theirs));
}

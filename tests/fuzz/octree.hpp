// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What must hold for every octree, however it came about, and for every reader of octrees.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <fcntl.h>
#include <octomap/octomap.h>
#include <unistd.h>

#include <orbis/octree/files.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "fuzz/target.hpp"

namespace orbis::fuzz {

using map = octree::occupancy_octree<>;

/// A reader takes at most this much memory for each byte of the file, and this much besides. The most
/// expensive file lists octants of 4x4x4 voxels, two bytes each.
inline constexpr std::size_t memory_per_file_byte = 400;
inline constexpr std::size_t memory_for_any_file = 8192;

[[nodiscard]] inline std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span{text});
}

[[nodiscard]] inline std::uint32_t edge_in_voxels(const map& m, const map::leaf& leaf) {
  return octree::node_cells(m.grid().depth() - leaf.depth);
}

/// A leaf of the pruned tree.
struct tree_leaf {
  octree::voxel_key key;
  int level = 0;
  float value = 0.0F;
  friend bool operator==(const tree_leaf&, const tree_leaf&) = default;
};
/// All that a map knows.
[[nodiscard]] inline std::vector<tree_leaf> leaves_of(const map& m) {
  std::vector<tree_leaf> leaves;
  m.for_each_leaf([&](const map::leaf& l) { leaves.push_back({l.key, m.tree_depth() - l.depth, l.log_odds}); });
  return leaves;
}

/// What follows a file's header.
[[nodiscard]] inline std::string data_of(const std::string& file) { return file.substr(file.find("\ndata\n") + 6); }
/// How many voxels all rays of an input may pass through together, about: what bounds the time that it may take.
class ray_budget {
 public:
  explicit ray_budget(double voxels) : left_{voxels} {}
  /// Whether a ray of `length` still may; takes it off if so. Not one whose length is no number.
  [[nodiscard]] bool take(double length, double resolution) {
    const double voxels = 1.75 * length / resolution;
    if (!(voxels <= left_)) return false;
    left_ -= voxels;
    return true;
  }

 private:
  double left_;
};

/// OctoMap reports on the standard error what it does; not while this lives.
class octomap_silence {
 public:
  octomap_silence() {
    if (nowhere >= 0) dup2(nowhere, STDERR_FILENO);
  }
  octomap_silence(const octomap_silence&) = delete;
  octomap_silence& operator=(const octomap_silence&) = delete;
  ~octomap_silence() { dup2(kept, STDERR_FILENO); }

 private:
  static inline const int nowhere = open("/dev/null", O_WRONLY), kept = dup(STDERR_FILENO);
};

/// An empty tree of OctoMap, always the same: the constructor fills a buffer of 100,000 keys.
[[nodiscard]] inline octomap::OcTree& empty_octomap(double resolution) {
  static octomap::OcTree tree{0.1};
  tree.clear();
  tree.setResolution(resolution);
  return tree;
}

/// What OctoMap writes, behind the header, of the file it is given; empty if it cannot read it.
[[nodiscard]] inline std::optional<std::string> through_octomap_bt(const std::string& file) {
  const octomap_silence silence;
  std::istringstream in{file};
  std::ostringstream out;
  octomap::OcTree& tree = empty_octomap(0.1);
  if (!tree.readBinary(in)) return std::nullopt;
  tree.toMaxLikelihood();
  tree.prune();
  tree.writeBinaryData(out);
  return out.str();
}
[[nodiscard]] inline std::optional<std::string> through_octomap_ot(const std::string& file, double resolution) {
  const octomap_silence silence;
  std::ostringstream out;
  if (file.size() % 16 != 0) {  // not behind its header, for which OctoMap makes a new tree
    octomap::OcTree& tree = empty_octomap(resolution);
    const std::string data = data_of(file);
    if (data.empty()) return data;
    std::istringstream in{data};
    if (!tree.readData(in)) return std::nullopt;
    tree.writeData(out);
    return out.str();
  }
  std::istringstream in{file};
  const std::unique_ptr<octomap::AbstractOcTree> tree{octomap::AbstractOcTree::read(in)};
  if (tree == nullptr) return std::nullopt;
  tree->writeData(out);
  return out.str();
}

/// Leaves, counts and files of a map tell the same story, to OctoMap too.
inline void check_map(const map& m) {
  std::size_t leaves = 0, occupied = 0;
  m.for_each_leaf([&](const map::leaf& leaf) {
    ++leaves;
    occupied += leaf.occupied ? 1 : 0;
    require(m.log_odds(leaf.key) == leaf.log_odds, "a leaf's lowest voxel has the leaf's value");
    const std::uint32_t last = edge_in_voxels(m, leaf) - 1;
    require(m.log_odds(octree::voxel_key{leaf.key.x + last, leaf.key.y + last, leaf.key.z + last}) == leaf.log_odds,
            "a leaf's highest voxel has the leaf's value");
  });
  const octree::octree_counts counts = m.counts();
  require(counts.leaves == leaves && counts.occupied_leaves == occupied && counts.free_leaves == leaves - occupied,
          "the leaves counted are those visited");
  require(counts.nodes >= leaves && m.empty() == (leaves == 0), "nodes and emptiness agree with the leaves");

  const std::string ot = ot_bytes(m), bt = bt_bytes(m);
  const auto from_ot = octree::read_ot(bytes_of(ot));
  require(from_ot && ot_bytes(*from_ot) == ot, "an .ot file reads back to the same bytes");
  require(from_ot->counts().nodes == counts.nodes, "an .ot file keeps every node");
  const auto from_bt = octree::read_bt(bytes_of(bt));
  require(from_bt.has_value(), "a .bt file can be read");
  m.for_each_leaf([&](const map::leaf& leaf) {
    require(from_bt->state(leaf.key) == m.state(leaf.key), "a .bt file keeps what is free and what is occupied");
  });
  // OctoMap stops pruning at the first level where there is nothing to prune, and what it writes may have
  // more nodes than the map that is read back: then it is that map's file that stays the same.
  const std::string again = bt_bytes(*from_bt);
  require(again.size() <= bt.size(), "a .bt file does not grow when it is read and written");
  require(bt_bytes(octree::read_bt(bytes_of(again)).value()) == again, "a .bt file reads back to the same bytes");
  require(bt_bytes(*from_ot) == bt, "the .bt file of the .ot file is the map's");

  require(through_octomap_bt(bt) == data_of(bt), "OctoMap reads and writes the same .bt file");
  require(through_octomap_ot(ot, m.grid().resolution()) == data_of(ot), "OctoMap reads and writes the same .ot file");
}

/// `read(bytes)` gives an error with a reason, or a map in which everything holds; in either case it
/// takes memory in proportion to the bytes.
template <class Read>
void check_reader(std::span<const std::byte> bytes, Read&& read) {
  std::optional<result<map>> got;
  const std::size_t peak = peak_bytes_of([&] { got.emplace(read(bytes)); });
  require(peak <= memory_for_any_file + memory_per_file_byte * bytes.size(), "memory in proportion to the file");
  if (!*got) {
    const error& e = got->error();
    require(e.code == errc::malformed || e.code == errc::unsupported, "a damaged file is malformed or unsupported");
    require(!e.message.empty() && e.to_string().size() < 300, "the reason is given, and short");
    return;
  }
  accept();
  check_map(**got);
}

}  // namespace orbis::fuzz

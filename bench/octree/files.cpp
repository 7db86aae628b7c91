// SPDX-License-Identifier: BSD-3-Clause
//
// `.bt` and `.ot` of the map of 50 frames, in memory: the same bytes are written, the same bytes are read.
#include <memory>
#include <span>
#include <sstream>
#include <string>

#include <orbis/octree/files.hpp>

#include "octree/peers.hpp"

namespace orbis::bench {
namespace {

struct bt {
  static std::string write(const map& m) { return octree::bt_bytes(m); }
  static auto read(std::span<const std::byte> bytes) { return octree::read_bt(bytes); }
  static void write(octomap::OcTree& tree, std::ostream& out) { tree.writeBinary(out); }
  static std::unique_ptr<octomap::OcTree> read(std::istream& in) {
    auto tree = std::make_unique<octomap::OcTree>(0.1);
    if (!tree->readBinary(in)) tree.reset();
    return tree;
  }
};
struct ot {
  static std::string write(const map& m) { return octree::ot_bytes(m); }
  static auto read(std::span<const std::byte> bytes) { return octree::read_ot(bytes); }
  static void write(octomap::OcTree& tree, std::ostream& out) { tree.write(out); }
  static std::unique_ptr<octomap::OcTree> read(std::istream& in) {
    return std::unique_ptr<octomap::OcTree>{dynamic_cast<octomap::OcTree*>(octomap::AbstractOcTree::read(in))};
  }
};

template <class Format>
void bench_write(benchmark::State& state, double resolution) {
  const map& m = room_map(resolution);
  std::string file;
  for (auto _ : state) {
    file = Format::write(m);
    benchmark::DoNotOptimize(file);
  }
  state.counters["KB"] = static_cast<double>(file.size()) / 1e3;
}
template <class Format>
void bench_octomap_write(benchmark::State& state, double resolution) {
  std::string file;
  {
    const silence octomap_reports;
    for (auto _ : state) {
      state.PauseTiming();
      octomap::OcTree copy{room_octomap(resolution)};  // writing changes an OctoMap tree
      std::ostringstream out;
      state.ResumeTiming();
      Format::write(copy, out);
      state.PauseTiming();
      file = out.str();
      state.ResumeTiming();
    }
  }
  if (file != Format::write(room_map(resolution))) state.SkipWithError("not our file");
  state.counters["KB"] = static_cast<double>(file.size()) / 1e3;
}

template <class Format>
void bench_read(benchmark::State& state, double resolution) {
  const std::string file = Format::write(room_map(resolution));
  for (auto _ : state) {
    const auto m = Format::read(std::as_bytes(std::span{file}));
    if (!m) state.SkipWithError("not read");
    benchmark::DoNotOptimize(m);
  }
  if (Format::write(Format::read(std::as_bytes(std::span{file})).value()) != file)
    state.SkipWithError("not the map that was written");
}
template <class Format>
void bench_octomap_read(benchmark::State& state, double resolution) {
  const std::string file = Format::write(room_map(resolution));
  bool same = false;
  {
    const silence octomap_reports;
    for (auto _ : state) {
      std::istringstream in{file};
      const auto tree = Format::read(in);
      benchmark::DoNotOptimize(tree);
    }
    std::istringstream in{file};
    std::ostringstream out;
    if (const auto tree = Format::read(in)) Format::write(*tree, out);
    same = out.str() == file;
  }
  if (!same) state.SkipWithError("not the map that was written");
}

template <class Format>
void add_rows(const std::string& format, double r) {
  const std::string size = in_centimetres(r);
  add_row("octree_write_" + format + "/" + size + "/orbis", [=](auto& s) { bench_write<Format>(s, r); });
  add_row("octree_read_" + format + "/" + size + "/orbis", [=](auto& s) { bench_read<Format>(s, r); });
  add_row("octree_write_" + format + "/" + size + "/octomap", [=](auto& s) { bench_octomap_write<Format>(s, r); });
  add_row("octree_read_" + format + "/" + size + "/octomap", [=](auto& s) { bench_octomap_read<Format>(s, r); });
}

[[maybe_unused]] const bool registered = [] {
  for (const double resolution : {0.05, 0.02}) {
    add_rows<bt>("bt", resolution);
    add_rows<ot>("ot", resolution);
  }
  return true;
}();

}  // namespace
}  // namespace orbis::bench

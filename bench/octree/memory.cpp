// SPDX-License-Identifier: BSD-3-Clause
//
// The heap that the map of 50 frames takes: `map_MB` as the map itself says, `heap_MB` as the allocator
// does; for ours without and with the buffers kept for the next scan. The time is that of a copy.
#include <memory>

#include <malloc.h>

#include "octree/peers.hpp"

namespace orbis::bench {
namespace {

[[nodiscard]] double heap_megabytes() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd) / 1e6;
}

[[nodiscard]] std::unique_ptr<map> make_map(double resolution) {
  auto m = std::make_unique<map>(resolution);
  for (std::size_t i = 0; i != 50; ++i)
    m->integrate(room()[i].points(), room()[i].origin(), {.max_range = 5.0, .mode = octree::ray_mode::discretized});
  return m;
}

void bench_memory(benchmark::State& state, double resolution) {
  static_cast<void>(room());
  const double before = heap_megabytes();
  const auto m = make_map(resolution);
  const double after = heap_megabytes();
  for (auto _ : state) benchmark::DoNotOptimize(map{*m});
  state.counters["map_MB"] = static_cast<double>(m->memory_bytes()) / 1e6;
  state.counters["buffers_MB"] = static_cast<double>(m->buffer_bytes()) / 1e6;
  state.counters["heap_MB"] = after - before;
}
void bench_octomap_memory(benchmark::State& state, double resolution) {
  static_cast<void>(room_map(resolution));
  const double before = heap_megabytes();
  const auto tree = std::make_unique<octomap::OcTree>(to_octomap(room_map(resolution)));
  const double after = heap_megabytes();
  for (auto _ : state) benchmark::DoNotOptimize(octomap::OcTree{*tree});
  state.counters["map_MB"] = static_cast<double>(tree->memoryUsage()) / 1e6;
  state.counters["heap_MB"] = after - before;
}

[[maybe_unused]] const bool registered = [] {
  for (const double r : {0.10, 0.05, 0.02}) {
    add_row("octree_copy_and_memory/" + in_centimetres(r) + "/orbis", [=](auto& s) {
      bench_memory(s, r);
    })->Repetitions(1);
    add_row("octree_copy_and_memory/" + in_centimetres(r) + "/octomap", [=](auto& s) {
      bench_octomap_memory(s, r);
    })->Repetitions(1);
  }
  return true;
}();

}  // namespace
}  // namespace orbis::bench

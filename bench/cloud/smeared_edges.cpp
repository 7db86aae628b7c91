// SPDX-License-Identifier: BSD-3-Clause
//
// Removal of smeared edges from a depth image, for turns of 0.01 rad/s (nothing is smeared) to 1 rad/s.
#include <benchmark/benchmark.h>

#include <orbis/camera/any.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/cloud/smeared_edges.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/synthetic.hpp>

namespace orbis::bench {
namespace {

void remove_smeared_edges(benchmark::State& state) {
  const io::synthetic_recording room{{.frames = 10}};
  const camera::rgbd_frame frame = room.frame(3).value();
  const camera::any_camera camera = room.camera().model;
  vec6 twist = zeros<vec6>();
  twist[4] = 0.01 * static_cast<double>(state.range(0));
  image<float> out(frame.depth.width(), frame.depth.height());
  cloud::smeared_edge_workspace workspace;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        cloud::remove_smeared_edges(seq, frame.depth_metres(), camera, twist, 0.016, out, {}, workspace));
}
BENCHMARK(remove_smeared_edges)
    ->Name("remove_smeared_edges/640x480/turn_percent")
    ->Arg(1)
    ->Arg(25)
    ->Arg(100)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace orbis::bench

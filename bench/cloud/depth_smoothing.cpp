// SPDX-License-Identifier: BSD-3-Clause
//
// Smoothing of a depth image beside OpenCV's bilateral filter with the same window.
#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/cloud/depth_smoothing.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/io/synthetic.hpp>

namespace orbis::bench {
namespace {

[[nodiscard]] const camera::rgbd_frame& room_frame() {
  static const camera::rgbd_frame frame = io::synthetic_recording{{.frames = 10}}.frame(3).value();
  return frame;
}

void smooth_depth_orbis(benchmark::State& state) {
  const camera::rgbd_frame& frame = room_frame();
  image<float> out(frame.depth.width(), frame.depth.height()), memory;
  for (auto _ : state) cloud::smooth_depth(seq, frame.depth_metres(), out, {}, memory);
}
BENCHMARK(smooth_depth_orbis)->Name("smooth_depth/640x480/radius:3/orbis")->Unit(benchmark::kMillisecond);

void smooth_depth_opencv(benchmark::State& state) {
  const camera::rgbd_frame& frame = room_frame();
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  cv::Mat inverse(frame.depth.height(), frame.depth.width(), CV_32F), out;
  for (int y = 0; y != inverse.rows; ++y)
    for (int x = 0; x != inverse.cols; ++x) {
      const float z = frame.depth_metres()(x, y);
      inverse.at<float>(y, x) = z > 0.0F ? 1.0F / z : 0.0F;
    }
  for (auto _ : state) cv::bilateralFilter(inverse, out, 7, 0.005, 3.0);
  cv::setNumThreads(threads);
}
BENCHMARK(smooth_depth_opencv)->Name("smooth_depth/640x480/radius:3/opencv_bilateral")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace orbis::bench

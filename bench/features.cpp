// SPDX-License-Identifier: BSD-3-Clause
//
// Feature extraction and matching beside OpenCV's.
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include <orbis/core/random.hpp>
#include <orbis/features.hpp>
#include <orbis/interop/opencv.hpp>

namespace {

using namespace orbis;
using descriptor = features::binary_descriptor<256>;

std::vector<descriptor> random_descriptors(std::size_t count, std::uint64_t seed) {
  random_bits random{seed};
  std::vector<descriptor> descriptors(count);
  for (descriptor& d : descriptors)
    for (auto& word : d.words) word = random();
  return descriptors;
}

cv::Mat rows_of(const std::vector<descriptor>& d) { return interop::mat_over(std::span<const descriptor>{d}); }

template <class Matcher>
void match_orbis(benchmark::State& state, std::size_t count, const Matcher& matcher) {
  const auto a = random_descriptors(count, 1);
  const auto b = random_descriptors(count, 2);
  for (auto _ : state) benchmark::DoNotOptimize(matcher(a, b));
}

void match_opencv_knn2(benchmark::State& state, std::size_t count) {
  const auto a = random_descriptors(count, 1);
  const auto b = random_descriptors(count, 2);
  const cv::BFMatcher matcher(cv::NORM_HAMMING);
  for (auto _ : state) {
    std::vector<std::vector<cv::DMatch>> matches;
    matcher.knnMatch(rows_of(a), rows_of(b), matches, 2);
    benchmark::DoNotOptimize(matches);
  }
}

void match_opencv_cross_check(benchmark::State& state, std::size_t count) {
  const auto a = random_descriptors(count, 1);
  const auto b = random_descriptors(count, 2);
  const cv::BFMatcher matcher(cv::NORM_HAMMING, true);
  for (auto _ : state) {
    std::vector<cv::DMatch> matches;
    matcher.match(rows_of(a), rows_of(b), matches);
    benchmark::DoNotOptimize(matches);
  }
}

/// A 640x480 picture with blocks and gradients at several scales, some parts of it poor: about as
/// many corners as a room.
image<std::uint8_t> picture() {
  image<std::uint8_t> im(640, 480);
  for (int y = 0; y != im.height(); ++y)
    for (int x = 0; x != im.width(); ++x) {
      const auto at = [&](int cell, std::uint64_t salt) {
        return mix64(salt + static_cast<std::uint64_t>((y / cell) * 1000 + x / cell)) % 128;
      };
      const bool rich = at(80, 1) < 50;
      const auto noise = mix64(static_cast<std::uint64_t>(y * 640 + x)) % 5;
      im(x, y) = static_cast<std::uint8_t>(x / 16 + y / 16 + at(53, 2) / 2 + (rich ? at(9, 3) / 2 : 0) + noise);
    }
  return im;
}

void orb_orbis(benchmark::State& state) {
  const auto im = picture();
  const features::orb_extractor extract{{.max_features = 1000, .levels = 8, .scale_factor = 1.2f}};
  for (auto _ : state) benchmark::DoNotOptimize(extract(im));
}

void orb_opencv(benchmark::State& state) {
  const auto im = picture();
  const auto orb = cv::ORB::create(1000, 1.2F, 8);
  for (auto _ : state) {
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    orb->detectAndCompute(interop::mat_over(im.view()), {}, keypoints, descriptors);
    benchmark::DoNotOptimize(keypoints);
  }
}

const bool registered = [] {
  cv::setNumThreads(1);  // as ours have
  using features::brute_force, features::cross_check, features::hamming, features::ratio_test;
  for (const std::size_t count : {std::size_t{1000}, std::size_t{2000}}) {
    const std::string group = "matching/" + std::to_string(count) + "x" + std::to_string(count);
    const auto add = [&](const std::string& name, auto function) {
      benchmark::RegisterBenchmark((group + name).c_str(), function)->Unit(benchmark::kMillisecond);
    };
    const auto orbis_knn2 = [count](auto& s) { match_orbis(s, count, brute_force(hamming{}) | ratio_test{1.0F}); };
    const auto orbis_cross = [count](auto& s) { match_orbis(s, count, brute_force(hamming{}) | cross_check{}); };
    add("/knn2/orbis", orbis_knn2);
    add("/knn2/opencv", [count](auto& s) { match_opencv_knn2(s, count); });
    add("/cross_check/orbis", orbis_cross);
    add("/cross_check/opencv", [count](auto& s) { match_opencv_cross_check(s, count); });
  }
  benchmark::RegisterBenchmark("orb/640x480/1000/orbis", orb_orbis)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("orb/640x480/1000/opencv", orb_opencv)->Unit(benchmark::kMillisecond);
  return true;
}();

}  // namespace

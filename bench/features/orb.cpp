// SPDX-License-Identifier: BSD-3-Clause
//
// Feature extraction beside OpenCV's: time, stage by stage, and how well the features are found again.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/features.hpp>
#include <orbis/interop/opencv.hpp>
#include <orbis/io/image.hpp>

#include "features/opencv_orb.hpp"
#include "features/repeatability.hpp"

namespace {

using namespace orbis;
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
      im(x, y) = static_cast<std::uint8_t>(static_cast<std::uint64_t>(x / 16 + y / 16) + at(53, 2) / 2 +
                                           (rich ? at(9, 3) / 2 : 0) + noise);
    }
  return im;
}

/// A frame of the kitchen, where the recording is; else none.
image<std::uint8_t> kitchen() {
  std::vector<std::filesystem::path> files;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(ORBIS_DATA_DIR "/kitchen/rgb", none))
    files.push_back(entry.path());
  if (files.size() < 200) return {};
  std::sort(files.begin(), files.end());
  const auto color = io::read_color(files[199]);
  if (!color) return {};
  image<std::uint8_t> grey(color->width(), color->height());
  features::luma(*color, grey);
  return grey;
}

/// As many features as OpenCV's ORB finds, for the comparison at equal numbers.
features::features found_by_orbis(const image<std::uint8_t>& im, std::size_t count) {
  return features::orb_extractor{{.max_features = static_cast<int>(count)}}(im);
}

/// Coverage of the image, and means over its changes (turns, scales, perspective, blur, noise, light), at the
/// number of features that OpenCV finds.
template <class Find>
void count_quality(benchmark::State& state, const image<std::uint8_t>& im, const Find& find) {
  const auto f = find(im, test::found_by_opencv(im).size());
  const auto changes = test::changes_of(im);
  double repeatability = 0.0, matching_score = 0.0;
  for (const auto& c : changes) {
    const auto g = find(c.pixels, test::found_by_opencv(c.pixels).size());
    const auto again = test::compared(f, g, c.map, im.width(), im.height());
    repeatability += again.repeatability / static_cast<double>(changes.size());
    matching_score += again.matching_score / static_cast<double>(changes.size());
  }
  state.counters["features"] = static_cast<double>(f.size());
  state.counters["coverage"] = test::coverage(f, im.width(), im.height());
  state.counters["repeatability"] = repeatability;
  state.counters["matching_score"] = matching_score;
}

void orb_orbis(benchmark::State& state, const image<std::uint8_t>& im, simd::level level) {
  const simd::level_limit limit{level};
  const features::orb_extractor extract{{.max_features = 1000, .levels = 8, .scale_factor = 1.2f}};
  for (auto _ : state) benchmark::DoNotOptimize(extract(im));
  if (level == simd::level::avx512) count_quality(state, im, found_by_orbis);  // the same at every level
}

void orb_opencv(benchmark::State& state, const image<std::uint8_t>& im) {
  const auto orb = cv::ORB::create(1000, 1.2F, 8);
  for (auto _ : state) {
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    orb->detectAndCompute(interop::mat_over(im.view()), {}, keypoints, descriptors);
    benchmark::DoNotOptimize(keypoints);
  }
  count_quality(state, im, [](const auto& each, std::size_t) { return test::found_by_opencv(each); });
}

/// The stages of extraction, each with what the ones before it left.
struct stages {
  explicit stages(const image<std::uint8_t>& im) {
    pyramid.build(im, 8, 1.2, 39);
    levels.resize(pyramid.size());
    for (std::size_t i = 0; i != pyramid.size(); ++i) {
      levels[i].area = {19, 19, pyramid[i].width() - 38, pyramid[i].height() - 38};
      levels[i].scale = static_cast<double>(im.width()) / pyramid[i].width();
      detect(i);
    }
    chosen = levels;
    choose(chosen, 1000, distribution);
  }
  void detect(std::size_t i) { fast(pyramid[i], levels[i].area, {14, 3}, corners, levels[i].corners); }

  features::image_pyramid pyramid;
  features::fast9 fast;
  features::fast9::workspace corners;
  features::cover_first choose;
  features::cover_first::workspace distribution;
  std::vector<features::level_corners> levels, chosen;
};

void pyramid_orbis(benchmark::State& state, const image<std::uint8_t>& im, simd::level level) {
  const simd::level_limit limit{level};
  stages s{im};
  for (auto _ : state) {
    s.pyramid.build(im, 8, 1.2, 39);
    benchmark::ClobberMemory();
  }
}

void pyramid_opencv(benchmark::State& state, const image<std::uint8_t>& im) {
  std::vector<cv::Mat> levels(8);
  levels[0] = interop::mat_over(im.view());
  for (auto _ : state) {
    double scale = 1.0;
    for (std::size_t i = 1; i != levels.size(); ++i) {
      scale *= 1.2;
      const cv::Size size(cvRound(im.width() / scale), cvRound(im.height() / scale));
      cv::resize(levels[i - 1], levels[i], size, 0, 0, cv::INTER_LINEAR_EXACT);
    }
    benchmark::ClobberMemory();
  }
}

void fast_orbis(benchmark::State& state, const image<std::uint8_t>& im, simd::level level) {
  const simd::level_limit limit{level};
  stages s{im};
  for (auto _ : state)
    for (std::size_t i = 0; i != s.pyramid.size(); ++i) s.detect(i);
}

void fast_opencv(benchmark::State& state, const image<std::uint8_t>& im) {
  stages s{im};
  std::vector<cv::KeyPoint> keypoints;
  for (auto _ : state)
    for (std::size_t i = 0; i != s.pyramid.size(); ++i) cv::FAST(interop::mat_over(s.pyramid[i]), keypoints, 7, true);
}

void distribution_orbis(benchmark::State& state, const image<std::uint8_t>& im, simd::level level) {
  const simd::level_limit limit{level};
  stages s{im};
  for (auto _ : state) {
    s.chosen = s.levels;
    s.choose(s.chosen, 1000, s.distribution);
  }
}

void orientation_orbis(benchmark::State& state, const image<std::uint8_t>& im, simd::level level) {
  const simd::level_limit limit{level};
  stages s{im};
  for (auto _ : state)
    for (std::size_t i = 0; i != s.pyramid.size(); ++i)
      for (const features::corner& c : s.chosen[i].corners)
        benchmark::DoNotOptimize(features::intensity_centroid{}(s.pyramid[i], c.x, c.y));
}

void smooth_orbis(benchmark::State& state, const image<std::uint8_t>& im, simd::level level) {
  const simd::level_limit limit{level};
  stages s{im};
  features::steered_brief::workspace memory;
  for (auto _ : state)
    for (std::size_t i = 0; i != s.pyramid.size(); ++i)
      features::steered_brief{}.prepare(s.pyramid[i], 0, s.pyramid[i].height(), memory);
}

void smooth_opencv(benchmark::State& state, const image<std::uint8_t>& im) {
  stages s{im};
  cv::Mat smoothed;
  for (auto _ : state)
    for (std::size_t i = 0; i != s.pyramid.size(); ++i)
      cv::GaussianBlur(interop::mat_over(s.pyramid[i]), smoothed, {7, 7}, 2, 2, cv::BORDER_REFLECT_101);
}

void brief_orbis(benchmark::State& state, const image<std::uint8_t>& im, simd::level level) {
  const simd::level_limit limit{level};
  stages s{im};
  std::vector<features::steered_brief::workspace> memory(s.pyramid.size());
  for (std::size_t i = 0; i != s.pyramid.size(); ++i)
    features::steered_brief{}.prepare(s.pyramid[i], 0, s.pyramid[i].height(), memory[i]);
  const features::orientation direction{0.5F, 0.87758F, 0.47943F};
  for (auto _ : state)
    for (std::size_t i = 0; i != s.pyramid.size(); ++i)
      for (const features::corner& c : s.chosen[i].corners)
        benchmark::DoNotOptimize(features::steered_brief{}(memory[i], c.x, c.y, direction));
}

void register_extraction(const std::string& scene, const image<std::uint8_t>& im) {
  const auto add = [](const std::string& name, auto function) {
    benchmark::RegisterBenchmark(name.c_str(), function)->Unit(benchmark::kMillisecond);
  };
  for (const auto& [who, level] : {std::pair{"orbis_portable", simd::level::portable},
                                   {"orbis_avx2", simd::level::avx2},
                                   {"orbis", simd::level::avx512}})
    add("orb/" + scene + "/whole/" + who, [im, level = level](auto& s) { orb_orbis(s, im, level); });
  add("orb/" + scene + "/whole/opencv", [im](auto& s) { orb_opencv(s, im); });
  const auto stage = [&](const std::string& name, auto function) {
    add("orb/" + scene + "/" + name + "/orbis", [=](auto& s) { function(s, im, simd::level::avx512); });
    add("orb/" + scene + "/" + name + "/orbis_portable", [=](auto& s) { function(s, im, simd::level::portable); });
  };
  stage("pyramid", pyramid_orbis);
  add("orb/" + scene + "/pyramid/opencv", [im](auto& s) { pyramid_opencv(s, im); });
  stage("fast", fast_orbis);
  add("orb/" + scene + "/fast/opencv", [im](auto& s) { fast_opencv(s, im); });
  stage("distribution", distribution_orbis);
  stage("orientation", orientation_orbis);
  stage("smooth", smooth_orbis);
  add("orb/" + scene + "/smooth/opencv", [im](auto& s) { smooth_opencv(s, im); });
  stage("brief", brief_orbis);
}

const bool registered = [] {
  cv::setNumThreads(1);  // as ours have
  register_extraction("640x480", picture());
  if (const auto im = kitchen(); !im.empty()) register_extraction("kitchen", im);
  return true;
}();

}  // namespace

// SPDX-License-Identifier: BSD-3-Clause
//
// Matchers: brute force at every SIMD level beside OpenCV's and beside a plain loop of POPCNT, the sources that compare
// only some pairs, and how many matches are right between frames of a real recording.
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/features.hpp>
#include <orbis/interop/opencv.hpp>

#include "features/opencv_orb.hpp"
#include "features/two_frames.hpp"

namespace {

using namespace orbis;
using namespace orbis::features;
using descriptor = binary_descriptor<256>;

const std::array<std::pair<const char*, simd::level>, 4> levels{{{"orbis_portable", simd::level::portable},
                                                                 {"orbis_popcnt", simd::level::popcnt},
                                                                 {"orbis_avx2", simd::level::avx2},
                                                                 {"orbis", simd::level::avx512}}};  // the best there is

/// Features of a 640x480 image.
orbis::features::features random_features(std::size_t count, std::uint64_t seed) {
  random_bits random{seed};
  orbis::features::features f;
  for (std::size_t i = 0; i != count; ++i) {
    f.keypoints.push_back({.x = static_cast<float>(random.uniform(0.0, 640.0)),
                           .y = static_cast<float>(random.uniform(0.0, 480.0)),
                           .octave = static_cast<int>(random.below(8))});
    descriptor d;
    for (auto& word : d.words) word = random();
    f.descriptors.push_back(d);
  }
  return f;
}

cv::Mat rows_of(const orbis::features::features& f) {
  return interop::mat_over(std::span<const descriptor>{f.descriptors});
}

/// What anyone would write first.
ORBIS_TARGET("popcnt")
void popcnt_loop(const std::vector<descriptor>& queries, const std::vector<descriptor>& trains,
                 std::vector<features::detail::nearest_two>& nearest) {
  for (std::size_t i = 0; i != queries.size(); ++i) {
    const auto q = queries[i].words;
    features::detail::nearest_two best;
    for (std::size_t j = 0; j != trains.size(); ++j) {
      const auto& t = trains[j].words;
      const auto d = static_cast<std::uint32_t>(__builtin_popcountll(q[0] ^ t[0]) + __builtin_popcountll(q[1] ^ t[1]) +
                                                __builtin_popcountll(q[2] ^ t[2]) + __builtin_popcountll(q[3] ^ t[3]));
      if (d < best.distance) {
        best = {static_cast<std::uint32_t>(j), d, best.distance};
      } else if (d < best.second_distance) {
        best.second_distance = d;
      }
    }
    nearest[i] = best;
  }
}

template <class Function>
void add_row(const std::string& name, Function function) {
  benchmark::RegisterBenchmark(name.c_str(), function)->Unit(benchmark::kMillisecond);
}

/// A row for a matcher, with its memory kept, as a caller does it for every frame.
template <class Matcher, class... Where>
void add_matcher(const std::string& name, simd::level level, const Matcher& matcher, std::size_t count,
                 Where... where) {
  add_row(name, [=](benchmark::State& state) {
    const simd::level_limit limit{level};
    const auto a = random_features(count, 1), b = random_features(count, 2);
    std::vector<match> matches;
    typename Matcher::workspace memory;
    for (auto _ : state) {
      matcher.match_into(matches, memory, a, b, where...);
      benchmark::DoNotOptimize(matches.data());
    }
    state.counters["matches"] = static_cast<double>(matches.size());
  });
}

void add_brute_force(std::size_t count) {
  const std::string group = "matching/" + std::to_string(count) + "x" + std::to_string(count);
  for (const auto& [name, level] : levels) {
    add_matcher(group + "/knn2/" + name, level, brute_force(hamming{}) | ratio_test{1.0F}, count);
    add_matcher(group + "/cross_check/" + name, level, brute_force(hamming{}) | cross_check{}, count);
  }
  add_row(group + "/knn2/popcnt64_loop", [count](benchmark::State& state) {
    const auto a = random_features(count, 1), b = random_features(count, 2);
    std::vector<features::detail::nearest_two> nearest(count);
    for (auto _ : state) {
      popcnt_loop(a.descriptors, b.descriptors, nearest);
      benchmark::DoNotOptimize(nearest.data());
    }
  });
  add_row(group + "/knn2/opencv", [count](benchmark::State& state) {
    const auto a = random_features(count, 1), b = random_features(count, 2);
    const cv::BFMatcher matcher(cv::NORM_HAMMING);
    for (auto _ : state) {
      std::vector<std::vector<cv::DMatch>> matches;
      matcher.knnMatch(rows_of(a), rows_of(b), matches, 2);
      benchmark::DoNotOptimize(matches.data());
    }
  });
  for (const bool crossed : {false, true})
    add_row(group + (crossed ? "/cross_check/opencv" : "/match/opencv"), [count, crossed](benchmark::State& state) {
      const auto a = random_features(count, 1), b = random_features(count, 2);
      const cv::BFMatcher matcher(cv::NORM_HAMMING, crossed);
      for (auto _ : state) {
        std::vector<cv::DMatch> matches;
        matcher.match(rows_of(a), rows_of(b), matches);
        benchmark::DoNotOptimize(matches.data());
      }
    });
}

void add_guided(std::size_t count) {
  const std::string group = "guided_matching/" + std::to_string(count) + "x" + std::to_string(count);
  const auto queries = random_features(count, 1);
  std::vector<window> windows;
  std::vector<vec3> points;
  for (const keypoint& k : queries.keypoints) {
    windows.push_back({k.x, k.y, 20.0F, k.octave - 1, k.octave + 1});
    points.push_back(vec3{2.0 * (k.x - 320.0) / 500.0, 2.0 * (k.y - 240.0) / 500.0, 2.0});
  }
  const camera::pinhole camera{640, 480, 500.0, 500.0, 320.0, 240.0};
  const camera_projection project{camera, se3{}};
  mat3 K;
  K << 500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0;
  const test::fundamental_geometry geometry{K, K, se3{so3::exp(vec3{0.0, 0.05, 0.0}), vec3{0.2, 0.02, 0.03}}};

  for (const auto& [name, level] : {levels[0], levels[3]}) {  // there are two kernels
    const std::string who = std::string("/") + name;
    add_matcher(group + "/windowed_20px" + who, level, windowed(hamming{}) | unique{}, count, windows);
    add_matcher(group + "/projected_20px" + who, level, projected(hamming{}, {.radius = 20.0F}) | unique{}, count,
                points, project);
    add_matcher(group + "/epipolar" + who, level, epipolar(hamming{}) | unique{}, count, geometry);
  }
}

/// Pairs of frames of the kitchen: time for a pair, the share of the matches (with depth) that are right, and how many
/// these are. OpenCV's: the features of cv::ORB by the first of our matchers.
void add_two_frames(std::size_t gap) {
  const auto row = [gap](std::size_t which, bool opencv) {
    return [=](benchmark::State& state) {
      const auto recording = io::open_recording(ORBIS_DATA_DIR "/kitchen").value();
      const orb_extractor extract{{.max_features = 1000}};
      const auto found = [&](image_view<const rgb8> color) {
        image<std::uint8_t> grey(color.width(), color.height());
        luma(color, grey);
        return opencv ? test::found_by_opencv(grey) : extract(grey);
      };
      std::vector<std::pair<test::seen_frame, test::seen_frame>> pairs;
      for (const std::size_t i : {0U, 100U, 200U, 300U, 400U})
        pairs.emplace_back(test::look(recording, i, found), test::look(recording, i + gap, found));
      std::size_t next = 0;
      for (auto _ : state) {
        const auto& [a, b] = pairs[next++ % pairs.size()];
        benchmark::DoNotOptimize(test::matches_by(which, a, b, gap));
      }
      test::match_rate sum;
      for (const auto& [a, b] : pairs) {
        const test::match_rate r = test::judge(test::matches_by(which, a, b, gap), a, b);
        sum.right += r.right;
        sum.judged += r.judged;
      }
      state.counters["share_right"] = sum.share();
      state.counters["right"] = sum.right / static_cast<double>(pairs.size());
    };
  };
  const std::string group = "two_frames/kitchen_gap_" + std::to_string(gap);
  for (std::size_t which = 0; which != test::matcher_names.size(); ++which)
    add_row(group + "/" + test::matcher_names[which] + "/orbis", row(which, false));
  add_row(group + "/" + test::matcher_names[0] + "/opencv_features", row(0, true));
}

const bool registered = [] {
  cv::setNumThreads(1);  // as ours have
  if (std::filesystem::exists(ORBIS_DATA_DIR "/kitchen"))
    for (const std::size_t gap : {1U, 5U, 15U}) add_two_frames(gap);
  for (const std::size_t count : {std::size_t{1000}, std::size_t{2000}}) {
    add_brute_force(count);
    add_guided(count);
  }
  return true;
}();

}  // namespace

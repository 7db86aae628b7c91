// SPDX-License-Identifier: BSD-3-Clause
//
// Closed-form and minimal solvers: poses from matches with outliers beside OpenCV's, absolute orientation beside
// Eigen's. Every row walks through the same scenes; counters tell how far off the answers are, and how many of them
// are no answers.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <benchmark/benchmark.h>
#include <opencv2/calib3d.hpp>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/optimize/alignment.hpp>
#include <orbis/optimize/detail/minimal/p3p_equations.hpp>
#include <orbis/optimize/pnp.hpp>
#include <orbis/optimize/two_view.hpp>

namespace orbis::bench {
namespace {

const camera::pinhole the_camera{640, 480, 525, 525, 320, 240};
constexpr double threshold = 4.0;
constexpr std::size_t scenes_of_a_row = 50;

vec3 random_vector(random_bits& random, double bound) {
  return {random.uniform(-bound, bound), random.uniform(-bound, bound), random.uniform(-bound, bound)};
}
se3 random_pose(random_bits& random) {
  const vec3 axis = random_vector(random, 1.0).normalized();
  return {so3::exp(random.uniform(0.0, 3.1) * axis), random_vector(random, 3.0)};
}
/// In the camera, one to five metres in front of it.
vec3 point_in_view(random_bits& random) {
  const double z = random.uniform(1.0, 5.0);
  return {random.uniform(-0.5, 0.5) * z, random.uniform(-0.4, 0.4) * z, z};
}

struct pnp_scene {
  se3 truth;
  std::vector<vec3> points;
  std::vector<vec2> pixels;
  std::vector<cv::Point3d> cv_points;
  std::vector<cv::Point2d> cv_pixels;
};

/// 500 matches with one pixel of noise; outliers are anywhere in the image.
pnp_scene make_pnp_scene(std::uint64_t seed, double outliers) {
  random_bits random(seed);
  pnp_scene s;
  s.truth = random_pose(random);
  constexpr std::size_t n = 500;
  const auto good = static_cast<std::size_t>(std::lround(n * (1.0 - outliers)));
  for (std::size_t i = 0; i != n; ++i) {
    const vec3 p = point_in_view(random);
    s.points.push_back(s.truth * p);
    if (i < good) {
      const double du = random.normal(), dv = random.normal();
      s.pixels.push_back(*the_camera.project(p) + vec2(du, dv));
    } else {
      const double u = random.uniform(0, 640), v = random.uniform(0, 480);
      s.pixels.emplace_back(u, v);
    }
    s.cv_points.emplace_back(s.points[i].x(), s.points[i].y(), s.points[i].z());
    s.cv_pixels.emplace_back(s.pixels[i].x(), s.pixels[i].y());
  }
  return s;
}

const std::vector<pnp_scene>& pnp_scenes(int percent) {
  static std::map<int, std::vector<pnp_scene>> kept;
  auto& scenes = kept[percent];
  if (scenes.empty())
    for (std::uint64_t seed = 1; seed <= scenes_of_a_row; ++seed)
      scenes.push_back(make_pnp_scene(seed, 0.01 * percent));
  return scenes;
}

/// The pose found, or nothing.
using pose_finder = std::function<bool(const pnp_scene&, se3& T_world_camera)>;

pose_finder by_opencv(int method) {
  return [method](const pnp_scene& s, se3& pose) {
    const cv::Matx33d k(525, 0, 320, 0, 525, 240, 0, 0, 1);
    cv::Vec3d r, t;
    cv::Mat inliers;
    if (!cv::solvePnPRansac(s.cv_points, s.cv_pixels, k, cv::noArray(), r, t, false, 10000,
                            static_cast<float>(threshold), 0.9999, inliers, method))
      return false;
    pose = se3(so3::exp(vec3(r[0], r[1], r[2])), vec3(t[0], t[1], t[2])).inverse();
    return true;
  };
}

void add_pnp(int percent, const char* who, const pose_finder& find) {
  const std::string name = "pnp/500_points_" + std::to_string(percent) + "_percent_outliers/" + who;
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    const auto& scenes = pnp_scenes(percent);
    se3 pose;
    // What is found does not depend on how often it is timed.
    double failures = 0, millimetres = 0;
    for (const pnp_scene& s : scenes) {
      const double off = find(s, pose) ? (pose.translation() - s.truth.translation()).norm() : 1.0;
      off < 0.1 ? millimetres += 1e3 * off : failures += 1.0;
    }
    std::size_t k = 0;
    for (auto _ : state) {
      benchmark::DoNotOptimize(find(scenes[k], pose));
      k = (k + 1) % scenes.size();
    }
    const auto n = static_cast<double>(scenes.size());
    state.counters["failed_%"] = 100.0 * failures / n;
    state.counters["error_mm"] = millimetres / std::max(1.0, n - failures);
  })->Unit(benchmark::kMillisecond);
}

struct pairs {
  std::vector<vec3> from, to;
  Eigen::Matrix3Xd from_columns, to_columns;
};

pairs make_pairs(std::size_t n) {
  random_bits random(n);
  pairs p;
  const se3 truth = random_pose(random);
  p.from_columns.resize(3, static_cast<Eigen::Index>(n));
  p.to_columns.resize(3, static_cast<Eigen::Index>(n));
  for (std::size_t i = 0; i != n; ++i) {
    p.from.push_back(random_vector(random, 2.0));
    p.to.push_back(truth * p.from.back() + random_vector(random, 0.02));
    p.from_columns.col(static_cast<Eigen::Index>(i)) = p.from.back();
    p.to_columns.col(static_cast<Eigen::Index>(i)) = p.to.back();
  }
  return p;
}

void add_orientation(std::size_t n) {
  const std::string group = "absolute_orientation/" + std::to_string(n) + "_pairs/";
  benchmark::RegisterBenchmark((group + "orbis").c_str(), [n](benchmark::State& state) {
    const pairs p = make_pairs(n);
    for (auto _ : state) benchmark::DoNotOptimize(optimize::absolute_orientation(p.from, p.to));
  })->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark((group + "eigen_umeyama").c_str(), [n](benchmark::State& state) {
    const pairs p = make_pairs(n);
    for (auto _ : state) {
      const Eigen::Matrix4d t = Eigen::umeyama(p.from_columns, p.to_columns, false);
      benchmark::DoNotOptimize(t.data());
    }
  })->Unit(benchmark::kMicrosecond);
}

void add_p3p() {
  struct sample {
    std::array<vec3, 3> points, rays;
    se3 truth;
  };
  static const std::vector<sample> samples = [] {
    std::vector<sample> all(1000);
    random_bits random(1);
    for (sample& s : all) {
      s.truth = random_pose(random);
      for (std::size_t i = 0; i != 3; ++i) {
        const vec3 p = point_in_view(random);
        s.rays[i] = p / p.z();
        s.points[i] = s.truth * p;
      }
    }
    return all;
  }();
  benchmark::RegisterBenchmark("p3p/one_sample/orbis", [](benchmark::State& state) {
    std::size_t k = 0;
    for (auto _ : state) {
      const auto& r = samples[k].rays;
      const std::array<vec3, 3> rays{r[0].normalized(), r[1].normalized(), r[2].normalized()};
      optimize::detail::for_each_p3p(samples[k].points, rays, [](const mat3& rotation, const vec3& at) {
        benchmark::DoNotOptimize(se3(so3(rotation), at).inverse());
      });
      k = (k + 1) % samples.size();
    }
  })->Unit(benchmark::kMicrosecond);
  for (const auto& [who, method] : {std::pair{"cv_p3p", cv::SOLVEPNP_P3P}, std::pair{"cv_ap3p", cv::SOLVEPNP_AP3P}})
    benchmark::RegisterBenchmark((std::string("p3p/one_sample/") + who).c_str(), [method =
                                                                                      method](benchmark::State& state) {
      std::size_t k = 0;
      std::vector<cv::Mat> rotations, translations;
      for (auto _ : state) {
        std::array<cv::Point3d, 3> points;
        std::array<cv::Point2d, 3> rays;
        for (std::size_t i = 0; i != 3; ++i) {
          const sample& s = samples[k];
          points[i] = {s.points[i].x(), s.points[i].y(), s.points[i].z()};
          rays[i] = {s.rays[i].x(), s.rays[i].y()};
        }
        benchmark::DoNotOptimize(
            cv::solveP3P(points, rays, cv::Matx33d::eye(), cv::noArray(), rotations, translations, method));
        k = (k + 1) % samples.size();
      }
    })->Unit(benchmark::kMicrosecond);
}

/// 500 matches of two images with half a pixel of noise, of points in space or in a plane; half of them are wrong.
struct image_pair {
  se3 T_first_second;
  std::vector<vec2> first, second;
  std::vector<cv::Point2d> cv_first, cv_second;
};

image_pair make_image_pair(std::uint64_t seed, bool planar) {
  random_bits random(seed);
  image_pair s;
  s.T_first_second = se3(so3::exp(random_vector(random, 0.15)), 0.5 * random_vector(random, 1.0).normalized());
  while (s.first.size() != 500) {
    vec3 p = point_in_view(random);
    if (planar) p *= 3.0 / (p.z() + 0.3 * p.x());
    const auto a = the_camera.project(p), b = the_camera.project(s.T_first_second.inverse() * p);
    const vec2 noise_a(random.normal(), random.normal()), noise_b(random.normal(), random.normal());
    const vec2 anywhere(random.uniform(0, 640), random.uniform(0, 480));
    if (!a || !b) continue;
    s.first.push_back(*a + 0.5 * noise_a);
    s.second.push_back(s.first.size() <= 250 ? vec2(*b + 0.5 * noise_b) : anywhere);
    s.cv_first.emplace_back(s.first.back().x(), s.first.back().y());
    s.cv_second.emplace_back(s.second.back().x(), s.second.back().y());
  }
  return s;
}

const std::vector<image_pair>& image_pairs(bool planar) {
  static std::array<std::vector<image_pair>, 2> kept;
  auto& pairs = kept[planar ? 1 : 0];
  if (pairs.empty())
    for (std::uint64_t seed = 1; seed <= 20; ++seed) pairs.push_back(make_image_pair(seed, planar));
  return pairs;
}

/// `error(pair)` finds something and says how far off it is, NaN where there is nothing.
void add_two_views(const char* what, const char* who, bool planar, const char* unit,
                   const std::function<double(const image_pair&)>& error) {
  const std::string name = std::string(what) + "/500_matches_50_percent_outliers/" + who;
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    const auto& pairs = image_pairs(planar);
    std::vector<double> errors;
    for (const image_pair& p : pairs)
      if (const double e = error(p); e == e) errors.push_back(e);
    std::size_t k = 0;
    for (auto _ : state) {
      benchmark::DoNotOptimize(error(pairs[k]));
      k = (k + 1) % pairs.size();
    }
    std::sort(errors.begin(), errors.end());
    state.counters["failed"] = static_cast<double>(pairs.size() - errors.size());
    if (!errors.empty()) state.counters[unit] = errors[errors.size() / 2];
  })->Unit(benchmark::kMillisecond);
}

/// Between the directions of two translations, degrees.
double direction_error(const se3& a, const se3& b) {
  const double cosine = a.translation().normalized().dot(b.translation().normalized());
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 57.29577951308232;
}

/// The largest error in the image's corners, pixels.
double corner_error(const mat3& h, const image_pair& pair) {
  const mat3 k = (mat3() << 525, 0, 320, 0, 525, 240, 0, 0, 1).finished();
  const se3 motion = pair.T_first_second.inverse();
  const vec3 normal = vec3(0.3, 0.0, 1.0) / 3.0;  // z + 0.3 x = 3
  const mat3 truth = k * (motion.rotation_matrix() + motion.translation() * normal.transpose()) * k.inverse();
  double worst = 0.0;
  for (const vec2& c : {vec2(0, 0), vec2(640, 0), vec2(0, 480), vec2(640, 480)})
    worst = std::max(worst, ((h * c.homogeneous()).hnormalized() - (truth * c.homogeneous()).hnormalized()).norm());
  return worst;
}

void add_essential_and_homography() {
  add_two_views("essential", "orbis", false, "median_deg", [](const image_pair& p) {
    const auto found = optimize::estimate_essential(p.first, p.second, the_camera, {.threshold = 1.5});
    return found ? direction_error(found->T_first_second, p.T_first_second) : std::nan("");
  });
  const auto by_cv = [](int method) {
    return [method](const image_pair& p) {
      const cv::Mat k = (cv::Mat_<double>(3, 3) << 525, 0, 320, 0, 525, 240, 0, 0, 1);
      cv::Mat inliers, r, t;
      const cv::Mat e = cv::findEssentialMat(p.cv_first, p.cv_second, k, method, 0.9999, 1.5, 10000, inliers);
      if (e.rows != 3) return std::nan("");
      cv::recoverPose(e, p.cv_first, p.cv_second, k, r, t, inliers);
      mat3 rotation;
      for (int i = 0; i != 9; ++i) rotation(i / 3, i % 3) = r.at<double>(i / 3, i % 3);
      const vec3 translation(t.at<double>(0), t.at<double>(1), t.at<double>(2));
      return direction_error(se3(so3(rotation), translation).inverse(), p.T_first_second);
    };
  };
  add_two_views("essential", "cv_ransac", false, "median_deg", by_cv(cv::RANSAC));
  add_two_views("essential", "cv_usac_accurate", false, "median_deg", by_cv(cv::USAC_ACCURATE));
  add_two_views("homography", "orbis", true, "median_px", [](const image_pair& p) {
    const auto found = optimize::estimate_homography(p.first, p.second, {.threshold = 3.0});
    return found ? corner_error(found->H_second_first, p) : std::nan("");
  });
  const auto h_by_cv = [](int method) {
    return [method](const image_pair& p) {
      const cv::Mat h = cv::findHomography(p.cv_first, p.cv_second, method, 3.0, cv::noArray(), 10000, 0.9999);
      if (h.rows != 3) return std::nan("");
      mat3 m;
      for (int i = 0; i != 9; ++i) m(i / 3, i % 3) = h.at<double>(i / 3, i % 3);
      return corner_error(m, p);
    };
  };
  add_two_views("homography", "cv_ransac", true, "median_px", h_by_cv(cv::RANSAC));
  add_two_views("homography", "cv_usac_accurate", true, "median_px", h_by_cv(cv::USAC_ACCURATE));
}

[[maybe_unused]] const bool registered = [] {
  add_essential_and_homography();
  for (const int percent : {10, 50, 70, 85}) {
    for (const auto& [who, level] :
         {std::pair{"orbis", simd::level::avx512}, std::pair{"orbis_portable", simd::level::portable}})
      add_pnp(percent, who, [level = level](const pnp_scene& s, se3& pose) {
        const simd::level_limit limit{level};
        static optimize::pnp_workspace workspace;
        const auto found = optimize::estimate_pose(s.points, s.pixels, the_camera, {.threshold = threshold}, workspace);
        if (found) pose = found->T_world_camera;
        return found.has_value();
      });
    add_pnp(percent, "cv_usac_accurate", by_opencv(cv::USAC_ACCURATE));
    add_pnp(percent, "cv_p3p", by_opencv(cv::SOLVEPNP_P3P));
    if (percent <= 70) add_pnp(percent, "cv_default", by_opencv(cv::SOLVEPNP_ITERATIVE));  // a second each beyond
  }
  for (const std::size_t n : {std::size_t{10}, std::size_t{100}, std::size_t{1000}}) add_orientation(n);
  add_p3p();
  return true;
}();

}  // namespace
}  // namespace orbis::bench

// SPDX-License-Identifier: BSD-3-Clause
#include "cloud/peers.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <limits>
#include <map>
#include <utility>

#include <orbis/camera/cloud.hpp>
#include <orbis/core/random.hpp>
#include <orbis/io/recording.hpp>

namespace orbis::bench {
namespace {

[[nodiscard]] points make_room(std::size_t n) {
  random_bits random{n};
  constexpr std::size_t views = 6;
  const auto width = static_cast<int>(std::sqrt(static_cast<double>(n) / views * 4 / 3)) + 1;
  points out;
  out.reserve(n);
  for (std::size_t view = 0; out.size() != n; ++view) {
    const double angle = 0.35 * static_cast<double>(view);
    const vec3 origin{0.2 * std::cos(angle), 0.1 * std::sin(2 * angle), 0.2 * std::sin(angle)};
    for (int i = 0; i < width * width * 3 / 4 && out.size() != n; ++i) {
      const double u = (i % width - 0.5 * width) / (0.82 * width);
      const double v = (static_cast<double>(i) / width - 0.375 * width) / (0.82 * width);
      const vec3 ray{u * std::cos(angle) + std::sin(angle), v, std::cos(angle) - u * std::sin(angle)};
      double t = 1e9;
      const vec3 half{2.5, 1.3, 2.0};
      for (int a = 0; a != 3; ++a) {
        if (ray[a] != 0) t = std::min(t, (std::copysign(half[a], ray[a]) - origin[a]) / ray[a]);
      }
      if (std::sin(5 * angle + 9 * u) > 0.8 && v > 0) t *= 0.7;  // furniture
      t += 0.002 * t * t * random.normal();
      if (random.below(100) == 0) t *= random.uniform();
      out.emplace_back((origin + t * ray).cast<float>());
    }
  }
  return out;
}

/// Of each size one, made when first asked for.
template <class Make>
[[nodiscard]] const points& kept(std::deque<points>& made, std::size_t n, const Make& make) {
  const auto found = std::find_if(made.begin(), made.end(), [n](const points& p) { return p.size() == n; });
  return found != made.end() ? *found : made.emplace_back(make());
}

[[nodiscard]] points shuffled(points cloud) {
  const std::size_t n = cloud.size();
  random_bits random{n + 1};
  for (std::size_t i = n; i-- > 1;) std::swap(cloud[i], cloud[random.below(static_cast<std::uint32_t>(i + 1))]);
  return cloud;
}

[[nodiscard]] std::filesystem::path kitchen_folder() { return std::filesystem::path{ORBIS_DATA_DIR} / "kitchen"; }

/// Every `step`-th frame, every `stride`-th pixel both ways, and at most the first n points.
[[nodiscard]] points kitchen_frames(std::size_t step, int stride, std::size_t n) {
  points out;
  const auto recording = io::open_recording(kitchen_folder()).value();
  for (std::size_t i = 0; i < recording.size() && out.size() < n; i += step) {
    const auto frame = recording.frame(i).value();
    const auto seen =
        camera::unproject_depth(par, frame.depth_metres(), recording.camera().model,
                                {.stride = stride, .max_depth = 5.0F}, frame.T_world_camera.value_or(se3{}));
    out.insert(out.end(), seen.points.begin(), seen.points.end());
  }
  out.resize(std::min(n, out.size()));
  return out;
}

}  // namespace

const points& room_cloud(std::size_t n) {
  static std::deque<points> made;
  return kept(made, n, [n] { return make_room(n); });
}

const points& shuffled_cloud(std::size_t n) {
  static std::deque<points> made;
  return kept(made, n, [n] { return shuffled(room_cloud(n)); });
}

const points& uniform_cloud(std::size_t n) {
  static std::deque<points> made;
  return kept(made, n, [n] {
    random_bits random{n};
    points out;
    for (std::size_t i = 0; i != n; ++i) {
      const double x = random.uniform(-2.5, 2.5);
      const double y = random.uniform(-1.3, 1.3);
      const double z = random.uniform(-2.0, 2.0);
      out.emplace_back(vec3{x, y, z}.cast<float>());
    }
    return out;
  });
}

const points& identical_cloud(std::size_t n) {
  static std::deque<points> made;
  return kept(made, n, [n] { return points(n, vec3f{0.5F, -1.25F, 2.0F}); });
}

bool have_kitchen_cloud() { return std::filesystem::exists(kitchen_folder() / "depth.txt"); }

const points& kitchen_cloud() {
  static const points merged = kitchen_frames(100, 2, std::numeric_limits<std::size_t>::max());
  return merged;
}

const points& kitchen_scans(std::size_t n) {
  static std::deque<points> made;
  return kept(made, n, [n] { return kitchen_frames(30, 1, n); });
}

const points& shuffled_kitchen_scans(std::size_t n) {
  static std::deque<points> made;
  return kept(made, n, [n] { return shuffled(kitchen_scans(n)); });
}

#ifdef ORBIS_BENCH_WITH_PCL
const pcl::PointCloud<pcl::PointXYZ>::Ptr& pcl_cloud(const points& cloud) {
  static std::map<const points*, pcl::PointCloud<pcl::PointXYZ>::Ptr> copies;
  auto& copy = copies[&cloud];
  if (copy == nullptr) {
    copy = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    copy->reserve(cloud.size());
    for (const auto& p : cloud) copy->push_back({p.x(), p.y(), p.z()});
  }
  return copy;
}
#endif

}  // namespace orbis::bench

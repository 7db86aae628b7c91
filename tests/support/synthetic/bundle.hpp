// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment problems made on the fly, with their truth: photographs of a monument or along a
/// street as problems of "Bundle Adjustment in the Large", and the local map of an RGB-D or stereo SLAM.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/bal.hpp>

namespace orbis::test {

using namespace io;

enum class bundle_scene {
  monument,  ///< cameras all round look at it: nearly every two of them share points
  street     ///< cameras go along and look ahead: each shares points with its neighbours alone
};

struct synthetic_bal_options {
  bundle_scene scene = bundle_scene::monument;
  int cameras = 30;              ///< at least 2
  int points = 3000;             ///< each is seen by two cameras at least
  double views_per_point = 6;    ///< in the mean, at least 2; fewer where fewer cameras can see it
  double pixel_sigma = 0.5;      ///< of each coordinate
  double outlier_share = 0.0;    ///< of the observations: how many are somewhere else altogether
  double rotation_error = 0.01;  ///< of the start, sigma about each axis, radians
  double position_error = 0.1;   ///< of cameras and points at the start, sigma of each coordinate, metres
  double focal_error = 0.02;     ///< of the start, sigma as a share; distortion starts from 0
  std::uint64_t seed = 1;
};

struct synthetic_bal {
  bal_problem measured;             ///< observations with noise, cameras and points with errors
  bal_problem truth;                ///< the same without
  std::vector<std::uint8_t> wrong;  ///< one for each observation: whether it is an outlier
};

struct synthetic_local_map_options {
  int free_keyframes = 20;
  int fixed_keyframes = 10;      ///< half of them at either end of the path; they start where they truly are
  int points = 3000;             ///< each is seen by two keyframes at least, by a free one among them
  double views_per_point = 5.1;  ///< in the mean, at least 2; fewer where fewer keyframes can see it
  camera::intrinsics camera{640, 480, 525.0, 525.0, 319.5, 239.5};
  double bf = 40.0;               ///< baseline times focal length, pixel metres
  double depth_share = 1.0;       ///< of the observations that have a right coordinate
  double pixel_sigma = 0.8;       ///< on the finest of eight pyramid levels; grows by 1.2 from one to the next
  double outlier_share = 0.03;    ///< of the observations: how many are tens of pixels off
  double rotation_error = 0.009;  ///< of the start, sigma about each axis, radians
  double position_error = 0.01;   ///< of keyframes at the start, sigma of each coordinate, metres
  double point_error = 0.03;      ///< of points at the start, sigma of each coordinate, metres
  std::uint64_t seed = 1;
};

/// `point` seen by `keyframe`, both as indices.
struct keyframe_observation {
  std::uint32_t keyframe = 0;
  std::uint32_t point = 0;
  vec2 pixel = vec2::Zero();
  double right = std::numeric_limits<double>::quiet_NaN();  ///< `u - bf / depth`; NaN without depth
  double information = 1.0;  ///< 1 / sigma^2 by the level it was found on, in units of the finest level's
};

struct synthetic_local_map {
  camera::pinhole camera;
  double bf = 40.0;
  std::vector<se3> poses, true_poses;  ///< `T_world_camera`, at the start and in truth
  std::vector<vec3> points, true_points;
  std::vector<keyframe_observation> observations;  ///< those of a point together
  std::vector<std::uint8_t> fixed;                 ///< one for each keyframe
  std::vector<std::uint8_t> wrong;                 ///< one for each observation: whether it is an outlier
};

namespace detail {

/// The random choices both kinds of problems are made of.
class bundle_random : public random_bits {
 public:
  using random_bits::random_bits;
  vec3 normal3(double sigma) {
    const double x = normal(), y = normal();  // named, since the order of arguments is the compiler's choice
    return sigma * vec3(x, y, normal());
  }
  vec2 within(double bound) {
    const double x = uniform(-bound, bound);
    return {x, uniform(-bound, bound)};
  }
  bool chance(double share) { return uniform() < share; }
  /// How many of `possible` views a point gets: two, and geometrically many more.
  std::size_t views(double mean, std::size_t possible) {
    const double more = std::max(0.0, mean - 2.0);
    const double n = more > 0.0 ? std::floor(std::log1p(-uniform()) / std::log(more / (1.0 + more))) : 0.0;
    return std::min(possible, 2 + static_cast<std::size_t>(std::min(n, 1e6)));
  }
  /// Keeps that many of them: a run of neighbours with `held` among them, or any.
  void choose(std::vector<std::uint32_t>& from, std::size_t count, std::optional<std::size_t> held) {
    if (held) {
      const std::size_t lowest = *held + 1 > count ? *held + 1 - count : 0;
      const std::size_t highest = std::min(*held, from.size() - count);
      const std::size_t first = lowest + below(static_cast<std::uint32_t>(highest - lowest + 1));
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(first), count, from.begin());
    } else {
      for (std::size_t i = 0; i != count; ++i)
        std::swap(from[i], from[i + below(static_cast<std::uint32_t>(from.size() - i))]);
    }
    from.resize(count);
    std::sort(from.begin(), from.end());
  }
};

/// A camera of the format at `centre` that looks at `target`, the world's y axis up.
[[nodiscard]] inline std::array<double, 9> bal_camera_at(const vec3& centre, const vec3& target, double focal,
                                                         double k1, double k2) {
  mat3 axes;  // rows: the camera's own axes in the world
  axes.row(2) = (centre - target).normalized();
  axes.row(0) = vec3::UnitY().cross(vec3(axes.row(2).transpose())).normalized();
  axes.row(1) = vec3(axes.row(2).transpose()).cross(vec3(axes.row(0).transpose()));
  const vec3 w = so3(axes).log(), t = -(axes * centre);
  return {w.x(), w.y(), w.z(), t.x(), t.y(), t.z(), focal, k1, k2};
}

/// A point of the scene's surface with the direction it faces.
[[nodiscard]] inline std::pair<vec3, vec3> bundle_surface_point(const synthetic_bal_options& o, bundle_random& random) {
  if (o.scene == bundle_scene::monument) {
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi), height = random.uniform(-6.0, 6.0);
    const double radius = 8.0 + std::sin(5.0 * angle) + 0.5 * random.uniform();
    const vec3 out(std::cos(angle), 0.0, std::sin(angle));
    return {vec3(radius * out + vec3(0.0, height, 0.0)), out};
  }
  const double along = random.uniform(-5.0, 2.0 * o.cameras + 30.0), height = random.uniform(-2.0, 10.0);
  const double side = random.chance(0.5) ? 1.0 : -1.0;
  return {vec3(along, height, side * (8.0 + random.uniform())), vec3(-0.5, 0.0, -side).normalized()};
}

}  // namespace detail

/// A problem with truth, in metres; images of 1000 x 800 pixels. The same for the same options.
/// O(cameras * points). @pre the options are in the ranges they name
[[nodiscard]] inline synthetic_bal make_bal_problem(const synthetic_bal_options& o) {
  synthetic_bal made;
  detail::bundle_random random{o.seed};
  std::vector<vec3> centres;
  for (int i = 0; i != o.cameras; ++i) {
    const vec3 shaken = random.normal3(0.5);
    const double focal = 800.0 * (1.0 + 0.1 * random.uniform(-1.0, 1.0));
    const double k1 = random.uniform(-0.06, -0.02), k2 = random.uniform(0.0, 0.02);
    vec3 centre(2.0 * i, 0.0, 0.0), target = centre + vec3(10.0, 1.0, 0.0);
    if (o.scene == bundle_scene::monument) {
      const double angle = 2.0 * std::numbers::pi * i / o.cameras, away = random.uniform(20.0, 35.0);
      centre = vec3(away * std::cos(angle), random.uniform(-4.0, 8.0), away * std::sin(angle));
      target = vec3::Zero();
    }
    centres.push_back(centre + 0.2 * shaken);
    made.truth.cameras.push_back(detail::bal_camera_at(centres.back(), target + shaken, focal, k1, k2));
  }

  std::vector<std::uint32_t> seen_by;
  for (int tries = 0; made.truth.points.size() != static_cast<std::size_t>(o.points) && tries < 100 * o.points;
       ++tries) {
    const auto [point, facing] = detail::bundle_surface_point(o, random);
    seen_by.clear();
    for (std::size_t i = 0; i != centres.size(); ++i) {
      const vec3 ray = centres[i] - point;
      if (!(ray.dot(facing) > 0.3 * ray.norm()) || ray.norm() > 45.0) continue;
      const auto& c = made.truth.cameras[i];
      const vec3 p = so3::exp(vec3(c[0], c[1], c[2])) * point + vec3(c[3], c[4], c[5]);
      // In front, and where the distortion is still that of a lens: far out it folds the world back in.
      if (!(p.z() < -1.0) || p.head<2>().norm() > -p.z()) continue;
      const auto pixel = project_bal(c, point);
      if (pixel && std::abs(pixel->x()) < 500.0 && std::abs(pixel->y()) < 400.0)
        seen_by.push_back(static_cast<std::uint32_t>(i));
    }
    if (seen_by.size() < 2) continue;
    std::optional<std::size_t> held;
    if (o.scene == bundle_scene::street) held = random.below(static_cast<std::uint32_t>(seen_by.size()));
    random.choose(seen_by, random.views(o.views_per_point, seen_by.size()), held);
    const auto index = static_cast<std::uint32_t>(made.truth.points.size());
    made.truth.points.push_back(point);
    for (const std::uint32_t camera : seen_by)
      made.truth.observations.push_back({camera, index, *project_bal(made.truth.cameras[camera], point)});
  }

  made.measured = made.truth;
  for (bal_observation& seen : made.measured.observations) {
    const bool wrong = random.chance(o.outlier_share);
    const double x = random.normal();
    seen.pixel += o.pixel_sigma * vec2(x, random.normal());
    if (wrong) seen.pixel += random.within(200.0);
    made.wrong.push_back(wrong ? 1 : 0);
  }
  for (std::size_t i = 0; i != centres.size(); ++i) {
    auto& c = made.measured.cameras[i];
    const so3 turned = so3::exp(random.normal3(o.rotation_error)) * so3::exp(vec3(c[0], c[1], c[2]));
    const vec3 w = turned.log(), t = -(turned * vec3(centres[i] + random.normal3(o.position_error)));
    c = {w.x(), w.y(), w.z(), t.x(), t.y(), t.z(), c[6] * (1.0 + o.focal_error * random.normal()), 0.0, 0.0};
  }
  for (vec3& point : made.measured.points) point += random.normal3(o.position_error);
  return made;
}

/// A local map with truth: a hand-held camera goes sideways, about 10 cm from keyframe to keyframe, and
/// looks at what is one to six metres away. The same for the same options. O(keyframes * points).
/// @pre the options are in the ranges they name
[[nodiscard]] inline synthetic_local_map make_local_map(const synthetic_local_map_options& o) {
  synthetic_local_map made;
  detail::bundle_random random{o.seed};
  made.camera = camera::pinhole{o.camera};
  made.bf = o.bf;
  const int keyframes = o.fixed_keyframes + o.free_keyframes;
  std::vector<se3> from_world;
  for (int k = 0; k != keyframes; ++k) {
    const double s = k;
    const so3 looking = so3::exp(vec3(0.0, 0.3 * std::sin(0.23 * s), 0.0)) *
                        so3::exp(vec3(0.08 * std::sin(0.31 * s), 0.0, 0.04 * std::sin(0.17 * s)));
    made.true_poses.emplace_back(looking, vec3(0.1 * s, 0.08 * std::sin(0.45 * s), 0.15 * std::sin(0.29 * s)));
    made.fixed.push_back(k < (o.fixed_keyframes + 1) / 2 || k >= keyframes - o.fixed_keyframes / 2 ? 1 : 0);
    from_world.push_back(made.true_poses.back().inverse());
  }
  const auto project = [&](std::size_t k, const vec3& point) -> std::optional<vec3> {
    const vec3 p = from_world[k] * point;
    const auto pixel = p.z() > 0.4 ? made.camera.project(p) : std::nullopt;
    if (!pixel || !(pixel->x() >= 0.0 && pixel->x() < o.camera.width && pixel->y() >= 0.0) ||
        !(pixel->y() < o.camera.height))
      return std::nullopt;
    return vec3(pixel->x(), pixel->y(), pixel->x() - o.bf / p.z());
  };

  std::vector<std::uint32_t> seen_by;
  for (int tries = 0; made.true_points.size() != static_cast<std::size_t>(o.points) && tries < 100 * o.points;
       ++tries) {
    const auto from = random.below(static_cast<std::uint32_t>(keyframes));
    const double u = random.uniform(0.0, o.camera.width), v = random.uniform(0.0, o.camera.height);
    const double far = random.uniform(), depth = 1.0 + 5.0 * far * far;
    const vec3 point = made.true_poses[from] * vec3(depth * made.camera.unproject(vec2(u, v)).value());
    seen_by.clear();
    std::size_t held = 0;
    for (std::size_t k = 0; k != from_world.size(); ++k) {
      if (k == from) held = seen_by.size();
      if (project(k, point)) seen_by.push_back(static_cast<std::uint32_t>(k));
    }
    if (seen_by.size() < 2 || held >= seen_by.size() || seen_by[held] != from) continue;
    random.choose(seen_by, random.views(o.views_per_point, seen_by.size()), held);
    if (std::all_of(seen_by.begin(), seen_by.end(), [&](std::uint32_t k) { return made.fixed[k] != 0; })) continue;
    const auto index = static_cast<std::uint32_t>(made.true_points.size());
    made.true_points.push_back(point);
    for (const std::uint32_t k : seen_by) {
      // Features are found on all levels of a pyramid, most on the finest.
      const double level = std::min(7.0, std::floor(-1.8 * std::log1p(-random.uniform())));
      const double scale = std::pow(1.2, level);
      vec3 seen = *project(k, point) + random.normal3(o.pixel_sigma * scale);
      const bool wrong = random.chance(o.outlier_share), has_depth = random.chance(o.depth_share);
      if (wrong) {
        const vec2 off = random.within(40.0);
        seen += vec3(off.x(), off.y(), random.uniform(-40.0, 40.0));
      }
      made.wrong.push_back(wrong ? 1 : 0);
      made.observations.push_back({k, index, vec2(seen.head<2>()),
                                   has_depth ? seen.z() : std::numeric_limits<double>::quiet_NaN(),
                                   1.0 / (scale * scale)});
    }
  }

  for (std::size_t k = 0; k != from_world.size(); ++k) {
    const vec3 moved = random.normal3(o.position_error), turned = random.normal3(o.rotation_error);
    const se3& truth = made.true_poses[k];
    made.poses.push_back(made.fixed[k] != 0 ? truth
                                            : se3{truth.rotation() * so3::exp(turned), truth.translation() + moved});
  }
  for (const vec3& point : made.true_points) made.points.push_back(point + random.normal3(o.point_error));
  return made;
}

}  // namespace orbis::test

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Maps of a round room, with the drift of their keyframes known.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/mapping/keyframe_insertion.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/system.hpp>

namespace orbis::test {

struct ring_options {
  std::uint32_t steps = 100;   ///< keyframes in one round, 15 cm apart
  double density = 30.0;       ///< points per square metre of the wall
  std::uint32_t symmetry = 1;  ///< the wall looks the same after each of so many parts of the round
  std::uint32_t memory = 8;    ///< keyframes after which a point that was not seen is not known again
  double drift = 1.0;          ///< how much of it
  double shrinks = 0.0;        ///< lengths, by this share with each keyframe; then no depth is measured
  std::uint64_t seed = 1;
};

/// A camera walks round a room and looks at the wall, two metres away, which is full of points.
class ring_world {
 public:
  camera::pinhole camera{640, 480, 525.0, 525.0, 320.0, 240.0};
  slam::camera_rig<camera::any_camera> rig{{camera, 400.0}};

  explicit ring_world(const ring_options& o = {}) : o_{o}, radius_{0.15 * o.steps / (2 * std::numbers::pi)} {
    rig.scale_is_known = o.shrinks == 0.0;
    random_bits random(o.seed);
    const double turn = 2 * std::numbers::pi / o.symmetry, wall = radius_ + 2.0;
    const auto count = static_cast<std::size_t>(o.density * turn * wall * 2.4);
    for (std::size_t i = 0; i < count; ++i) {
      const double angle = random.uniform(0, turn), height = random.uniform(-1.2, 1.2);
      const double depth = wall + random.uniform(-0.3, 0.3), size = random.uniform(2.5, 5.0);
      features::binary_descriptor<256> d;
      for (auto& w : d.words) w = random();
      for (std::uint32_t part = 0; part < o.symmetry; ++part)
        points_.push_back({place(angle + part * turn, depth, height), angle + part * turn, size, d});
    }
  }

  /// `T_world_camera` at step `i`: where the camera really is.
  [[nodiscard]] se3 truth(std::uint32_t i) const {
    const double angle = angle_of(i);
    mat3 r;  // x along the way, y down, z towards the wall
    r.col(2) = vec3(std::cos(angle), std::sin(angle), 0);
    r.col(1) = vec3(0, 0, -1);
    r.col(0) = r.col(1).cross(r.col(2));
    return {so3(r), place(angle, radius_, 0)};
  }
  /// Where a point is that keypoint `feature` of the frame of step `i` shows.
  [[nodiscard]] std::size_t point_of(std::uint32_t i, std::uint32_t feature) const { return shown_[i][feature]; }
  /// As above, of a keyframe whose id is its step.
  [[nodiscard]] std::size_t point_of(slam::keyframe_id k, std::uint32_t feature) const {
    return point_of(k.value(), feature);
  }
  [[nodiscard]] const vec3& point(std::size_t p) const { return points_[p].position; }

  /// What the camera sees at step `i`, at the pose given, with noise; no landmarks.
  [[nodiscard]] slam::frame look(std::uint32_t i, const se3& T_world_camera) {
    random_bits random(mix64(o_.seed * 1000003 + i));
    slam::frame f;
    f.index = i;
    f.timestamp = 0.5 * i;
    f.scale_is_known = rig.scale_is_known;
    f.T_world_camera = T_world_camera;
    const se3 T_camera_world = truth(i).inverse();
    const double mine = angle_of(i);
    if (shown_.size() <= i) shown_.resize(i + 1);
    shown_[i].clear();
    for (std::size_t p = 0; p < points_.size(); ++p) {
      const wall_point& w = points_[p];
      if (std::cos(w.angle - mine) < 0.3) continue;
      const vec3 at = T_camera_world * w.position;
      if (!(at.z() > 0.5)) continue;
      features::keypoint k;
      k.octave =
          std::clamp(static_cast<int>(std::ceil(std::log(w.size / at.norm()) / std::log(rig.scales.factor()))), 0, 7);
      const double sigma = 0.5 * rig.scales.scale(k.octave);
      const auto exact = camera.project(at);
      if (!exact) continue;
      const double dx = sigma * random.normal(), dy = sigma * random.normal(), dz = sigma * random.normal();
      const vec2 pixel = *exact + vec2(dx, dy);
      if (pixel.x() < 8 || pixel.y() < 8 || pixel.x() > 631 || pixel.y() > 471) continue;
      k.x = static_cast<float>(pixel.x());
      k.y = static_cast<float>(pixel.y());
      f.features.keypoints.push_back(k);
      f.features.descriptors.push_back(w.descriptor);
      for (int flips = 0; flips < 8; ++flips)
        f.features.descriptors.back().words[random.below(4)] ^= std::uint64_t{1} << random.below(64);
      f.depth.push_back(rig.scale_is_known ? static_cast<float>(rig.model.bf / (rig.model.bf / at.z() + dz)) : 0.0F);
      f.rays.push_back(*camera.unproject(pixel));
      f.landmarks.push_back(slam::no_id);
      shown_[i].push_back(p);
    }
    f.grid = features::keypoint_grid(f.features.keypoints);
    return f;
  }

  /// Adds keyframes for the steps `from` to `to` (exclusive), the first at `pose`, each a little wrong as seen from the
  /// one before. Points that the last ones saw are known again. Keyframes are numbered as they come. `scale`: of the
  /// lengths at the first one.
  void walk(slam::map& m, std::uint32_t from, std::uint32_t to, se3 pose, double scale = 1.0) {
    random_bits random(mix64(o_.seed + 77));
    std::vector<slam::landmark_id> known(points_.size(), slam::no_id);
    std::vector<std::uint32_t> last(points_.size(), 0);
    for (std::uint32_t i = from; i < to; ++i) {
      if (i != from) {
        const double a = o_.drift * 2e-4 * random.normal(), b = o_.drift * 3e-4 * random.normal();
        const se3 wrong(so3::exp(o_.drift * vec3(1e-4, 1.5e-3, -1e-4) + vec3(a, a, -a)),
                        o_.drift * vec3(5e-4, -2e-4, 5e-4) + vec3(b, -b, b));
        scale *= 1.0 - o_.shrinks;
        pose = pose * slam::detail::scaled((truth(i - 1).inverse() * truth(i)) * wrong, scale);
      }
      slam::frame f = look(i, pose);
      for (std::uint32_t k = 0; k < f.size(); ++k) {
        const std::size_t p = shown_[i][k];
        if (known[p] != slam::no_id && i - last[p] <= o_.memory) f.landmarks[k] = known[p];
      }
      const slam::keyframe_id id = slam::detail::insert_keyframe(m, std::move(f), {});
      for (std::uint32_t k = 0; !rig.scale_is_known && k < m.at(id).size(); ++k)
        if (m.at(id).landmarks[k] == slam::no_id)
          m.add_landmark(id, k, pose * vec3(scale * (truth(i).inverse() * points_[shown_[i][k]].position)));
      for (std::uint32_t k = 0; k < m.at(id).size(); ++k) {
        const std::size_t p = shown_[i][k];
        known[p] = m.at(id).landmarks[k];
        last[p] = i;
      }
    }
  }

  /// Once round and `beyond` further, so that the last keyframes show what the first ones do and do not know it.
  [[nodiscard]] slam::map round(std::uint32_t beyond = 4) {
    slam::map m(8, 1.2);
    walk(m, 0, o_.steps + beyond, truth(0));
    return m;
  }

  /// The largest and the mean distance of keyframes from where they are; keyframe `k` is step `frame.index`.
  [[nodiscard]] std::array<double, 2> errors(const slam::map& m) const {
    double worst = 0.0, sum = 0.0;
    for (const auto& k : m.keyframes()) {
      const auto step = static_cast<std::uint32_t>(k.index);
      const double e = (k.T_world_camera.translation() - truth(step).translation()).norm();
      worst = std::max(worst, e);
      sum += e;
    }
    return {worst, sum / static_cast<double>(m.keyframes().size())};
  }

 private:
  struct wall_point {
    vec3 position;
    double angle, size;
    features::binary_descriptor<256> descriptor;
  };

  [[nodiscard]] double angle_of(std::uint32_t i) const { return 2 * std::numbers::pi * i / o_.steps; }
  [[nodiscard]] static vec3 place(double angle, double distance, double height) {
    return {distance * std::cos(angle), distance * std::sin(angle), height};
  }

  ring_options o_;
  double radius_;
  std::vector<wall_point> points_;
  std::vector<std::vector<std::size_t>> shown_;  // by step: the point that each keypoint shows
};

/// Whether two maps are the same, number by number.
[[nodiscard]] inline bool same(const slam::map& a, const slam::map& b) {
  if (a.keyframe_end() != b.keyframe_end() || a.landmark_end() != b.landmark_end()) return false;
  for (slam::keyframe_id k = 0; k != a.keyframe_end(); ++k) {
    if (a.has_keyframe(k) != b.has_keyframe(k)) return false;
    if (a.has_keyframe(k) && (a.at(k).T_world_camera.to_matrix() != b.at(k).T_world_camera.to_matrix() ||
                              a.at(k).landmarks != b.at(k).landmarks))
      return false;
  }
  for (slam::landmark_id l = 0; l != a.landmark_end(); ++l) {
    if (a.has_landmark(l) != b.has_landmark(l)) return false;
    if (a.has_landmark(l) && a.landmark_at(l).position != b.landmark_at(l).position) return false;
  }
  return true;
}

}  // namespace orbis::test

// SPDX-License-Identifier: BSD-3-Clause
#include "view_frame.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>

#include "formatted_text.hpp"

namespace app {
namespace {

using orbis::vec3;

/// A measure of the concentration of points along `axis`: large if planes perpendicular to it contain many points.
double planarity(const std::vector<vec3>& points, const vec3& axis) {
  constexpr double bin = 0.03;
  constexpr int bins = 512;
  std::array<double, bins> histogram{};
  for (const vec3& p : points) {
    const double at = axis.dot(p) / bin;
    histogram[static_cast<std::size_t>(static_cast<long>(std::floor(at)) & (bins - 1))] += 1.0;
  }
  double sum = 0.0;
  for (const double n : histogram) sum += n * n;
  return sum;
}

double quantile(std::vector<double> values, double q) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

std::optional<double> height_of_floor(const results& r) {
  if (!r.map || !r.navigation || !r.navigation->floor_m) return std::nullopt;
  // The floor is in one layer of voxels or between two layers; `top` is the upper face.
  const double top = *r.navigation->floor_m, bottom = top - 2 * r.map->resolution;
  std::vector<double> heights;
  for (const std::uint32_t i : r.map->kept)
    if (const double z = r.map->cloud.points[i].z(); z > bottom && z < top) heights.push_back(z);
  return heights.empty() ? top : quantile(std::move(heights), 0.5);
}

view_frame find_view_frame(const std::vector<orbis::vec3f>& points, const orbis::trajectory& cameras,
                           std::optional<double> floor) {
  std::vector<vec3> sample;
  const std::size_t stride = std::max<std::size_t>(1, points.size() / 6000);
  for (std::size_t i = 0; i < points.size(); i += stride)
    if (points[i].allFinite()) sample.push_back(points[i].cast<double>());

  view_frame frame;
  if (sample.empty()) return frame;
  constexpr double degree = std::numbers::pi / 180.0;
  const vec3 up = vec3::UnitZ();
  vec3 x = vec3::UnitX();
  double best = -1.0;
  for (double yaw = 0.0; yaw < std::numbers::pi / 2; yaw += degree) {
    const vec3 along(std::cos(yaw), std::sin(yaw), 0.0);
    const double score = planarity(sample, along) + planarity(sample, up.cross(along));
    if (score > best) {
      best = score;
      x = along;
    }
  }
  orbis::mat3 rows;
  rows.row(0) = x;
  rows.row(1) = up.cross(x);
  rows.row(2) = up;
  const orbis::so3 R_view_world{rows};

  constexpr double margin = 0.05;
  for (int axis = 0; axis != 3; ++axis) {
    std::vector<double> along;
    along.reserve(sample.size());
    for (const vec3& p : sample) along.push_back((R_view_world * p)[axis]);
    frame.low[axis] = quantile(along, 0.005) - margin;
    frame.high[axis] = quantile(std::move(along), 0.995) + margin;
  }
  const double zero = floor.value_or(frame.low.z() + margin);
  frame.low.z() -= zero;
  frame.high.z() -= zero;
  frame.T_view_world = {R_view_world, vec3(0, 0, -zero)};

  frame.cut = frame.high.z();
  if (!cameras.empty()) {
    double highest = 0.0;
    for (const orbis::stamped_pose& c : cameras)
      highest = std::max(highest, (frame.T_view_world * c.T_world_camera.translation()).z());
    frame.cut = std::clamp(highest + 0.3, 0.5 * frame.high.z(), frame.high.z());
  }
  return frame;
}

std::string view_frame_note(const view_frame& frame, const std::string& unit) {
  constexpr double least_degrees = 0.5, least_shift = 0.005;
  const orbis::mat3 R = frame.T_view_world.rotation_matrix();
  const double degrees = std::atan2(R(1, 0), R(0, 0)) * 180.0 / std::numbers::pi;
  const double shift = frame.T_view_world.translation().z();
  const bool is_rotated = std::abs(degrees) > least_degrees, is_shifted = std::abs(shift) > least_shift;
  if (!is_rotated && !is_shifted) return {};
  const std::string rotation = is_rotated ? text("rotated by %.1f degrees about z", degrees) : "";
  const std::string offset = is_shifted ? text("shifted by %.2f %s in height", shift, unit.c_str()) : "";
  return rotation + (is_rotated && is_shifted ? " and " : "") + offset + " relative to the world frame of the files";
}

std::string view_frame_text(const view_frame& frame) {
  const vec3 t = frame.T_view_world.translation();
  const auto q = frame.T_view_world.rotation().unit_quaternion();
  return text("%.4f %.4f %.4f %.6f %.6f %.6f %.6f", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

orbis::rgb8 height_color(double t) {
  constexpr std::array<std::array<double, 3>, 5> anchors{
      {{44, 74, 138}, {42, 143, 168}, {95, 185, 138}, {226, 200, 96}, {217, 108, 62}}};
  const double at = std::clamp(t, 0.0, 1.0) * (anchors.size() - 1);
  const auto i = std::min<std::size_t>(static_cast<std::size_t>(at), anchors.size() - 2);
  const double f = at - static_cast<double>(i);
  const auto mix = [&](std::size_t c) {
    return static_cast<std::uint8_t>(std::lround(anchors[i][c] + f * (anchors[i + 1][c] - anchors[i][c])));
  };
  return {mix(0), mix(1), mix(2)};
}

}  // namespace app

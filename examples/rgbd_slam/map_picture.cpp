// SPDX-License-Identifier: BSD-3-Clause
#include "map_picture.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "picture_colors.hpp"

namespace app {
namespace {

using orbis::rgb8;
using orbis::vec3;

constexpr int oversampling = 2;
constexpr double degree = std::numbers::pi / 180.0;

class picture {
 public:
  /// Draws into the two vectors, which are overwritten.
  picture(std::vector<rgb8>& colors, std::vector<float>& inverse_depths, int width, int height) {
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    colors.assign(pixels, paper);
    inverse_depths.assign(pixels, 0.0F);
    color_ = {colors.data(), width, height};
    inverse_depth_ = {inverse_depths.data(), width, height};
  }

  /// Draws a planar convex quadrilateral; each corner is a pixel and a depth.
  void quad(const std::array<vec3, 4>& c, rgb8 color) {
    const vec3 u = c[1] - c[0], v = c[2] - c[0];
    const double area = u.x() * v.y() - u.y() * v.x();
    if (!(std::abs(area) > 1e-9)) return;
    // The inverse depth of a plane is linear in the image.
    const double at_first = 1.0 / c[0].z(), du = 1.0 / c[1].z() - at_first, dv = 1.0 / c[2].z() - at_first;
    const double per_x = (du * v.y() - dv * u.y()) / area, per_y = (dv * u.x() - du * v.x()) / area;
    const auto [top, bottom] = std::minmax({c[0].y(), c[1].y(), c[2].y(), c[3].y()});
    const int first = first_pixel(top, color_.height()), last = last_pixel(bottom, color_.height());
    for (int y = first; y <= last; ++y) {
      double left = 0.0, right = color_.width() - 1.0;
      for (std::size_t i = 0; i != 4; ++i) {
        const vec3 &a = c[i], &b = c[(i + 1) % 4];
        const double rise = b.y() - a.y();
        if (rise == 0.0) continue;  // the rows of other edges end there
        const double x = a.x() + (y - a.y()) * (b.x() - a.x()) / rise;
        if ((rise > 0.0) == (area > 0.0)) {
          right = std::min(right, x);
        } else {
          left = std::max(left, x);
        }
      }
      const double at_row = at_first + per_y * (y - c[0].y());
      for (int x = first_pixel(left, color_.width()), end = last_pixel(right, color_.width()); x <= end; ++x) {
        const auto nearness = static_cast<float>(at_row + per_x * (x - c[0].x()));
        if (nearness <= inverse_depth_(x, y)) continue;
        inverse_depth_(x, y) = nearness;
        color_(x, y) = color;
      }
    }
  }

  /// Darkens pixels behind their neighbours (eye-dome lighting: C. Boucheny, "Interactive scientific visualization of
  /// large datasets", 2009), and averages blocks of `oversampling` x `oversampling` pixels.
  [[nodiscard]] orbis::image<rgb8> finish() const {
    orbis::image<rgb8> out(color_.width() / oversampling, color_.height() / oversampling);
    constexpr int n = oversampling;
    for (int y = 0; y != out.height(); ++y)
      for (int x = 0; x != out.width(); ++x) {
        if (is_empty(n * x, n * y)) {
          out(x, y) = paper;
          continue;
        }
        std::array<double, 3> sum{};
        for (int j = 0; j != n; ++j)
          for (int i = 0; i != n; ++i) {
            const rgb8 c = color_(n * x + i, n * y + j);
            const double s = shade(n * x + i, n * y + j);
            sum[0] += s * c.r;
            sum[1] += s * c.g;
            sum[2] += s * c.b;
          }
        const auto byte = [](double v) {  // rounds; std::lround would be a function call
          const double mean = v / (n * n);
          const auto whole = static_cast<std::uint8_t>(mean);
          return static_cast<std::uint8_t>(whole + (mean - whole >= 0.5 ? 1 : 0));
        };
        out(x, y) = {byte(sum[0]), byte(sum[1]), byte(sum[2])};
      }
    return out;
  }

 private:
  /// The first pixel at or after the coordinate `v`, and the last one at or before it, in an image of `size` pixels.
  [[nodiscard]] static int first_pixel(double v, int size) {
    return static_cast<int>(std::ceil(std::clamp(v, 0.0, static_cast<double>(size))));
  }
  [[nodiscard]] static int last_pixel(double v, int size) {
    return static_cast<int>(std::floor(std::clamp(v, -1.0, size - 1.0)));
  }

  /// Returns true if nothing was drawn on the block of averaged pixels that starts at (x, y).
  [[nodiscard]] bool is_empty(int x, int y) const {
    for (int j = 0; j != oversampling; ++j)
      for (int i = 0; i != oversampling; ++i)
        if (inverse_depth_(x + i, y + j) > 0.0F) return false;
    return true;
  }

  [[nodiscard]] double shade(int x, int y) const {
    const float here = inverse_depth_(x, y);
    if (here <= 0.0F) return 1.0;
    constexpr int reach = 2 * oversampling;
    float behind = 1.0F;
    for (const auto& [dx, dy] : {std::pair{reach, 0}, {-reach, 0}, {0, reach}, {0, -reach}}) {
      if (!inverse_depth_.contains(x + dx, y + dy)) continue;
      constexpr float most = 1.1892071F;  // 2^0.25
      behind *= std::clamp(inverse_depth_(x + dx, y + dy) / here, 1.0F, most);
    }
    return behind == 1.0F ? 1.0 : std::pow(behind, -2.164F);  // exp(-1.5 log2(behind))
  }

  orbis::image_view<rgb8> color_;
  orbis::image_view<float> inverse_depth_;
};

rgb8 lit(rgb8 c, double light) {
  const auto byte = [&](std::uint8_t v) { return static_cast<std::uint8_t>(std::min(255L, std::lround(v * light))); };
  return {byte(c.r), byte(c.g), byte(c.b)};
}

/// Returns true if the point is neither above the cut nor an outlier below the floor.
bool is_shown(const vec3& p, const view_frame& frame) { return p.z() <= frame.cut && p.z() >= frame.low.z() - 0.5; }

/// The points that a view must contain: the drawn voxels, excluding outliers.
std::vector<vec3> framed(const std::vector<voxel>& voxels, const view_frame& frame) {
  std::vector<vec3> points;
  points.reserve(voxels.size());
  for (const voxel& v : voxels) {
    const vec3 p = frame.T_view_world * v.center.cast<double>();
    const bool inside = (p.array() >= frame.low.array()).all() && (p.array() <= frame.high.array()).all();
    if (inside && is_shown(p, frame)) points.push_back(p);
  }
  if (points.empty()) points = {frame.low, frame.high};
  return points;
}

/// Finds faces that are hidden because the neighbouring voxel of the same size is drawn as well.
class drawn_voxels {
 public:
  drawn_voxels(const std::vector<voxel>& voxels, const view_frame& frame) {
    for (const voxel& v : voxels)
      if (is_shown(frame.T_view_world * v.center.cast<double>(), frame)) keys_.push_back(key(v));
    std::sort(keys_.begin(), keys_.end());
  }
  [[nodiscard]] bool contain_neighbor(const voxel& v, int axis, int side) const {
    auto wanted = key(v);
    wanted[static_cast<std::size_t>(axis) + 1] += side;
    return std::binary_search(keys_.begin(), keys_.end(), wanted);
  }

 private:
  using key_type = std::array<long, 4>;  // bits of the size, and the indices along the axes
  static key_type key(const voxel& v) {
    const auto index = [&](int axis) { return std::lround(v.center[axis] / v.size - 0.5F); };
    return {std::bit_cast<std::int32_t>(v.size), index(0), index(1), index(2)};
  }
  std::vector<key_type> keys_;
};

}  // namespace

vec3 map_painter::eye::see(const vec3& p) const {
  const vec3 d = p - position;
  const double z = forward.dot(d);
  return {0.5 * width + focal * right.dot(d) / z, 0.5 * height + focal * down.dot(d) / z, z};
}

map_painter::eye map_painter::look_at(const std::vector<vec3>& points, double azimuth, double elevation, double field,
                                      int width, int height) {
  eye e;
  e.forward =
      -vec3(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  e.right = vec3(-std::sin(azimuth), std::cos(azimuth), 0.0);
  e.down = e.forward.cross(e.right);
  e.focal = 0.5 * height / std::tan(0.5 * field);
  e.width = width;
  e.height = height;
  // The centre of the points' bounds in the image: exact without perspective, otherwise close enough after a few
  // rounds.
  vec3 middle = vec3::Zero();
  for (const vec3& p : points) middle += p / static_cast<double>(points.size());
  for (int round = 0; round != 4; ++round) {
    double distance = 0.1;
    for (const vec3& p : points) {
      const vec3 d = p - middle;
      const double across =
          std::max(std::abs(e.right.dot(d)) / (0.47 * width), std::abs(e.down.dot(d)) / (0.47 * height));
      distance = std::max(distance, across * e.focal - e.forward.dot(d));
    }
    e.position = middle - distance * e.forward;
    double left = width, right = 0.0, top = height, bottom = 0.0;
    for (const vec3& p : points) {
      const vec3 pixel = e.see(p);
      left = std::min(left, pixel.x());
      right = std::max(right, pixel.x());
      top = std::min(top, pixel.y());
      bottom = std::max(bottom, pixel.y());
    }
    middle += distance / e.focal * (0.5 * (left + right - width) * e.right + 0.5 * (top + bottom - height) * e.down);
  }
  return e;
}

map_painter::map_painter(const std::vector<voxel>& in_view, const view_frame& frame) : frame_{frame} {
  const std::vector<vec3> points = framed(in_view, frame);
  aslant_ = look_at(points, -62 * degree, 50 * degree, 34 * degree, 880 * oversampling, 700 * oversampling);
  from_above_ = look_at(points, -90 * degree, 89.9 * degree, 6 * degree, 560 * oversampling, 620 * oversampling);
}

orbis::image<rgb8> map_painter::draw_aslant(const std::vector<voxel>& voxels, coloring how) {
  return draw(voxels, how, aslant_);
}

orbis::image<rgb8> map_painter::draw_from_above(const std::vector<voxel>& voxels, coloring how) {
  return draw(voxels, how, from_above_);
}

double map_painter::pixels_per_metre() const { return from_above_.focal / from_above_.position.z() / oversampling; }

orbis::image<rgb8> map_painter::draw(const std::vector<voxel>& voxels, coloring how, const eye& e) {
  picture canvas{colors_, inverse_depths_, e.width, e.height};
  // Cubes are aligned with the world axes, which are the columns of the rotation in the view.
  const orbis::mat3 axes = frame_.T_view_world.rotation_matrix();
  const drawn_voxels drawn{voxels, frame_};
  for (const voxel& v : voxels) {
    const vec3 center = frame_.T_view_world * v.center.cast<double>();
    if (!is_shown(center, frame_)) continue;
    const rgb8 color =
        how == coloring::camera ? v.color : height_color((center.z() - frame_.low.z()) / (frame_.cut - frame_.low.z()));
    for (int axis = 0; axis != 3; ++axis) {
      const vec3 half = 0.5 * static_cast<double>(v.size) * axes.col(axis);
      const double side = half.dot(e.position - center) > 0 ? 1.0 : -1.0;  // only one of two opposite faces is visible
      const vec3 face = center + side * half;
      if ((e.position - face).dot(side * half) <= 0) continue;  // the camera is between the two faces
      if (drawn.contain_neighbor(v, axis, side > 0 ? 1 : -1)) continue;
      const vec3 u = 0.5 * static_cast<double>(v.size) * axes.col((axis + 1) % 3);
      const vec3 w = 0.5 * static_cast<double>(v.size) * axes.col((axis + 2) % 3);
      const std::array<vec3, 4> corners{e.see(face + u + w), e.see(face + u - w), e.see(face - u - w),
                                        e.see(face - u + w)};
      if (std::any_of(corners.begin(), corners.end(), [](const vec3& c) { return c.z() < 0.05; })) continue;
      const vec3 normal = side * half.normalized();
      canvas.quad(corners, lit(color, 0.72 + 0.3 * std::max(0.0, normal.dot(vec3(-0.35, 0.25, 0.9)))));
    }
  }
  return canvas.finish();
}

}  // namespace app

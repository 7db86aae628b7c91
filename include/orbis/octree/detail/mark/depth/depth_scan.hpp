// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A type-erased depth image and camera, so that the code that marks depth images is compiled once.
#pragma once

#include <concepts>
#include <cstdint>
#include <variant>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/octree/depth_points.hpp>

namespace orbis::octree::detail {

/// A depth_source of a user-defined type.
struct other_depth {
  const void* source;
  int columns, rows;
  float (*read)(const void* source, int u, int v);

  [[nodiscard]] int width() const noexcept { return columns; }
  [[nodiscard]] int height() const noexcept { return rows; }
  [[nodiscard]] float operator()(int u, int v) const { return read(source, u, v); }
};

/// Refers to the image and the camera passed to its constructor. Reading a pixel takes one switch on the image type.
class depth_scan {
 public:
  template <camera::depth_source Depth, camera::camera_model Camera>
  depth_scan(const Depth& depth, const Camera& camera)
      : camera_{&camera}, fit_{[](const void* c, pixel_rays& rays) { rays.fit(*static_cast<const Camera*>(c)); }} {
    if constexpr (std::same_as<Depth, camera::depth_view<std::uint16_t>> ||
                  std::same_as<Depth, camera::depth_view<float>>)
      image_ = depth;
    else
      image_ = other_depth{&depth, static_cast<int>(depth.width()), static_cast<int>(depth.height()),
                           [](const void* d, int u, int v) -> float { return (*static_cast<const Depth*>(d))(u, v); }};
  }

  /// Calls `f(image)`, where `image` is a depth_view or an other_depth.
  template <class F>
  decltype(auto) visit(F&& f) const {
    return std::visit(f, image_);
  }
  /// Depth in metres, or 0 if there is no measurement.
  [[nodiscard]] float depth(int u, int v) const {
    return visit([&](const auto& image) { return image(u, v); });
  }
  /// Sets `rays` to the rays of the camera.
  void fit(pixel_rays& rays) const { fit_(camera_, rays); }

 private:
  std::variant<camera::depth_view<std::uint16_t>, camera::depth_view<float>, other_depth> image_;
  const void* camera_;
  void (*fit_)(const void* camera, pixel_rays& rays);
};

}  // namespace orbis::octree::detail

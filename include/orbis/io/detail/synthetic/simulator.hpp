// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A camera with a sensor that captures frames of painted solids.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/stereo_frame.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/io/detail/synthetic/camera_path.hpp>
#include <orbis/io/detail/synthetic/renderer.hpp>
#include <orbis/io/detail/synthetic/sensor.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>
#include <orbis/io/detail/synthetic/texture.hpp>
#include <orbis/io/synthetic_options.hpp>

namespace orbis::io::detail::synthetic {

/// The scene at one moment, and the camera's pose.
struct moment {
  std::vector<solid> solids;
  camera_pose pose;
};

/// Intrinsics of a pinhole camera with a focal length of 525 pixels at a width of 640 pixels.
[[nodiscard]] inline camera::intrinsics usual_intrinsics(int width, int height) noexcept {
  const double focal = 525.0 * width / 640.0;
  return {width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)};
}

/// Captures frames of a scene given as a function of time. Thread-safe; copies share the textures.
class simulator {
 public:
  /// `textures`: the textures of the solids to render. @pre depth_scale > 0
  simulator(std::shared_ptr<const texture_set> textures, const camera::intrinsics& k, double depth_scale,
            const synthetic_sensor_options& sensor, std::uint64_t seed)
      : textures_{std::move(textures)}, k_{k}, depth_scale_{depth_scale}, sensor_{sensor}, seed_{seed} {
    assert(depth_scale > 0.0);
  }

  /// Error-free colour, depth (metres) and angles of incidence at one moment; no colour image if `with_color` is false.
  template <execution_policy Policy>
  [[nodiscard]] exact_view exact(const Policy& policy, const moment& m, bool with_color = true) const {
    const renderer picture{m.solids, *textures_, m.pose, k_};
    exact_view out = blank(with_color);
    for_each_index(policy, static_cast<std::size_t>(picture.tile_rows()), 1,
                   [&](std::size_t row) { picture.render_tile_row(static_cast<int>(row), out); });
    return out;
  }

  /// Like `exact`, but row `y` of the image is exposed `row_time(y)` seconds after `time`. `at(t)` returns the
  /// `moment` at the time `t`.
  template <execution_policy Policy, class At, class RowTime>
  [[nodiscard]] exact_view exact_rows(const Policy& policy, const At& at, double time, const RowTime& row_time,
                                      bool with_color = true) const {
    exact_view out = blank(with_color);
    for_each_index(policy, static_cast<std::size_t>(k_.height), renderer::tile, [&](std::size_t row) {
      const int y = static_cast<int>(row);
      const moment m = at(time + row_time(y));
      renderer{m.solids, *textures_, m.pose, k_}.render_rows(y, y + 1, out);
    });
    return out;
  }

  /// The measured frame at `time`. `at(t)` returns the `moment` at the time `t`. `key`: different for each frame.
  template <execution_policy Policy, class At>
  [[nodiscard]] camera::rgbd_frame frame(const Policy& policy, const At& at, double time, std::uint64_t key) const {
    exact_view seen = color_view(policy, at, time);
    if (sensor_.motion_blur > 1) blur(policy, at, time, seen.color);
    if (!sensor_.shutter.is_depth_simultaneous()) {
      exact_view surface = depth_view(policy, at, time);
      seen.depth = std::move(surface.depth);
      seen.cosine = std::move(surface.cosine);
    }
    if (sensor_.depth_blur > 1) smear(policy, at, time, seen.depth);

    camera::rgbd_frame f;
    f.timestamp = time;
    f.depth_scale = depth_scale_;
    f.T_world_camera = at(time).pose.T_world_camera();
    f.depth = image<std::uint16_t>(k_.width, k_.height);
    const sensor errors{sensor_, k_.fx, depth_scale_, seed_, key};
    for_each_index(policy, static_cast<std::size_t>(k_.height), renderer::tile, [&](std::size_t row) {
      const int y = static_cast<int>(row);
      errors.measure_depth(seen, y, f.depth.row(y));
      errors.measure_colour(seen.color.row(y), y);
    });
    f.color = std::move(seen.color);
    return f;
  }

  /// The images of a stereo camera at `time`; its second camera is `baseline` metres to the right of the first. `at`
  /// and `key`: see `frame`.
  template <execution_policy Policy, class At>
  [[nodiscard]] camera::stereo_frame stereo(const Policy& policy, const At& at, double time, std::uint64_t key,
                                            double baseline) const {
    const auto beside = [&](double when) {
      moment m = at(when);
      m.pose.position = m.pose.position + baseline * m.pose.right;
      return m;
    };
    const auto picture = [&](const auto& from, std::uint64_t noise) {
      image<rgb8> color = color_view(policy, from, time).color;
      if (sensor_.motion_blur > 1) blur(policy, from, time, color);
      const sensor errors{sensor_, k_.fx, depth_scale_, noise, key};
      for_each_index(policy, static_cast<std::size_t>(k_.height), renderer::tile, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        errors.measure_colour(color.row(y), y);
      });
      return color;
    };
    return {time, picture(at, seed_), picture(beside, mix64(seed_ ^ 0x7269676874ULL)), at(time).pose.T_world_camera()};
  }

 private:
  [[nodiscard]] exact_view blank(bool with_color) const {
    return {with_color ? image<rgb8>(k_.width, k_.height) : image<rgb8>(), image<float>(k_.width, k_.height),
            image<float>(k_.width, k_.height)};
  }

  /// The exact view during the readout of the colour image, which is centred on `time`.
  template <execution_policy Policy, class At>
  [[nodiscard]] exact_view color_view(const Policy& policy, const At& at, double time) const {
    if (sensor_.shutter.color_read_out == 0.0) return exact(policy, at(time));
    return exact_rows(policy, at, time, [&](int y) { return sensor_.shutter.color_time(y, k_.height); });
  }

  /// The exact view, without colour, during the readout of the depth image of the frame at `time`.
  template <execution_policy Policy, class At>
  [[nodiscard]] exact_view depth_view(const Policy& policy, const At& at, double time) const {
    if (sensor_.shutter.depth_read_out == 0.0) return exact(policy, at(time + sensor_.shutter.depth_delay), false);
    return exact_rows(
        policy, at, time, [&](int y) { return sensor_.shutter.depth_time(y, k_.height); }, false);
  }

  /// The time of image `i` of `count` images, evenly distributed over an exposure that is centred on 0.
  [[nodiscard]] static double part_time(double exposure, int i, int count) noexcept {
    return exposure * ((i + 0.5) / count - 0.5);
  }

  /// Replaces each depth by the depth that corresponds to the mean disparity over the integration time, which is
  /// centred on the depth image's time. At an edge both surfaces contribute in proportion to the time for which the
  /// pixel sees them.
  template <execution_policy Policy, class At>
  void smear(const Policy& policy, const At& at, double time, image<float>& depth) const {
    const int count = sensor_.depth_blur;
    std::vector<double> sums(depth.pixels().size());
    for (int k = 0; k != count; ++k) {
      const exact_view part = depth_view(policy, at, time + part_time(sensor_.depth_exposure, k, count));
      for (std::size_t i = 0; i != sums.size(); ++i) sums[i] += 1.0 / static_cast<double>(part.depth.pixels()[i]);
    }
    for (std::size_t i = 0; i != sums.size(); ++i) depth.pixels()[i] = static_cast<float>(count / sums[i]);
  }

  /// Averages images that are evenly distributed over the exposure time, which is centred on `time`.
  template <execution_policy Policy, class At>
  void blur(const Policy& policy, const At& at, double time, image<rgb8>& color) const {
    const int count = sensor_.motion_blur;
    std::vector<std::uint32_t> sums(3 * color.pixels().size());
    for (int k = 0; k != count; ++k) {
      const exact_view part = color_view(policy, at, time + part_time(sensor_.exposure, k, count));
      for (std::size_t i = 0; i != color.pixels().size(); ++i) {
        const rgb8 c = part.color.pixels()[i];
        sums[3 * i] += c.r;
        sums[3 * i + 1] += c.g;
        sums[3 * i + 2] += c.b;
      }
    }
    const auto n = static_cast<std::uint32_t>(count);
    const auto mean = [&](std::size_t i) { return static_cast<std::uint8_t>((sums[i] + n / 2) / n); };
    for (std::size_t i = 0; i != color.pixels().size(); ++i)
      color.pixels()[i] = {mean(3 * i), mean(3 * i + 1), mean(3 * i + 2)};
  }

  std::shared_ptr<const texture_set> textures_;
  camera::intrinsics k_;
  double depth_scale_;
  synthetic_sensor_options sensor_;
  std::uint64_t seed_;
};

}  // namespace orbis::io::detail::synthetic

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Measurement of the subpixel positions of landmarks in the image of a frame, even if it is blurred.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/pyramid.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>
#include <orbis/slam/detail/tracking/exposure_estimation.hpp>
#include <orbis/slam/detail/tracking/patch_match.hpp>
#include <orbis/slam/detail/tracking/tracker.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/landmark_patch.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// The image of a frame, which must be valid while the frame is tracked.
struct frame_image {
  const features::image_pyramid* levels = nullptr;  ///< the pyramid used for the keypoints; null if not available
  /// Returns the depth at a pixel, metres; 0 if it is unknown. Empty if there is no depth image.
  std::function<double(const vec2& pixel)> depth_at{};

  [[nodiscard]] bool empty() const noexcept { return levels == nullptr || levels->empty(); }
};

/// Measures the positions of landmarks in the image of a frame by comparison with their patches. In a blurred image, a
/// detector finds a corner anywhere on its streak, whereas a patch is found where the landmark is in the middle of the
/// exposure, to a fraction of a pixel.
template <camera::camera_model Camera, feature_descriptor D>
class patch_tracker {
 public:
  patch_tracker(const camera_rig<Camera>& rig, const patch_options& settings) : rig_{rig}, options_{settings} {
    assert(!settings.exposure || (*settings.exposure >= 0.0 && std::isfinite(*settings.exposure)));
  }

  /// Sets the image of the next frame. It must remain valid until the next call.
  void set_image(frame_image image) { image_ = std::move(image); }
  /// Returns true if there is an image for measurements.
  [[nodiscard]] bool is_ready() const noexcept { return options_.enabled && !image_.empty(); }

  /// Returns a copy of the image. @pre is_ready()
  [[nodiscard]] image<std::uint8_t> copy_image() const { return image<std::uint8_t>{(*image_.levels)[0]}; }

  /// Takes over the estimated errors of another tracker: the exposure time, and the deviation of patch positions.
  void set_errors(const patch_tracker& other) {
    estimation_ = other.estimation_;
    deviation_ = other.deviation_;
  }
  /// The exposure time, given or estimated, seconds.
  [[nodiscard]] double exposure() const noexcept { return options_.exposure.value_or(estimation_.exposure()); }

  /// Moves the keypoints that observe landmarks to the positions of their patches in the image, and sets `f.spreads`.
  /// `twist`: the twist of the camera in its own frame, per second. Returns false if no patch is found. `estimates`:
  /// true if the frame contributes to the estimate of the exposure time. O(features).
  /// @pre is_ready()
  [[nodiscard]] bool align(basic_frame<D>& f, const basic_map<D>& m, const vec6& twist, bool estimates = true) {
    const double seconds = exposure();
    const se3 T_camera_world = f.T_world_camera.inverse();
    f.spreads.assign(f.size(), {});
    moved_.clear();
    std::size_t moving = 0;
    for (std::size_t i = 0; i != f.size(); ++i) {
      if (seconds == 0.0 && f.landmarks[i] == no_id) continue;  // without blur, there is no smear
      const double scale = rig_.scales.scale(f.features.keypoints[i].octave);
      constexpr double far = 1e3;  // metres
      const vec2 motion = image_motion(f.has_depth(i) ? f.point_camera(i) : vec3(far * f.rays[i]), twist);
      f.spreads[i] = make_spread(1.0, corner_smear(seconds / scale * motion));
      if (f.landmarks[i] == no_id) continue;
      const basic_landmark<D>& l = m.landmark_at(f.landmarks[i]);
      if (l.patch.pixels) __builtin_prefetch(l.patch.pixels->data());  // read after the prediction
      const auto view = predict_view(f, i, l, T_camera_world, motion);
      if (!view) continue;
      const std::size_t every = estimation_.has_enough() ? 32 : 4;  // compares one patch in this number, to save time
      if (estimates && !options_.exposure && shows_exposure(l.patch, *view) && moving++ % every == 0)
        compare_exposures(l.patch, *view);
      const auto found = match(l.patch, *view, seconds);
      if (!found || found->correlation < options_.min_correlation) continue;
      const vec2 shift = found->shift.x() * view->across + found->shift.y() * view->down;
      if (!move_keypoint(f, i, view->pixel + shift, view->delay)) continue;
      f.spreads[i] = patch_spread(l.patch, *view, scale, seconds);
    }
    if (moved_.empty() && seconds == 0.0) f.spreads.clear();  // all are the default
    f.grid.assign(f.features.keypoints);
    return !moved_.empty();
  }

  /// Aligns the patches of a frame and refines its pose. Returns the number of remaining landmarks; empty if no patch
  /// is found. `estimates`: see `align`. @pre is_ready()
  [[nodiscard]] std::optional<std::size_t> refine(basic_frame<D>& f, const basic_map<D>& m, const vec6& twist,
                                                  bool estimates = true) {
    if (!align(f, m, twist, estimates)) return std::nullopt;
    const std::size_t left = refine_on_landmarks(f, m, rig_);
    move_back(f, left == 0);
    return left;
  }

  /// Updates the standard deviation of patch positions from the reprojection errors of the last aligned frame at its
  /// refined pose.
  void update_deviation(const basic_frame<D>& f, const basic_map<D>& m) {
    constexpr std::size_t enough = 30;
    constexpr double least = 0.3, most = 1.0, rate = 0.05;
    errors_.clear();
    const se3 T_camera_world = f.T_world_camera.inverse();
    for (const moved_keypoint& k : moved_) {
      const std::size_t i = k.index;
      if (f.landmarks[i] == no_id) continue;
      const basic_landmark<D>& l = m.landmark_at(f.landmarks[i]);
      const auto at = l.patch.is_flat ? rig_.camera().project(T_camera_world * l.position) : std::nullopt;
      if (at) errors_.push_back(error_size(*at - f.pixel(i), f.spread(i)) / expected_scale(f, i, l.patch));
    }
    if (errors_.size() < enough) return;
    const auto middle = errors_.begin() + static_cast<std::ptrdiff_t>(errors_.size() / 2);
    std::nth_element(errors_.begin(), middle, errors_.end());
    constexpr double median_of_rayleigh = 1.1774;
    deviation_ += rate * (std::clamp(*middle / median_of_rayleigh, least, most) - deviation_);
  }

  /// Adds a patch from the image of a new keyframe to each of its landmarks that has none. The keypoints at which
  /// patches are taken define the image positions of the landmarks. `f`: the frame from which the keyframe was created.
  /// @pre is_ready()
  void add_patches(basic_map<D>& m, keyframe_id id, const basic_frame<D>& f, const vec6& twist) const {
    const se3 T_camera_world = f.T_world_camera.inverse();
    for (std::uint32_t i = 0; i != f.size(); ++i) {
      const landmark_id l = m.at(id).landmarks[i];
      if (l == no_id || m.landmark_at(l).patch.pixels != nullptr) continue;
      auto patch = patch_at(f, i, T_camera_world * m.landmark_at(l).position, twist);
      if (!patch) continue;
      m.set_patch(l, *std::move(patch));
      const double pixel = static_cast<double>(m.landmark_at(l).patch.coarseness);
      m.set_spread(id, i, make_spread(pixel * deviation_, zeros<vec2>()));
    }
  }

  /// Sets the motion of the patches of a map's first keyframe; this motion is known only after the next frame.
  /// @pre m.has_keyframe(id), is_ready()
  void set_first_motion(basic_map<D>& m, keyframe_id id, const vec6& twist) const {
    const auto& k = m.at(id);
    const se3 T_camera_world = k.T_world_camera.inverse();
    for (std::size_t i = 0; i != k.size(); ++i) {
      if (k.landmarks[i] == no_id || m.landmark_at(k.landmarks[i]).patch.pixels == nullptr) continue;
      const auto& l = m.landmark_at(k.landmarks[i]);
      const auto level = (*image_.levels)[static_cast<std::size_t>(k.features.keypoints[i].octave)];
      landmark_patch patch = l.patch;
      set_motion(patch, T_camera_world * l.position, static_cast<double>(patch.coarseness) * pixel_size(level), twist);
      m.set_patch(l.id, std::move(patch));
    }
  }

  /// Moves keypoints of the last aligned frame back to their detected positions: all, or those that no longer observe a
  /// landmark.
  void move_back(basic_frame<D>& f, bool all) const {
    for (const moved_keypoint& k : moved_) {
      if (!all && f.landmarks[k.index] != no_id) continue;
      f.features.keypoints[k.index].x = k.x, f.features.keypoints[k.index].y = k.y;
      f.spreads[k.index] = k.spread, f.depth[k.index] = k.depth, f.rays[k.index] = k.ray;
      if (!f.as_read.empty()) f.as_read[k.index] = k.read;
    }
    f.grid.assign(f.features.keypoints);
  }

 private:
  /// A keypoint before it was moved to the position of a patch.
  struct moved_keypoint {
    std::size_t index;
    float x, y, depth;
    pixel_spread spread;
    vec3 ray;
    keypoint_as_read read;
  };
  /// A landmark's expected placement in the image.
  struct patch_view {
    vec2 pixel, across, down;  ///< centre of the patch, and the steps between its pixels, in pixels of the image
    vec2 delay;                ///< motion from the frame's time to the time of the row, pixels of the image
    vec2 motion;               ///< pixels of the patch per second
    image_view<const std::uint8_t> level;
  };

  [[nodiscard]] static pixel_spread make_spread(double deviation, const vec2& smear) noexcept {
    return {static_cast<float>(deviation), static_cast<float>(smear.x()), static_cast<float>(smear.y())};
  }
  /// Returns the smear of a corner that may be found anywhere on its streak.
  [[nodiscard]] static vec2 corner_smear(const vec2& streak) { return streak / std::sqrt(12.0); }
  /// Returns the uncertainty of the position found for a patch. `scale`: size of a pixel of the keypoint's level,
  /// pixels of the image; `seconds`: exposure time. The constants were measured in simulated rooms: along the longer
  /// streak of patch and image, the error of a flat patch is 0.1 of its pixels if that streak has 8 pixels, and
  /// increases rapidly with the length, as little texture is left; patches with several surfaces have three times the
  /// error.
  [[nodiscard]] pixel_spread patch_spread(const landmark_patch& patch, const patch_view& v, double scale,
                                          double seconds) const {
    constexpr double error = 0.1, length = 8.0, power = 2.5, uneven = 3.0;
    const double times = patch.is_flat ? 1.0 : uneven;
    const vec2& motion = norm(patch.motion) > norm(v.motion) ? patch.motion : v.motion;
    const double streak = seconds * norm(motion);
    vec2 smear = zeros<vec2>();
    if (streak > 0.0) {
      const double along = error * std::pow(std::min(streak, line_kernel::longest) / length, power);
      const vec2 on_patch = along / norm(motion) * motion;
      smear = times / scale * vec2(on_patch.x() * v.across + on_patch.y() * v.down);
    }
    return make_spread(times * static_cast<double>(patch.coarseness) * deviation_, smear);
  }
  /// Returns the size of a position error; its median is that of an error with equal deviations in both directions.
  /// Along the smear, the error is ignored.
  [[nodiscard]] static double error_size(const vec2& error, const pixel_spread& spread) {
    constexpr double by_direction = 1.1774 / 0.6745;  // medians of the Rayleigh and the half-normal distribution
    const vec2 smear = spread.smear();
    const double size = norm(smear);
    if (!(size > 0.0)) return norm(error);
    return by_direction * std::abs(error.x() * smear.y() - error.y() * smear.x()) / size;
  }
  /// Returns the size of the pixels of a patch that keypoint `i` observes, expected from the keypoint's level, in
  /// pixels of the image.
  [[nodiscard]] double expected_scale(const basic_frame<D>& f, std::size_t i, const landmark_patch& patch) const {
    return rig_.scales.scale(f.features.keypoints[i].octave) * static_cast<double>(patch.coarseness);
  }
  /// Returns the position of keypoint `i` in the image, pixels.
  [[nodiscard]] static vec2 read_pixel(const basic_frame<D>& f, std::size_t i) {
    return f.as_read.empty() ? f.pixel(i)
                             : vec2(static_cast<double>(f.as_read[i].x), static_cast<double>(f.as_read[i].y));
  }
  /// Converts a pixel of the image to a pixel of a pyramid level.
  [[nodiscard]] vec2 on_level(const vec2& pixel, image_view<const std::uint8_t> level) const {
    return {features::image_pyramid::full_coordinate(pixel.x(), rig_.camera().width(), level.width()),
            features::image_pyramid::full_coordinate(pixel.y(), rig_.camera().height(), level.height())};
  }
  /// Returns the width and height of a pixel on a level, in pixels of the image.
  [[nodiscard]] vec2 pixel_size(image_view<const std::uint8_t> level) const {
    return {static_cast<double>(rig_.camera().width()) / level.width(),
            static_cast<double>(rig_.camera().height()) / level.height()};
  }
  /// Returns the motion of a point (camera frame, metres) in the image, pixels per second; 0 if it is out of view.
  [[nodiscard]] vec2 image_motion(const vec3& point, const vec6& twist) const {
    matrix<2, 3> by_point;
    if (!rig_.camera().project(point, by_point)) return zeros<vec2>();
    return by_point * (cross(tail<3>(twist), point) + head<3>(twist));
  }
  /// Returns the number of pyramid levels of the image that have a scale.
  [[nodiscard]] std::size_t levels() const {
    return std::min(image_.levels->size(), static_cast<std::size_t>(rig_.scales.levels()));
  }
  /// Returns the level whose pixel size is nearest to `scale` (pixels of the image).
  [[nodiscard]] std::size_t nearest_level(double scale) const {
    std::size_t level = 0;
    while (level + 1 < levels() && rig_.scales.scale(static_cast<int>(level)) * std::sqrt(rig_.scales.factor()) < scale)
      ++level;
    return level;
  }

  /// Returns the expected placement of landmark `l`, which keypoint `i` observes. Empty if the landmark has no patch,
  /// or if the patch is out of view or appears at a very different size.
  [[nodiscard]] std::optional<patch_view> predict_view(const basic_frame<D>& f, std::size_t i,
                                                       const basic_landmark<D>& l, const se3& T_camera_world,
                                                       const vec2& motion) const {
    if (l.patch.pixels == nullptr) return std::nullopt;
    constexpr double arm = 4.0;  // pixels of the patch
    const vec3 point = T_camera_world * l.position;
    const mat3 rotation = T_camera_world.rotation_matrix();
    const auto centre = rig_.camera().project(point);
    const auto right = rig_.camera().project(point + arm * (rotation * l.patch.across));
    const auto below = rig_.camera().project(point + arm * (rotation * l.patch.down));
    if (!centre || !right || !below) return std::nullopt;
    patch_view v;
    v.delay = read_pixel(f, i) - f.pixel(i);
    v.pixel = *centre + v.delay;
    v.across = (*right - *centre) / arm;
    v.down = (*below - *centre) / arm;
    const double area = v.across.x() * v.down.y() - v.across.y() * v.down.x();
    const double scale = expected_scale(f, i, l.patch), share = area / (scale * scale);
    constexpr double most = 5.0;
    if (!(share > 1.0 / most && share < most)) return std::nullopt;
    v.motion = {(v.down.y() * motion.x() - v.down.x() * motion.y()) / area,
                (v.across.x() * motion.y() - v.across.y() * motion.x()) / area};
    v.level = (*image_.levels)[nearest_level(std::sqrt(area))];
    return v;
  }
  [[nodiscard]] std::optional<patch_shift> match(const landmark_patch& patch, const patch_view& v,
                                                 double seconds) const {
    const vec2 size = pixel_size(v.level);
    const auto on_grid = [&](const vec2& step) { return vec2(step.x() / size.x(), step.y() / size.y()); };
    return match_patch(patch, seconds * patch.motion, seconds * v.motion, v.level,
                       {on_level(v.pixel, v.level), on_grid(v.across), on_grid(v.down)});
  }
  /// Returns true if the blur of the image differs from that of the patch. Opposite motions cause the same blur.
  [[nodiscard]] static bool shows_exposure(const landmark_patch& patch, const patch_view& v) {
    constexpr double visible = 100.0;  // pixels of the patch per second
    return std::min(norm(v.motion - patch.motion), norm(v.motion + patch.motion)) > visible;
  }
  void compare_exposures(const landmark_patch& patch, const patch_view& v) {
    std::array<double, exposure_estimation::count> correlations;
    for (std::size_t k = 0; k != correlations.size(); ++k) {
      const auto found = match(patch, v, exposure_estimation::candidate(k));
      if (!found) return;
      correlations[k] = found->correlation;
    }
    estimation_.add(correlations);
  }

  /// Moves keypoint `i` to a pixel of the image, and reads its depth there. `delay`: the motion from the frame's time
  /// to the time of the row. Returns false, without a change, if a pixel has no ray.
  bool move_keypoint(basic_frame<D>& f, std::size_t i, const vec2& to, const vec2& delay) {
    const auto read_ray = rig_.camera().unproject(to), ray = rig_.camera().unproject(to - delay);
    if (!read_ray || !ray) return false;
    auto& at = f.features.keypoints[i];
    moved_.push_back(
        {i, at.x, at.y, f.depth[i], f.spreads[i], f.rays[i], f.as_read.empty() ? keypoint_as_read{} : f.as_read[i]});
    at.x = static_cast<float>(to.x() - delay.x()), at.y = static_cast<float>(to.y() - delay.y());
    f.rays[i] = *ray / ray->z();
    const float stored = image_.depth_at ? static_cast<float>(image_.depth_at(to)) : f.depth[i];
    if (f.as_read.empty()) {
      f.depth[i] = stored;
      return true;
    }
    keypoint_as_read& read = f.as_read[i];
    read.x = static_cast<float>(to.x()), read.y = static_cast<float>(to.y());
    read.ray_x = read_ray->x() / read_ray->z(), read.ray_y = read_ray->y() / read_ray->z();
    if (!image_.depth_at) return true;
    // Applies the old pixel's correction for the time of the depth image to the new pixel.
    const auto corrected = [&](float depth) {
      if (!(read.stored_depth > 0.0F && stored > 0.0F)) return stored;
      return depth > 0.0F ? stored + (depth - read.stored_depth) : 0.0F;
    };
    f.depth[i] = corrected(f.depth[i]);
    read.depth = corrected(read.depth);
    read.stored_depth = stored;
    return true;
  }

  /// Sets the motion of a patch whose landmark is at `point` (camera frame, metres). `size`: size of its pixels, in
  /// pixels of the image.
  void set_motion(landmark_patch& patch, const vec3& point, const vec2& size, const vec6& twist) const {
    const vec2 motion = image_motion(point, twist);
    patch.motion = {motion.x() / size.x(), motion.y() / size.y()};
    const vec2 smear = corner_smear(exposure() * static_cast<double>(patch.coarseness) * patch.motion);
    patch.corner_deviation = static_cast<float>(std::sqrt(1.0 + squared_norm(smear)));
  }
  /// Returns true if a patch at `pixel` (pixels of the image) is inside a pyramid level.
  [[nodiscard]] bool has_room(const vec2& pixel, image_view<const std::uint8_t> level) const {
    constexpr double c = landmark_patch::centre;
    const vec2 at = on_level(pixel, level);
    return at.x() >= c && at.y() >= c && at.x() + c < level.width() - 1.01 && at.y() + c < level.height() - 1.01;
  }
  /// Returns the pyramid level for a patch at a keypoint of level `octave`: that level or, if a streak of `length`
  /// pixels of the image is too long for a patch there, a coarser one. @pre the patch has room on level `octave`
  [[nodiscard]] std::size_t patch_level(std::size_t octave, const vec2& pixel, double length) const {
    constexpr double longest = 10.0;  // pixels of the level
    while (length > longest * rig_.scales.scale(static_cast<int>(octave)) && octave + 1 < levels() &&
           has_room(pixel, (*image_.levels)[octave + 1]))
      ++octave;
    return octave;
  }
  /// Returns true if depth around `pixel`, where it is known, agrees with the plane through `point` (camera frame,
  /// metres) with the given steps per pixel of a patch, whose size is `size` pixels of the image.
  [[nodiscard]] bool is_flat(const vec2& pixel, const vec2& size, const vec3& point, const vec3& across,
                             const vec3& down) const {
    constexpr double arm = 5.0, tolerance = 0.06;  // pixels of the patch; fraction of the depth
    if (!image_.depth_at) return true;
    for (const double v : {-arm, 0.0, arm})
      for (const double u : {-arm, 0.0, arm}) {
        const double z = (point + u * across + v * down).z();
        const double measured = image_.depth_at(vec2(pixel.x() + u * size.x(), pixel.y() + v * size.y()));
        if (measured > 0.0 && std::abs(measured - z) > tolerance * z) return false;
      }
    return true;
  }
  /// Returns the patch around keypoint `i`, which observes `point` (camera frame, metres); empty near the border.
  [[nodiscard]] std::optional<landmark_patch> patch_at(const basic_frame<D>& f, std::size_t i, const vec3& point,
                                                       const vec6& twist) const {
    const auto octave = static_cast<std::size_t>(f.features.keypoints[i].octave);
    if (octave >= image_.levels->size() || !(point.z() > 0.0)) return std::nullopt;
    const vec2 pixel = read_pixel(f, i);
    if (!has_room(pixel, (*image_.levels)[octave])) return std::nullopt;
    const std::size_t chosen = patch_level(octave, pixel, exposure() * norm(image_motion(point, twist)));
    const auto level = (*image_.levels)[chosen];
    const vec2 at = on_level(pixel, level), size = pixel_size(level);
    const auto across = step_on_surface(pixel, vec2(size.x(), 0.0), point.z());
    const auto down = step_on_surface(pixel, vec2(0.0, size.y()), point.z());
    if (!across || !down) return std::nullopt;
    landmark_patch patch;
    patch.across = f.T_world_camera.rotation() * *across;
    patch.down = f.T_world_camera.rotation() * *down;
    patch.coarseness =
        static_cast<float>(rig_.scales.scale(static_cast<int>(chosen)) / rig_.scales.scale(static_cast<int>(octave)));
    set_motion(patch, point, size, twist);
    patch.is_flat = is_flat(pixel, size, point, *across, *down);
    constexpr double c = landmark_patch::centre;
    auto pixels = std::make_shared<landmark_patch::pixel_array>();
    for (int y = 0, k = 0; y != landmark_patch::size; ++y)
      for (int x = 0; x != landmark_patch::size; ++x, ++k) {
        const float value = interpolate(level, static_cast<float>(at.x() + x - c), static_cast<float>(at.y() + y - c));
        (*pixels)[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(0.5F + value);
      }
    patch.pixels = std::move(pixels);
    return patch;
  }
  /// Returns the motion on the surface (camera frame, metres) for a step in the image (pixels). If depth varies
  /// smoothly around the pixel, the slope of the surface is measured; otherwise the surface is assumed parallel to the
  /// image. `z`: depth at the pixel, metres. Empty if a pixel has no ray.
  [[nodiscard]] std::optional<vec3> step_on_surface(const vec2& pixel, const vec2& step, double z) const {
    constexpr double arm = 4.0, unevenness = 0.01, steepest = 0.1;  // steps; fractions of the depth
    const vec2 before = pixel - arm * step, after = pixel + arm * step;
    const auto ray_before = rig_.camera().unproject(before), ray_after = rig_.camera().unproject(after);
    if (!ray_before || !ray_after) return std::nullopt;
    double rise = 0.0;
    if (image_.depth_at)
      if (const double a = image_.depth_at(before), b = image_.depth_at(after); a > 0.0 && b > 0.0)
        if (std::abs(0.5 * (a + b) - z) < unevenness * z && std::abs(b - a) < steepest * z) rise = 0.5 * (b - a);
    const vec3 end = (z + rise) / ray_after->z() * *ray_after, begin = (z - rise) / ray_before->z() * *ray_before;
    return vec3((end - begin) / (2.0 * arm));
  }

  const camera_rig<Camera>& rig_;
  const patch_options& options_;
  frame_image image_;
  exposure_estimation estimation_;
  double deviation_ = 0.5;             ///< standard deviation of a patch's position, pixels of its level
  std::vector<moved_keypoint> moved_;  ///< keypoints of the last aligned frame
  std::vector<double> errors_;         ///< reused working memory
};

}  // namespace orbis::slam::detail

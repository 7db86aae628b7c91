// SPDX-License-Identifier: BSD-3-Clause
#include "camera_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>

namespace app {
namespace {

// A wrong focal length compensates for distortion to some extent. If distortion fits the images better, or is not
// determined, the images provide little evidence about the focal length.
constexpr double somewhat = 0.98, clearly = 0.95;  // ratios of the errors

/// The parameter fx; null if it is missing.
const orbis::slam::calibrated_parameter* find_focal(std::span<const orbis::slam::calibrated_parameter> found) {
  const auto fx = std::ranges::find(found, "fx", &orbis::slam::calibrated_parameter::name);
  return fx != found.end() ? &*fx : nullptr;
}

}  // namespace

orbis::camera::any_camera with_lens(const orbis::camera::any_camera& camera) {
  const auto* const plain = camera.get_if<orbis::camera::pinhole>();
  return plain != nullptr ? orbis::camera::radial_tangential{plain->k(), {}} : camera;
}

bool has_other_focal_length(std::span<const orbis::slam::calibrated_parameter> found) {
  constexpr double least_change = 0.015, sigmas = 6.0;
  const auto* const fx = find_focal(found);
  if (fx == nullptr) return false;
  const double change = std::abs(fx->after - fx->before);  // 0 if it was held
  return change > sigmas * fx->deviation && change > least_change * fx->before;
}

std::optional<focal_doubt> find_doubt(std::span<const orbis::slam::calibrated_parameter> found) {
  if (std::ranges::any_of(found, &orbis::slam::calibrated_parameter::is_held) || !has_other_focal_length(found))
    return std::nullopt;
  const auto* const fx = find_focal(found);
  return focal_doubt{fx->before, fx->after};
}

std::optional<focal_doubt> find_doubt(const orbis::slam::map& map, const orbis::camera::any_camera& camera,
                                      const orbis::slam::options& options, const orbis::progress& go_on) {
  constexpr std::size_t few = 8;  // keyframes
  if (map.keyframes().size() < few) return std::nullopt;
  const orbis::slam::calibration_options small{
      .max_keyframes = 60, .max_landmarks = 1500, .needs_all = true, .relative_tolerance = 1e-6};
  const auto as_given = orbis::slam::calibrate(map, orbis::slam::make_rig(camera, options), small, go_on);
  auto doubt = as_given ? find_doubt(as_given->parameters) : std::nullopt;
  if (!doubt || camera.get_if<orbis::camera::pinhole>() == nullptr) return doubt;
  const auto lens = compare_lens(map, camera, *as_given, options, small, go_on);
  if (!lens || lens->lens_rms < clearly * lens->pinhole_rms) return std::nullopt;
  doubt->is_sure = !lens->has_distortion();
  return doubt;
}

bool lens_comparison::has_distortion() const { return is_determined && lens_rms < somewhat * pinhole_rms; }

std::optional<lens_comparison> compare_lens(const orbis::slam::map& map, const orbis::camera::any_camera& camera,
                                            const orbis::slam::calibration_summary& as_pinhole,
                                            const orbis::slam::options& options,
                                            const orbis::slam::calibration_options& how, const orbis::progress& go_on) {
  if (camera.get_if<orbis::camera::pinhole>() == nullptr) return std::nullopt;
  const auto bent = orbis::slam::calibrate(map, orbis::slam::make_rig(with_lens(camera), options), how, go_on);
  if (!bent) return std::nullopt;
  return lens_comparison{find_focal(as_pinhole.parameters)->after, find_focal(bent->parameters)->after,
                         as_pinhole.final_rms, bent->final_rms, bent->is_complete()};
}

std::string describe(const lens_comparison& lens) {
  if (!lens.is_determined)
    return "the motion does not determine whether the lens has distortion; if it has, the estimated focal length "
           "compensates for it and is wrong";
  char text[240];
  std::snprintf(text, sizeof text,
                "a lens with distortion fits the images better (error %.3f instead of %.3f standard deviations), with "
                "a focal length of %.0f instead of %.0f pixels: see --distortion",
                lens.lens_rms, lens.pinhole_rms, lens.lens_focal, lens.pinhole_focal);
  return text;
}

std::string describe(const focal_doubt& doubt) {
  char text[200];
  std::snprintf(text, sizeof text,
                "the camera's focal length is doubtful: %.0f pixels fit the images better than %.0f (%+.1f %%); "
                "rgbd_slam calibrate estimates the camera",
                doubt.found, doubt.given, 100.0 * (doubt.found - doubt.given) / doubt.given);
  return text;
}

}  // namespace app

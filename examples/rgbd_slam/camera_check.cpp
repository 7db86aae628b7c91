// SPDX-License-Identifier: BSD-3-Clause
#include "camera_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>

namespace app {
namespace {

// A focal length makes up for a lens that bends, to some extent: images that such a lens explains better, or that do
// not tell, say little about the focal length.
constexpr double somewhat = 0.98, clearly = 0.95;  // of the error

auto calibrate_small(const orbis::slam::map& map, const orbis::camera::any_camera& camera,
                     const orbis::slam::options& options) {
  return orbis::slam::calibrate(map, orbis::slam::make_rig(camera, options), {.max_keyframes = 60});
}

double focal_of(const orbis::slam::calibration_summary& found) {
  const auto fx = std::ranges::find(found.parameters, "fx", &orbis::slam::calibrated_parameter::name);
  return fx != found.parameters.end() ? fx->after : 0.0;
}

}  // namespace

orbis::camera::any_camera with_lens(const orbis::camera::any_camera& camera) {
  const auto* const plain = camera.get_if<orbis::camera::pinhole>();
  return plain != nullptr ? orbis::camera::radial_tangential{plain->k(), {}} : camera;
}

std::optional<focal_doubt> find_doubt(std::span<const orbis::slam::calibrated_parameter> found) {
  if (std::ranges::any_of(found, &orbis::slam::calibrated_parameter::is_held)) return std::nullopt;
  constexpr double least_change = 0.015, sigmas = 6.0;
  for (const auto& p : found) {
    if (p.name != "fx") continue;
    const double change = std::abs(p.after - p.before);
    if (change > sigmas * p.deviation && change > least_change * p.before) return focal_doubt{p.before, p.after};
  }
  return std::nullopt;
}

std::optional<focal_doubt> find_doubt(const orbis::slam::map& map, const orbis::camera::any_camera& camera,
                                      const orbis::slam::options& options) {
  constexpr std::size_t few = 8;  // keyframes
  if (map.keyframes().size() < few) return std::nullopt;
  const auto as_given = calibrate_small(map, camera, options);
  auto doubt = as_given ? find_doubt(as_given->parameters) : std::nullopt;
  if (!doubt || camera.get_if<orbis::camera::pinhole>() == nullptr) return doubt;
  const auto bent = calibrate_small(map, with_lens(camera), options);
  if (!bent || !bent->is_complete() || bent->final_rms < clearly * as_given->final_rms) return std::nullopt;
  doubt->is_sure = bent->final_rms >= somewhat * as_given->final_rms;
  return doubt;
}

bool lens_comparison::has_distortion() const { return is_determined && lens_rms < somewhat * pinhole_rms; }

std::optional<lens_comparison> compare_lens(const orbis::slam::map& map, const orbis::camera::any_camera& camera,
                                            const orbis::slam::options& options) {
  if (camera.get_if<orbis::camera::pinhole>() == nullptr) return std::nullopt;
  const auto plain = calibrate_small(map, camera, options), bent = calibrate_small(map, with_lens(camera), options);
  if (!plain || !bent) return std::nullopt;
  return lens_comparison{focal_of(*plain), focal_of(*bent), plain->final_rms, bent->final_rms, bent->is_complete()};
}

std::string in_words(const lens_comparison& lens) {
  if (!lens.has_distortion())
    return "the motion does not tell whether the lens has distortion; if it has, the focal length that was found makes "
           "up for it and is wrong";
  char text[240];
  std::snprintf(text, sizeof text,
                "a lens with distortion explains the images better (their error is %.3f instead of %.3f deviations), "
                "and its focal length would be %.0f instead of %.0f pixels: see --distortion",
                lens.lens_rms, lens.pinhole_rms, lens.lens_focal, lens.pinhole_focal);
  return text;
}

std::string in_words(const focal_doubt& doubt) {
  char text[200];
  std::snprintf(text, sizeof text,
                "the camera's focal length is doubtful: the images fit %.0f pixels better than %.0f (%+.1f %%); "
                "rgbd_slam calibrate finds a camera for them",
                doubt.found, doubt.given, 100.0 * (doubt.found - doubt.given) / doubt.given);
  return text;
}

}  // namespace app

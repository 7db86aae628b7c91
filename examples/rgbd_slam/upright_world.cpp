// SPDX-License-Identifier: BSD-3-Clause
#include "upright_world.hpp"

#include <cmath>
#include <numbers>
#include <string>

#include <Eigen/Geometry>

#include <orbis/mapping/upright.hpp>

namespace app {

using orbis::se3;
using orbis::so3;
using orbis::vec3;
using orbis::mapping::upright_source;

upright_worlds::upright_worlds(const frame_source& source, const settings& s)
    : rays_{source.camera.model}, gravity_{s.gravity}, follows_truth_{!source.truth_has_positions_only} {}

se3 upright_worlds::start_world(const orbis::camera::rgbd_frame& frame, bool is_first) {
  orbis::mapping::upright_options options;
  if (is_first) options.gravity_camera = gravity_;
  // A monocular frame counts as an image without depth.
  const orbis::image<std::uint16_t> nothing(frame.color.width(), frame.color.height());
  const auto view = orbis::mapping::find_upright(
      frame.depth.empty() ? orbis::camera::depth_view<std::uint16_t>{nothing.view(), 1.0} : frame.depth_metres(), rays_,
      options);
  world_results& how = begun_[frame.timestamp];
  how = {std::string{to_string(view.source)}, view.confidence};
  if (!frame.T_world_camera || !follows_truth_) return {view.R_world_camera, vec3::Zero()};

  // If the z axis of the ground truth points up within the accuracy of the estimate, it is assumed to be exact.
  const double reach = (view.source == upright_source::assumed ? 45.0 : 10.0) * std::numbers::pi / 180.0;
  const vec3 up = frame.T_world_camera->rotation() * view.up_camera();
  const vec3 axis = up.cross(vec3::UnitZ());
  const double sine = axis.norm(), tilt = std::atan2(sine, up.z());
  if (tilt <= reach) {
    how.up_from = "ground truth";
    return *frame.T_world_camera;
  }
  const vec3 any_horizontal = vec3::UnitX();  // if `up` points down
  const so3 upright = so3::exp(tilt * (sine > 0.0 ? vec3(axis / sine) : any_horizontal));
  return se3{upright, vec3::Zero()} * *frame.T_world_camera;
}

std::optional<world_results> upright_worlds::world_starting_at(double timestamp) const {
  const auto at = begun_.lower_bound(timestamp);  // a monocular map starts with two frames; callers pass the second
  if (at == begun_.end()) return std::nullopt;
  return at->second;
}

}  // namespace app

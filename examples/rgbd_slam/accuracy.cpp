// SPDX-License-Identifier: BSD-3-Clause
#include "accuracy.hpp"

#include <orbis/eval/ate.hpp>
#include <orbis/eval/cloud_error.hpp>
#include <orbis/eval/orientations.hpp>
#include <orbis/eval/rpe.hpp>

#include "summary.hpp"

namespace app {

orbis::result<accuracy> compare(const orbis::trajectory& estimate, const orbis::trajectory& truth, bool with_scale) {
  const auto ate = orbis::eval::ate(estimate, truth, {.with_scale = with_scale});
  if (!ate) return orbis::fail(ate.error());
  accuracy a;
  a.scale = ate->aligned.scale;
  orbis::trajectory in_metres = estimate;
  for (orbis::stamped_pose& p : in_metres)
    p.T_world_camera = {p.T_world_camera.rotation(), a.scale * p.T_world_camera.translation()};
  a.ate_rmse_m = ate->translation.rmse;
  a.ate_mean_m = ate->translation.mean;
  a.ate_median_m = ate->translation.median;
  a.ate_max_m = ate->translation.max;
  a.T_truth_estimate = ate->aligned.T_reference_estimate;
  if (const auto rpe = orbis::eval::rpe(in_metres, truth)) {
    a.rpe_trans_rmse_m = rpe->translation.rmse;
    a.rpe_rot_rmse_deg = rpe->rotation.rmse;
  } else {
    a.no_rpe = rpe.error().message;
  }
  const auto pairs = orbis::eval::pair_poses(in_metres, truth, orbis::eval::alignment_options{}.max_time_difference);
  const auto by_pose = orbis::eval::align_poses(pairs);
  a.truth_lacks_orientations = orbis::eval::lacks_orientations(pairs);
  a.T_truth_map = by_pose && !a.truth_lacks_orientations ? by_pose->T_reference_estimate : a.T_truth_estimate;
  const orbis::se3 T_estimate_truth = a.T_truth_estimate.inverse();
  for (const auto& pair : pairs) {
    const orbis::vec3 p = pair.estimate.translation();
    const orbis::vec3 q = T_estimate_truth * pair.reference.translation();
    a.poses.push_back({pair.timestamp, p / a.scale, q / a.scale, (p - q).norm()});
  }
  return a;
}

orbis::result<double> map_error(const orbis::point_cloud& cloud, const std::vector<std::uint32_t>& kept,
                                const orbis::se3& T_truth_map,
                                const std::function<double(const orbis::vec3&)>& surface_distance) {
  std::vector<orbis::vec3> points;
  points.reserve(kept.size());
  for (const std::uint32_t i : kept) points.push_back(T_truth_map * cloud.points[i].cast<double>());
  const auto error = orbis::eval::cloud_to_surface(orbis::par, points, surface_distance);
  if (!error) return orbis::fail(error.error());
  return error->distance.rmse;
}

void compare_with_truth(results& r, const frame_source& source, console& console) {
  if (source.ground_truth.empty()) {
    r.truth_note = "No ground truth.";
    return;
  }
  console.stage("comparing");
  auto compared = compare(r.slam->trajectory, source.ground_truth, source.is_monocular());
  if (!compared) {
    r.truth_note = "Not compared with ground truth.";
    r.warnings.push_back(compared.error().to_string());
    console.warn(compared.error().to_string());
    return;
  }
  r.truth_note = source.is_monocular() ? "Compared with ground truth after similarity alignment of the trajectories."
                                       : "Compared with ground truth after rigid alignment of the trajectories.";
  if (source.surface_distance && r.map) {
    const auto error = map_error(r.map->cloud, r.map->kept, compared->T_truth_map, source.surface_distance);
    if (error) r.map->error_m = *error;
    r.truth_note += " The map error is that of the filtered cloud after alignment by the poses.";
  }
  if (!compared->no_rpe.empty()) console.warn(r.warnings.emplace_back("no RPE: " + compared->no_rpe));
  if (compared->truth_lacks_orientations && !source.truth_has_positions_only)
    console.warn(r.warnings.emplace_back(
        "all orientations in the ground truth are equal, but the camera turns: the world frames differ"));
  r.against_truth = *std::move(compared);
  console.finish("ATE and RPE" + std::string{r.map && r.map->error_m ? ", map error" : ""});
}

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
//
// Clouds whose outliers are known: surfaces seen by a depth camera, with one kind of trouble added.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>

#include "rooms.hpp"

namespace orbis::bench {

/// What a filter may know beside the points.
enum class known { points, ranges, views };

enum class trouble {
  none,
  uniform_1,  ///< per cent of the points, anywhere
  uniform_5,
  uniform_20,
  flying,      ///< pixels between the two sides of a depth edge
  gross,       ///< range errors that grow with the square of the range
  floaters,    ///< small clusters in free space
  ghosting,    ///< a quarter of the views with a wrong pose
  moving,      ///< somebody walks by
  mixture,     ///< uniform, flying, gross, floaters
  voxel_none,  ///< merged into voxels: nothing, uniform 5 %, mixture
  voxel_uniform,
  voxel_mixture,
  density_none,  ///< some regions sampled ten times denser, a close-up among far views
  density_uniform
};
inline constexpr trouble all_troubles[]{trouble::none,          trouble::uniform_1,    trouble::uniform_5,
                                        trouble::uniform_20,    trouble::flying,       trouble::gross,
                                        trouble::floaters,      trouble::ghosting,     trouble::moving,
                                        trouble::mixture,       trouble::voxel_none,   trouble::voxel_uniform,
                                        trouble::voxel_mixture, trouble::density_none, trouble::density_uniform};
[[nodiscard]] std::string_view to_string(trouble t);
[[nodiscard]] constexpr bool is_clean(trouble t) {
  return t == trouble::none || t == trouble::voxel_none || t == trouble::density_none;
}

enum class label : std::uint8_t { clean, outlier, unsure };  ///< unsure: does not count

/// A view as filters take it.
struct posed_view {
  camera::depth_view<float> depth;
  se3 T_world_camera;
};

struct labelled_case {
  std::string source;
  trouble kind = trouble::none;
  known context = known::points;
  std::vector<vec3f> points;
  std::vector<label> labels;
  std::vector<float> ranges;  ///< metres, from the view of each point
  std::vector<image<float>> images;
  std::vector<posed_view> views;  ///< into `images`
  camera::pinhole camera;
  std::function<double(const vec3&)> distance;  ///< metres to the true surface; empty: not known

  [[nodiscard]] std::string name() const { return source + "/" + std::string{to_string(kind)}; }
};

/// Depth images of a surface without outliers, and where the surface is.
struct surface {
  struct shot {
    image<float> depth;  ///< measured, metres, 0: none
    se3 T_world_camera;
  };
  std::string name;
  known context = known::points;
  depth_sensor sensor;
  std::vector<shot> shots;
  shot close_up;                                ///< an additional one from near the surface; empty where there is none
  std::function<double(const vec3&)> distance;  ///< metres
  bool exact = true;                            ///< whether `distance` is the true surface, not points of it
  room scene;                                   ///< without solids for real recordings
  int stride = 2;                               ///< of the pixels that become points
  std::uint64_t seed = 0;
};

struct synthetic_source {
  room_kind kind;
  std::uint64_t seed;
  depth_sensor sensor;
  int views;
  known context;
};
[[nodiscard]] surface make_surface(const synthetic_source& source);

struct real_source {
  std::string folder;
  std::size_t first, step, count;
  known context;
};
/// Pixels that at least two other views confirm; empty where the recording is not at hand.
[[nodiscard]] std::vector<surface> real_surface(const std::filesystem::path& data, const real_source& source);

/// Whether the trouble makes sense for the surface.
[[nodiscard]] bool applies(trouble kind, const surface& s);
[[nodiscard]] labelled_case make_case(const surface& s, trouble kind);

/// The surfaces of a set: "tuning" or "judging". They share no room, sensor, seed or recording.
[[nodiscard]] std::vector<surface> surfaces_of(const std::string& set, const std::filesystem::path& data);

}  // namespace orbis::bench

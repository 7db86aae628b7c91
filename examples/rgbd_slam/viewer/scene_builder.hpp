// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Builds the scene from tracked frames and from data of SLAM and the live map.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include <orbis/camera/rays.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/track_result.hpp>

#include "results.hpp"
#include "viewer/scene.hpp"
#include "voxel_colors.hpp"

namespace app {

/// A frame for the viewer.
struct viewer_frame {
  std::uint64_t number = 0;  ///< index in the recording
  std::string state{};
  double tracking_ms = 0.0;
  std::optional<orbis::se3> T_world_camera{};
  std::optional<orbis::slam::tracked_frame> tracked{};  ///< empty if the frame was not tracked
  std::optional<orbis::slam::map_keyframe> keyframe{};  ///< set if the frame became a keyframe
  orbis::image<orbis::rgb8> color{};
  orbis::image<std::uint16_t> depth{};  ///< used for keyframes only
  double depth_scale = 1.0;
};

/// Keyframes of SLAM and their graph.
struct slam_graph {
  std::vector<orbis::slam::map_keyframe> asked;  ///< requested keyframes, identified by their ids at creation
  /// The poses of the requested keyframes; empty for keyframes that are not in the active map. The scale of a pose
  /// applies to positions stored in the keyframe's frame; it is 1 unless the camera is monocular.
  std::vector<std::optional<orbis::sim3>> poses;
  std::vector<orbis::se3> keyframes;  ///< keyframe poses of the active map
  std::vector<shown_edge> edges;      ///< edges between the keyframes in `keyframes`
};

/// Data sources of the scene in addition to frames. `update` calls them; each may be empty.
struct scene_sources {
  /// Fills in a graph, except `asked`, and returns true. Returns false if the poses have not changed since the last
  /// call and `always` is false.
  std::function<bool(slam_graph& graph, bool always)> graph{};
  /// Fills in the occupied cubes of the newest map, without colours, and returns true. Returns false if the map has not
  /// changed since the last call.
  std::function<bool(std::vector<voxel>& cubes)> voxels{};
  std::function<live_results()> numbers{};
};

class scene_builder {
 public:
  /// Default maximum number of keyframe pixels that are stored for the colours of voxels: 48 MB.
  static constexpr std::size_t default_max_samples = 4'000'000;

  /// `frames`: number of frames in the recording. `resolution`: voxel size of the map, metres. `max_samples`: above
  /// this number of pixels, every other pixel of the keyframe with the most pixels is discarded.
  scene_builder(std::string title, std::size_t frames, orbis::camera::ray_table rays, double resolution,
                std::size_t max_samples = default_max_samples);
  scene_builder(const scene_builder&) = delete;
  scene_builder& operator=(const scene_builder&) = delete;
  ~scene_builder();

  /// Replaces the camera. No other function may run at the same time; the same holds for `begin`.
  void set_camera(orbis::camera::ray_table rays);
  /// Prepares for the first frame of a run; after `finish`, clears the scene.
  void begin();

  /// Adds a frame. Lock-free; never waits for the other functions. If the previous frame is not in the scene yet, this
  /// frame replaces it, but the points of the path and the colours of keyframes are kept. Stores a limited number of
  /// colours between two updates, and samples the colours of a keyframe during the call. Call it from one thread only.
  void push(viewer_frame frame);

  /// Updates the scene and returns it. Queries SLAM and the map at most every few hundred milliseconds and spends at
  /// most a tenth of the time on each.
  const viewer_scene& update(const scene_sources& sources);
  /// Like `update`, but always queries immediately.
  const viewer_scene& update_at_once(const scene_sources& sources);
  /// Updates the scene like `update_at_once`, then frees the data needed to apply later corrections. Call it after the
  /// last frame.
  void finish(const scene_sources& sources);
  /// Frees the data needed to apply later corrections. The scene remains unchanged.
  void forget();
  /// Replaces the voxels of the live map.
  void set_voxels(std::vector<voxel> colored);
  /// Sets the reason why there is no live map. From then on, no keyframe pixels are stored.
  void set_no_voxels(std::string why) {
    scene_.voxels.absent = std::move(why);
    forget_colors();
  }
  /// The number of keyframe pixels that are stored for the colours of voxels.
  [[nodiscard]] std::size_t color_samples() const { return sample_count_; }

 private:
  using clock = std::chrono::steady_clock;

  /// A keyframe pixel with depth, sampled on a grid, that colours voxels.
  struct sample {
    std::uint16_t x, y;  // pixels
    float depth;         // metres
    orbis::rgb8 color;
  };
  struct colored_keyframe {
    std::size_t asked = 0;  // index of the keyframe's pose in the request
    std::vector<sample> samples;
    std::optional<orbis::se3> placed;  // pose at which the keyframe's colours were added
  };
  struct passed_point {
    orbis::slam::map_keyframe reference;
    orbis::vec3f at;  // in the frame of the reference keyframe, divided by the keyframe's scale
    bool begins;
  };
  struct trail_item {
    std::size_t asked;
    orbis::vec3f at;
    bool begins;
  };
  /// Frames that are not in the scene yet.
  struct mailbox {
    std::optional<viewer_frame> newest;
    std::vector<passed_point> passed;
    std::vector<std::pair<orbis::slam::map_keyframe, std::vector<sample>>> keyframes;
    std::size_t samples = 0;  // total number of samples of the keyframes
    std::vector<double> tracking_ms;
  };
  /// The time of the next query, chosen such that queries take at most a tenth of the time.
  struct pace {
    std::chrono::milliseconds least;
    clock::time_point next{};
    [[nodiscard]] bool is_due(clock::time_point now) const { return now >= next; }
    void ran(clock::time_point from, clock::time_point to) {
      next = to + std::max<clock::duration>(least, 9 * (to - from));
    }
  };

  [[nodiscard]] std::vector<sample> take_samples(const viewer_frame& frame) const;
  [[nodiscard]] std::size_t index_of(orbis::slam::map_keyframe k);
  const viewer_scene& update(const scene_sources& sources, bool at_once);
  void read_mailbox();
  template <class Use>
  void for_each_point(const std::vector<sample>& samples, const orbis::se3& T_world_camera, const Use& use) const;
  /// Discards pixels of keyframes until their number is within the limit.
  void make_room();
  void forget_colors();
  void update_graph(const scene_sources& sources, bool at_once);
  void draw_trail();
  /// Moves the colours of keyframes that have moved, a limited number per call; returns false if some are left.
  bool move_colors(std::size_t limit);
  void update_voxels(const scene_sources& sources, bool at_once);
  void show_cubes();
  void update_numbers(const scene_sources& sources);

  orbis::camera::ray_table rays_;
  const double resolution_;
  const int step_;  // pixels from one sample to the next
  const std::size_t max_samples_;

  std::atomic<mailbox*> box_{nullptr};  // owned
  std::atomic<bool> takes_colors_{true};
  std::optional<orbis::slam::map_keyframe> last_reference_;  // this and the next two are used by the tracking thread
  orbis::vec3f last_at_ = orbis::vec3f::Zero();
  bool was_lost_ = true;

  viewer_scene scene_;
  slam_graph graph_;
  std::unordered_map<std::uint64_t, std::size_t> asked_;  // keyframe -> index in graph_.asked
  std::vector<trail_item> trail_;
  std::vector<colored_keyframe> colored_;
  std::size_t sample_count_ = 0;  // total number of samples in colored_
  voxel_colors colors_;
  std::vector<voxel> cubes_;
  std::vector<double> tracking_ms_;  // ring buffer of the last frames
  std::size_t frames_seen_ = 0;
  bool graph_asked_more_ = false, colors_changed_ = false, colors_wait_ = false, has_final_voxels_ = false;
  pace graph_pace_{std::chrono::milliseconds{150}}, voxel_pace_{std::chrono::milliseconds{250}},
      number_pace_{std::chrono::milliseconds{200}};
};

/// The rays through the corners of the images. @pre `rays` is not empty
[[nodiscard]] frustum_rays corner_rays(const orbis::camera::ray_table& rays);

}  // namespace app

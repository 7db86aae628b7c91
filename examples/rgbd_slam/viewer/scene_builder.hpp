// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Fills the scene with what tracking hands over and with what SLAM and the live map say when they are asked.
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

/// A frame as tracking hands it over.
struct handed_frame {
  std::uint64_t number = 0;  ///< in the recording
  std::string state{};
  double tracking_ms = 0.0;
  std::optional<orbis::se3> T_world_camera{};
  std::optional<orbis::slam::tracked_frame> tracked{};  ///< empty where it was not
  std::optional<orbis::slam::map_keyframe> keyframe{};  ///< that it became
  orbis::image<orbis::rgb8> color{};
  orbis::image<std::uint16_t> depth{};  ///< used of keyframes
  double depth_scale = 1.0;
};

/// Keyframes and their graph, as SLAM has them.
struct slam_graph {
  std::vector<orbis::slam::map_keyframe> asked;  ///< keyframes whose poses are wanted, by the ids that they once had
  /// Of these, with the scale of what was noted relative to them (1 with depth); empty where they are not in the active
  /// map.
  std::vector<std::optional<orbis::sim3>> poses;
  std::vector<orbis::se3> keyframes;  ///< of the active map
  std::vector<shown_edge> edges;      ///< between them
};

/// Where the scene comes from besides frames. All are called by `update`; any may be empty.
struct scene_sources {
  /// Fills in a graph but for `asked` and returns true; or false if the poses are those of the last call and `always`
  /// is false.
  std::function<bool(slam_graph& graph, bool always)> graph{};
  /// Fills in the occupied cubes of the newest map, without colours, and returns true; or false if they are those of
  /// the last call.
  std::function<bool(std::vector<voxel>& cubes)> voxels{};
  std::function<live_results()> numbers{};
};

class scene_builder {
 public:
  /// Pixels of keyframes that are kept for the colours of voxels, by default: 48 MB of them.
  static constexpr std::size_t default_max_samples = 4'000'000;

  /// `frames`: of the recording. `resolution`: of the map, metres. `max_samples`: where more pixels would be kept,
  /// every other one of the keyframe that has most is given up.
  scene_builder(std::string title, std::size_t frames, orbis::camera::ray_table rays, double resolution,
                std::size_t max_samples = default_max_samples);
  scene_builder(const scene_builder&) = delete;
  scene_builder& operator=(const scene_builder&) = delete;
  ~scene_builder();

  /// Takes a frame over. Has no lock, and never waits for the other functions: what was not yet taken into the scene is
  /// replaced by it, but for the path of the camera and the colours of keyframes; of these, those that would be too
  /// much until they are taken are left out. Of a keyframe it reads the pixels that are kept. For one thread.
  void hand_over(handed_frame frame);

  /// Brings the scene up to date, and returns it. SLAM is asked at most every few hundred milliseconds, and at most a
  /// tenth of the time; the map as well.
  const viewer_scene& update(const scene_sources& sources);
  /// As above, but asks at once.
  const viewer_scene& update_at_once(const scene_sources& sources);
  /// As above, for the last time: no frame comes any more. Frees what was kept to follow corrections.
  void finish(const scene_sources& sources);
  /// Frees what was kept to follow corrections. The scene stays as it is.
  void forget();
  /// Shows these voxels from now on, instead of the live map's.
  void set_voxels(std::vector<voxel> colored);
  /// Says why there is no live map whose voxels could be shown. Then no pixels of keyframes are kept.
  void set_no_voxels(std::string why) {
    scene_.voxels.absent = std::move(why);
    forget_colors();
  }
  /// The pixels of keyframes that are kept in the scene for the colours of voxels.
  [[nodiscard]] std::size_t color_samples() const { return sample_count_; }

 private:
  using clock = std::chrono::steady_clock;

  /// What of a keyframe gives voxels their colours: pixels on a grid, with depth.
  struct sample {
    std::uint16_t x, y;  // pixels
    float depth;         // metres
    orbis::rgb8 color;
  };
  struct colored_keyframe {
    std::size_t asked = 0;  // index of its pose
    std::vector<sample> samples;
    std::optional<orbis::se3> placed;  // where its colours were added
  };
  struct passed_point {
    orbis::slam::map_keyframe reference;
    orbis::vec3f at;  // in the reference's frame, in lengths over its scale
    bool begins;
  };
  struct trail_item {
    std::size_t asked;
    orbis::vec3f at;
    bool begins;
  };
  /// What was handed over and is not yet in the scene.
  struct mailbox {
    std::optional<handed_frame> newest;
    std::vector<passed_point> passed;
    std::vector<std::pair<orbis::slam::map_keyframe, std::vector<sample>>> keyframes;
    std::size_t samples = 0;  // of the keyframes
    std::vector<double> tracking_ms;
  };
  /// When something is asked next: it may take a tenth of the time.
  struct pace {
    std::chrono::milliseconds least;
    clock::time_point next{};
    [[nodiscard]] bool is_due(clock::time_point now) const { return now >= next; }
    void ran(clock::time_point from, clock::time_point to) {
      next = to + std::max<clock::duration>(least, 9 * (to - from));
    }
  };

  [[nodiscard]] std::vector<sample> samples_of(const handed_frame& frame) const;
  [[nodiscard]] std::size_t index_of(orbis::slam::map_keyframe k);
  const viewer_scene& update(const scene_sources& sources, bool at_once);
  void take_mail();
  template <class Use>
  void for_each_point(const std::vector<sample>& samples, const orbis::se3& T_world_camera, const Use& use) const;
  /// Gives up pixels of keyframes until there are no more than are allowed.
  void make_room();
  void forget_colors();
  void update_graph(const scene_sources& sources, bool at_once);
  void draw_trail();
  /// Moves the colours of keyframes that have moved; of so many, before it returns. False: some are left.
  bool move_colors(std::size_t limit);
  void update_voxels(const scene_sources& sources, bool at_once);
  void show_cubes();
  void update_numbers(const scene_sources& sources);

  const orbis::camera::ray_table rays_;
  const double resolution_;
  const int step_;  // pixels from one sample to the next
  const std::size_t max_samples_;

  std::atomic<mailbox*> box_{nullptr};  // owned
  std::atomic<bool> takes_colors_{true};
  std::optional<orbis::slam::map_keyframe> last_reference_;  // of the thread that hands over, as the next two
  orbis::vec3f last_at_ = orbis::vec3f::Zero();
  bool was_lost_ = true;

  viewer_scene scene_;
  slam_graph graph_;
  std::unordered_map<std::uint64_t, std::size_t> asked_;  // index in graph_.asked, by keyframe
  std::vector<trail_item> trail_;
  std::vector<colored_keyframe> colored_;
  std::size_t sample_count_ = 0;  // of all in colored_
  voxel_colors colors_;
  std::vector<voxel> cubes_;
  std::vector<double> tracking_ms_;  // of the last frames, in a ring
  std::size_t frames_seen_ = 0;
  bool graph_asked_more_ = false, colors_changed_ = false, colors_wait_ = false, has_final_voxels_ = false;
  pace graph_pace_{std::chrono::milliseconds{150}}, voxel_pace_{std::chrono::milliseconds{250}},
      number_pace_{std::chrono::milliseconds{200}};
};

/// The rays through the corners of the images. @pre the table is not empty
[[nodiscard]] frustum_rays corner_rays(const orbis::camera::ray_table& rays);

}  // namespace app

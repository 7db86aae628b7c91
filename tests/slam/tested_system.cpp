// SPDX-License-Identifier: BSD-3-Clause
#include "slam/tested_system.hpp"

#include <optional>
#include <utility>

#include <orbis/core/file.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/map_file.hpp>
#include <orbis/slam/system.hpp>

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

namespace orbis::test {

struct slam_system::held {
  held(const camera::any_camera& camera, const slam::options& settings) : system{camera, settings} {}
  slam::rgbd_system<camera::any_camera> system;
};

slam_system::slam_system(const camera::any_camera& camera, const slam::options& settings)
    : held_{std::make_unique<held>(camera, settings)} {}
slam_system::~slam_system() = default;

void slam_system::listen(slam::listeners all) { held_->system.listen(std::move(all)); }
slam::track_result slam_system::track(const camera::rgbd_frame& f) { return held_->system.track(f); }
void slam_system::wait() const { held_->system.wait(); }
std::optional<slam::shutter_estimate> slam_system::estimated_shutter() const {
  return held_->system.estimated_shutter();
}
slam::track_state slam_system::state() const { return held_->system.state(); }
void slam_system::set_initial_pose(std::function<se3()> find) { held_->system.set_initial_pose(std::move(find)); }
void slam_system::set_localization_only(bool on) { held_->system.set_localization_only(on); }
void slam_system::set_initial_pose(const se3& T_world_camera) { held_->system.set_initial_pose(T_world_camera); }
orbis::trajectory slam_system::trajectory() const { return held_->system.trajectory(); }
orbis::trajectory slam_system::trajectory(slam::map_id map) const { return held_->system.trajectory(map); }
std::vector<slam::keyframe_pose> slam_system::keyframes() const { return held_->system.keyframes(); }
std::optional<std::vector<slam::keyframe_pose>> slam_system::keyframes_since(slam::pose_revision& seen) const {
  return held_->system.keyframes_since(seen);
}
std::optional<slam::tracked_frame> slam_system::last_frame() const { return held_->system.last_frame(); }
orbis::trajectory slam_system::keyframe_trajectory() const { return held_->system.keyframe_trajectory(); }
std::size_t slam_system::landmark_count() const { return held_->system.landmark_count(); }
slam::track_counters slam_system::counters() const { return held_->system.counters(); }
slam::map_id slam_system::active_map() const { return held_->system.active_map(); }
slam::map_id slam_system::largest_map() const { return held_->system.largest_map(); }
const slam::map& slam_system::map() const { return held_->system.map(); }
void slam_system::look(const std::function<void(const slam::atlas&)>& read) const { held_->system.inspect(read); }

}  // namespace orbis::test

TEST_CASE("A system with a limited trajectory forgets erased keyframes, but not of a map that is kept unchanged") {
  using namespace orbis;
  const test::temporary_folder folder;
  const io::synthetic_recording recorded{{.frames = 1, .width = 320, .height = 240}};
  slam::options settings;
  slam::map m(settings.features.levels, settings.features.scale_factor);
  m.add_keyframe({});
  for (int i = 0; i != 3000; ++i) m.erase_keyframe(m.add_keyframe({}));
  const auto file = folder.path() / "made.map", saved = folder.path() / "saved.map";
  REQUIRE(slam::write_map(file, m));
  for (const bool is_kept : {true, false}) {
    settings.trajectory_frames = 10;
    settings.localization_only = is_kept;
    slam::rgbd_system<camera::any_camera> slam{recorded.camera().model, settings};
    REQUIRE(slam.load_map(file));
    slam.track(recorded.frame(0).value());
    REQUIRE(slam.save_map(saved));
    const auto bytes = read_file(saved);
    REQUIRE(bytes);
    CHECK((*bytes == read_file(file).value()) == is_kept);
    CHECK(slam::read_map(saved).value().content().forgotten == (is_kept ? 0U : 3000U - 1024U));
  }
}

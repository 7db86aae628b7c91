// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/viewer.hpp"

#include <chrono>
#include <string>
#include <thread>

#include "interrupts.hpp"
#include "viewer/backend.hpp"

namespace app {
namespace {

std::string why_no_live_map(const settings& s) {
  if (s.localize_only) return "no voxels: --localize-only does not build an octree";
  return s.live_map ? "" : "no voxels yet: with --batch-map the octree is built at the end";
}

}  // namespace

orbis::result<viewer> viewer::open(const settings& s, const frame_source& source, console& console) {
  if (s.viewer.empty()) return viewer{nullptr};
  viewer made{std::make_unique<viewer_thread>(
      source.title, source.frames, orbis::camera::ray_table{source.camera.model}, s.resolution, why_no_live_map(s))};
  const auto where = made.thread_->start([&s] { return s.viewer == "web" ? open_web(s.viewer_port) : open_window(); });
  if (!where) return orbis::fail(where.error());
  made.report_error(console);
  if (!made.thread_->is_open()) return viewer{nullptr};  // ends threads that are no longer needed
  if (!where->empty()) {
    console.stage("viewer");
    console.finish(*where);
  }
  return made;
}

void viewer::set_camera(const frame_source& source) {
  if (thread_) thread_->set_camera(orbis::camera::ray_table{source.camera.model});
}

viewer::connection::connection(viewer& v, scene_sources sources) : viewer_{v} {
  if (v.thread_) v.thread_->connect(std::move(sources));
}

viewer::connection::~connection() {
  if (viewer_.thread_) viewer_.thread_->disconnect();
}

bool viewer::give_way(console& console) {
  if (!thread_ || !thread_->is_open()) return false;
  thread_.reset();
  console.warn("the system provides too few threads for the run and the viewer; the run continues without the viewer");
  return true;
}

void viewer::show_map(const std::vector<voxel>& voxels) {
  if (thread_) thread_->show_map(voxels);
}

void viewer::report_error(console& console) {
  if (!thread_ || thread_->is_open()) return;
  if (const std::string why = thread_->take_error(); !why.empty())
    console.warn("the viewer failed; the run continues without it: " + why);
}

void viewer::finish(const settings& s, console& console) {
  if (!thread_) return;
  if (s.viewer_hold && thread_->is_open() && !interrupts::stop_requested()) {
    interrupts::keep_results({});  // all files are written: Ctrl-C only closes the viewer
    console.stage("viewer");
    console.finish(s.viewer == "web" ? "open until Ctrl-C" : "open until it is closed or Ctrl-C is pressed");
    while (thread_->is_open() && !interrupts::stop_requested())
      std::this_thread::sleep_for(std::chrono::milliseconds{50});
  }
  report_error(console);
}

}  // namespace app

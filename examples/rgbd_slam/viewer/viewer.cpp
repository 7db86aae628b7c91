// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/viewer.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include <sys/resource.h>

#include "interrupts.hpp"
#include "viewer/backend.hpp"

namespace app {
namespace {

constexpr int low_priority = 10;  // of "nice": who tracks and maps goes first where processors are few

orbis::result<std::unique_ptr<viewer_backend>> open_backend(const settings& s) {
  return s.viewer == "web" ? open_web(s.viewer_port) : open_window();
}

}  // namespace

struct viewer::state {
  state(const settings& s, const frame_source& source)
      : builder{source.title, source.frames, orbis::camera::ray_table{source.camera.model}, s.resolution} {
    if (s.localize_only)
      builder.set_no_voxels("no voxels: with --localize-only there is no map of them");
    else if (!s.live_map)
      builder.set_no_voxels("no voxels yet: with --batch-map they are made when all frames are tracked");
  }
  ~state() {
    {
      const std::lock_guard lock{mutex};
      ends = true;
    }
    changed.notify_all();
    if (thread.joinable()) thread.join();
  }
  state(const state&) = delete;
  state& operator=(const state&) = delete;

  /// Opens the back end on the viewer's thread, which then draws.
  orbis::result<std::string> start(const settings& s) {
    std::promise<orbis::result<std::string>> opened;
    auto outcome = opened.get_future();
    thread = std::thread{[this, &s, opened = std::move(opened)]() mutable {
      ::setpriority(PRIO_PROCESS, 0, low_priority);  // on Linux, of this thread and those that it starts
      auto backend = open_backend(s);
      if (!backend) return opened.set_value(orbis::fail(backend.error()));
      is_open = true;
      opened.set_value((*backend)->where());
      try {
        draw_until_the_end(**backend);
      } catch (const std::exception& e) {
        const std::lock_guard lock{mutex};
        trouble = e.what();
      }
      is_open = false;
      changed.notify_all();
    }};
    return outcome.get();
  }

  void draw_until_the_end(viewer_backend& backend) {
    using clock = std::chrono::steady_clock;
    std::unique_lock lock{mutex};
    while (!ends) {
      const auto start = clock::now();
      if (!backend.draw(builder.update(sources))) return;
      // At most a third of the time: a graphics card may be the processor in disguise.
      const auto took = clock::now() - start;
      const auto wait = std::max<clock::duration>(backend.interval() - took, 2 * took);
      changed.wait_for(lock, wait, [&] { return ends; });
    }
  }

  scene_builder builder;
  std::thread thread;
  std::atomic<bool> is_open{false};
  std::mutex mutex;  // of what follows, and of the builder but for `hand_over`
  std::condition_variable changed;
  scene_sources sources;
  bool ends = false;
  std::string trouble;
};

viewer::viewer(std::unique_ptr<state> s) : state_{std::move(s)} {}
viewer::viewer(viewer&&) noexcept = default;
viewer::~viewer() = default;

orbis::result<viewer> viewer::open(const settings& s, const frame_source& source, console& console) {
  if (s.viewer.empty()) return viewer{nullptr};
  auto made = std::make_unique<state>(s, source);
  const auto where = made->start(s);
  if (!where) return orbis::fail(where.error());
  if (!where->empty()) {
    console.stage("viewer");
    console.finish(*where);
  }
  return viewer{std::move(made)};
}

bool viewer::is_open() const { return state_ && state_->is_open; }

void viewer::show(handed_frame frame) {
  if (is_open()) state_->builder.hand_over(std::move(frame));
}

viewer::connection::connection(viewer& v, scene_sources sources) : viewer_{v} {
  if (!v.state_) return;
  const std::lock_guard lock{v.state_->mutex};
  v.state_->sources = std::move(sources);
}

viewer::connection::~connection() {
  if (!viewer_.state_) return;
  state& s = *viewer_.state_;
  const std::lock_guard lock{s.mutex};
  try {
    s.builder.set_over();
    static_cast<void>(s.builder.update_at_once(s.sources));
  } catch (const std::exception& e) {  // no memory: what was shown stays
    s.trouble = e.what();
  }
  s.sources = {};
}

void viewer::show_map(const std::vector<voxel>& voxels) {
  if (!is_open()) return;
  const std::lock_guard lock{state_->mutex};
  state_->builder.set_voxels(voxels);
}

void viewer::finish(const settings& s, console& console) {
  if (!state_) return;
  if (s.viewer_hold && is_open() && !interrupts::requested()) {
    interrupts::keep_results({});  // all is written: Ctrl-C only closes the viewer
    console.stage("viewer");
    while (is_open() && !interrupts::requested()) std::this_thread::sleep_for(std::chrono::milliseconds{50});
    console.finish("closed");
  }
  const std::lock_guard lock{state_->mutex};
  if (!state_->trouble.empty()) console.warn("the viewer ended early: " + state_->trouble);
}

}  // namespace app

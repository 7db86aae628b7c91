// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/viewer_thread.hpp"

#include <algorithm>
#include <chrono>
#include <system_error>

#include "priority.hpp"

namespace app {

viewer_thread::viewer_thread(std::string title, std::size_t frames, orbis::camera::ray_table rays, double resolution,
                             std::string no_voxels)
    : builder_{std::move(title), frames, std::move(rays), resolution} {
  if (!no_voxels.empty()) builder_.set_no_voxels(std::move(no_voxels));
}

viewer_thread::~viewer_thread() {
  {
    const std::lock_guard lock{mutex_};
    ends_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

orbis::result<std::string> viewer_thread::start(open_backend open) {
  try {
    aside_ = std::make_unique<background_thread>();
    const auto begun = aside_->start([] {});  // a thread has the priority of its creator
    if (!begun.valid()) throw std::system_error{std::make_error_code(std::errc::resource_unavailable_try_again)};
    begun.wait();
    std::promise<orbis::result<std::string>> opened;
    auto outcome = opened.get_future();
    thread_ = std::thread{[this, open = std::move(open), opened = std::move(opened)]() mutable { run(open, opened); }};
    return outcome.get();
  } catch (...) {
    close(std::current_exception());
    return std::string{};
  }
}

void viewer_thread::run(const open_backend& open, std::promise<orbis::result<std::string>>& opened) {
  lower_priority(viewer_niceness);  // the threads that the back end starts inherit it
  bool has_opened = false;
  try {
    auto backend = open();
    if (!backend) return opened.set_value(orbis::fail(backend.error()));
    std::string where = (*backend)->where();
    is_open_ = has_opened = true;
    opened.set_value(std::move(where));
    draw_until_closed(**backend);
  } catch (...) {
    close(std::current_exception());
    if (!has_opened) opened.set_exception(std::current_exception());
  }
  is_open_ = false;
  const std::lock_guard lock{mutex_};
  builder_.forget();
}

void viewer_thread::draw_until_closed(viewer_backend& backend) {
  using clock = std::chrono::steady_clock;
  std::unique_lock lock{mutex_};
  while (!ends_) {
    const auto start = clock::now();
    if (!backend.draw(builder_.update(sources_))) return;
    // Draws for at most a third of the time, because rendering may run on the CPU.
    const auto took = clock::now() - start;
    const auto wait = std::max<clock::duration>(backend.interval() - took, 2 * took);
    changed_.wait_for(lock, wait, [&] { return ends_.load(); });
  }
}

void viewer_thread::close(std::exception_ptr why) noexcept {
  {
    const std::lock_guard lock{error_mutex_};
    if (!error_) error_ = std::move(why);
  }
  is_open_ = false;
  ends_ = true;
}

std::string viewer_thread::take_error() {
  const std::lock_guard lock{error_mutex_};
  if (!error_ || std::exchange(is_reported_, true)) return {};
  try {
    std::rethrow_exception(error_);
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "unknown exception";
  }
}

void viewer_thread::set_camera(orbis::camera::ray_table rays) {
  const std::lock_guard lock{mutex_};
  builder_.set_camera(std::move(rays));
}

void viewer_thread::connect(scene_sources sources) {
  if (!is_open()) return;
  if (sources.graph)
    sources.graph = [this, ask = std::move(sources.graph)](slam_graph& graph, bool always) {
      bool is_new = false;
      aside_->start([&] { is_new = ask(graph, always); }).get();
      return is_new;
    };
  if (sources.numbers)
    sources.numbers = [this, ask = std::move(sources.numbers)] {
      live_results results;
      aside_->start([&] { results = ask(); }).get();
      return results;
    };
  const std::lock_guard lock{mutex_};
  builder_.begin();
  sources_ = std::move(sources);
}

void viewer_thread::disconnect() {
  const std::lock_guard lock{mutex_};
  try {
    if (is_open()) builder_.finish(sources_);
  } catch (...) {
    close(std::current_exception());
  }
  sources_ = {};
}

void viewer_thread::show_map(const std::vector<voxel>& voxels) {
  if (!is_open()) return;
  const std::lock_guard lock{mutex_};
  try {
    builder_.set_voxels(voxels);
  } catch (...) {
    close(std::current_exception());
  }
}

}  // namespace app

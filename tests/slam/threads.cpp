// SPDX-License-Identifier: BSD-3-Clause
//
// Mapping, loop closing and global adjustment beside tracking: whatever the timing, much the same map.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include <orbis/eval/ate.hpp>
#include <orbis/slam/detail/system/back_end.hpp>

#include "slam/tested_system.hpp"
#include "support/catch.hpp"
#include "support/synthetic/sequence.hpp"
#include "support/validate.hpp"

using namespace orbis;
namespace syn = test;
using std::chrono::milliseconds;

namespace {

struct round_walk {
  camera::any_camera camera;
  std::vector<camera::rgbd_frame> frames;
  trajectory truth;
};

/// Once round a room, with a loop at the end; rendered once.
const round_walk& room() {
  static const round_walk r = [] {
    syn::room_options o;
    o.sequence = {.width = 320, .height = 240, .fps = 10};
    const auto recording = syn::room_round(o);
    round_walk made{recording.camera().model, {}, syn::ground_truth_of(recording)};
    for (std::size_t i = 0; i != recording.size(); ++i) made.frames.push_back(recording.frame(i).value());
    return made;
  }();
  return r;
}

slam::options threaded(bool wait) {
  slam::options o;
  o.initial_pose = room().frames.front().T_world_camera;
  o.threads.enabled = true;
  o.threads.wait = wait;
  return o;
}

}  // namespace

TEST_CASE("With threads every run gives much the same trajectory, as good as that without them") {
  const round_walk& r = room();
  std::vector<trajectory> runs;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    std::mt19937 random(seed);
    test::slam_system slam{r.camera, threaded(true)};
    for (const auto& f : r.frames) {
      CHECK(slam.track(f).tracked());
      if (random() % 4 == 0) std::this_thread::sleep_for(milliseconds(random() % 20));
    }
    slam.wait();
    CHECK(slam.counters().loops_closed >= 1);
    const auto valid = test::validate(slam.map());
    CHECK((valid ? "" : valid.error().to_string()) == "");
    runs.push_back(slam.trajectory());
    REQUIRE(runs.back().size() == r.frames.size());
    const auto ate = eval::ate(runs.back(), r.truth);
    REQUIRE(ate);
    CHECK(ate->translation.rmse < 0.01);
  }
  // Twenty runs lay within 3 mm and 1.4 mrad of each other.
  for (std::size_t i = 0; i != r.frames.size(); ++i)
    for (std::size_t run = 1; run != runs.size(); ++run) {
      const auto apart = runs[0][i].T_world_camera.inverse() * runs[run][i].T_world_camera;
      CHECK(apart.translation().norm() < 0.01);
      CHECK(apart.rotation().angle() < 0.01);
    }
}

TEST_CASE("While threads work the system can be asked and told from others, and may end at any time") {
  const round_walk& r = room();
  for (const std::size_t frames : {1U, 3U, 8U, 16U, 24U}) {
    auto slam = std::make_unique<test::slam_system>(r.camera, threaded(frames % 2 == 0));
    std::atomic<std::size_t> told{0};
    slam->listen({.keyframe_made = [&](const slam::keyframe_event&) { told += slam->keyframes().size(); }});
    std::atomic<bool> ends{false};
    std::thread other([&] {
      for (bool only = false; !ends;) {
        const std::size_t poses = slam->trajectory().size();
        const auto c = slam->counters();  // asked later
        const bool agrees = poses <= c.tracked && slam->active_map() == slam->largest_map();
        if (!agrees) told = 1'000'000;
        slam->set_localization_only(only = !only);
        std::this_thread::sleep_for(milliseconds(1));
      }
    });
    for (std::size_t i = 0; i != frames; ++i) slam->track(r.frames[i]);
    ends = true;
    other.join();
    CHECK(told < 1'000'000);
    CHECK(slam->counters().frames == frames);
    slam.reset();  // mapping is at work, or has not begun
  }
}

TEST_CASE("Room for no keyframe is room for one: nothing waits for ever") {
  const round_walk& r = room();
  slam::options o = threaded(true);
  o.threads.max_waiting = 0;
  test::slam_system slam{r.camera, o};
  for (std::size_t i = 0; i != 6; ++i) CHECK(slam.track(r.frames[i]).tracked());
  slam.wait();
  CHECK(slam.keyframes().size() >= 1);
}

TEST_CASE("A worker does its jobs in order, lets the one at hand end when stopped, and drops the others") {
  std::vector<int> done;
  std::atomic<bool> begun{false}, may_end{false};
  std::unique_ptr<slam::detail::worker<int>> worker;
  std::size_t waiting = 0;
  worker = std::make_unique<slam::detail::worker<int>>([&](int job) {
    begun = true;
    while (!may_end) std::this_thread::yield();
    waiting = worker->waiting();  // it is there as long as a job is at hand
    done.push_back(job);
  });
  for (const int job : {1, 2, 3}) worker->push(job);
  while (!begun) std::this_thread::yield();
  std::thread release([&] {
    std::this_thread::sleep_for(milliseconds(5));
    may_end = true;
  });
  worker->stop();
  release.join();
  CHECK(done == std::vector{1});
  CHECK(waiting == 2);
  worker->stop();  // again: nothing
  worker->push(4);
  worker->wait();
  CHECK(worker->idle());
  CHECK(done == std::vector{1});
  worker.reset();

  may_end = true;
  worker = std::make_unique<slam::detail::worker<int>>([&](int job) { done.push_back(job); });
  for (const int job : {2, 3, 4}) worker->push(job);
  worker->wait();
  CHECK(worker->idle());
  CHECK(done == std::vector{1, 2, 3, 4});
}

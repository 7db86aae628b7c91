// SPDX-License-Identifier: BSD-3-Clause
//
// Cameras whose frames come as they are taken: by a device made for this test, by recordings that play, and with
// OpenNI2 by the device without hardware that the library has for tests.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "inputs/camera_device.hpp"
#include "inputs/frame_pairs.hpp"
#include "inputs/live_source.hpp"
#include "io/recordings.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using test::message_of;
using test::temporary_folder;

namespace {

/// Gives frames when the test says so.
struct switchboard {
  std::mutex mutex;
  std::condition_variable changed;
  int wanted = 0, given = 0;
  bool is_cut = false;

  void give(int frames) {
    std::unique_lock lock{mutex};
    wanted += frames;
    changed.notify_all();
    changed.wait(lock, [&] { return given == wanted; });
  }
  void cut() {
    const std::lock_guard lock{mutex};
    is_cut = true;
    changed.notify_all();
  }
};

class fake_camera final : public app::camera_device {
 public:
  explicit fake_camera(switchboard& by) : by_{by} { name = "fake camera"; }
  result<std::optional<app::source_frame>> next(std::chrono::milliseconds patience) override {
    std::unique_lock lock{by_.mutex};
    if (pending_) {  // the one before is where it belongs
      pending_ = false;
      ++by_.given;
      by_.changed.notify_all();
    }
    if (!by_.changed.wait_for(lock, patience, [&] { return by_.given != by_.wanted || by_.is_cut; }))
      return std::optional<app::source_frame>{};
    if (by_.given == by_.wanted) return fail(errc::unreadable, name, "was disconnected");
    app::source_frame f;
    f.timestamp = by_.given;
    pending_ = true;
    return std::optional{std::move(f)};
  }

 private:
  switchboard& by_;
  bool pending_ = false;
};

const auto never = [] { return false; };

}  // namespace

TEST_CASE("of frames that came in the meantime the newest is given and the others are counted") {
  switchboard by;
  app::live_source live{std::make_unique<fake_camera>(by)};
  by.give(1);
  CHECK(live.next(never).value().timestamp == 0.0);
  by.give(3);
  CHECK(live.next(never).value().timestamp == 3.0);
  CHECK(live.dropped() == 2);
  by.give(1);
  CHECK(live.next(never).value().timestamp == 4.0);
  CHECK(live.dropped() == 2);
}

TEST_CASE("a frame is waited for") {
  switchboard by;
  app::live_source live{std::make_unique<fake_camera>(by)};
  std::thread later{[&] {
    std::this_thread::sleep_for(30ms);
    by.give(1);
  }};
  CHECK(live.next(never).value().timestamp == 0.0);
  later.join();
  CHECK(live.dropped() == 0);
}

TEST_CASE("a camera that is disconnected gives its last frame and then says so") {
  switchboard by;
  app::live_source live{std::make_unique<fake_camera>(by)};
  by.give(2);
  by.cut();
  CHECK(live.next(never).value().timestamp == 1.0);
  for (int i = 0; i != 2; ++i) CHECK_THAT(message_of(live.next(never)), Contains("fake camera: was disconnected"));
  CHECK(live.dropped() == 1);
}

TEST_CASE("what a camera's library throws is how the camera ends") {
  class thrower final : public app::camera_device {
   public:
    thrower() { name = "thrower"; }
    result<std::optional<app::source_frame>> next(std::chrono::milliseconds) override {
      throw std::runtime_error{"the wire is cut"};
    }
  };
  app::live_source live{std::make_unique<thrower>()};
  CHECK_THAT(message_of(live.next(never)), Contains("thrower: the wire is cut"));
}

TEST_CASE("nobody waits for a camera when the run is over") {
  switchboard by;
  app::live_source live{std::make_unique<fake_camera>(by)};
  const auto got = live.next([] { return true; });
  REQUIRE(!got);
  CHECK(got.error().code == errc::cancelled);
}

TEST_CASE("a recording plays at its pace and ends") {
  const temporary_folder folder;
  folder.write("camera.toml", test::tiny_camera);
  for (const char* const name : {"a", "b", "c"}) {
    folder.write(std::string{"rgb/"} + name + ".png", test::tiny_color(name[0] == 'a' ? 1 : 2));
    folder.write(std::string{"depth/"} + name + ".png", test::tiny_depth(1000));
  }
  folder.write("rgb.txt", "5.0 rgb/a.png\n5.1 rgb/b.png\n5.2 rgb/c.png\n");
  folder.write("depth.txt", "5.0 depth/a.png\n5.1 depth/b.png\n5.2 depth/c.png\n");
  folder.write("groundtruth.txt", "5 0 0 0 0 0 0 1\n6 0 0 0 0 0 0 1\n");
  const auto device = app::open_playback({.name = folder.path().string()}).value();
  const auto begin = std::chrono::steady_clock::now();
  int frames = 0, waits = 0;
  for (;;) {
    auto got = device->next(20ms);
    if (!got) {
      CHECK(got.error().code == errc::no_data);
      break;
    }
    if (!*got) {
      ++waits;
      continue;
    }
    CHECK((*got)->timestamp == Approx(5.0 + 0.1 * frames));
    CHECK((*got)->depth(0, 0) == 1000);
    CHECK(!(*got)->T_world_camera);
    ++frames;
  }
  CHECK(frames == 3);
  CHECK(waits > 0);
  CHECK(std::chrono::steady_clock::now() - begin >= 200ms);
}

TEST_CASE("a time stamp that is farther away than a clock can count is waited for") {
  const temporary_folder folder;
  folder.write("camera.toml", test::tiny_camera);
  folder.write("a.png", test::tiny_color(1));
  folder.write("d.png", test::tiny_depth(1));
  folder.write("rgb.txt", "5.0 a.png\n1e300 a.png\n");
  folder.write("depth.txt", "5.0 d.png\n1e300 d.png\n");
  const auto device = app::open_playback({.name = folder.path().string()}).value();
  CHECK(device->next(20ms).value());
  CHECK(!device->next(20ms).value());
}

TEST_CASE("a camera that is not there or not known to this build is refused in words") {
  const auto depth = message_of(app::open_openni({.name = "/no/such/device"}));
  CHECK_THAT(depth, Contains(app::has_openni() ? "no depth camera is connected" : "libopenni2-dev"));
  const camera::camera_settings settings{.model = camera::pinhole{8, 6, 7.0, 7.0, 3.5, 2.5}};
  const auto video = message_of(app::open_video_camera({.name = "/dev/none", .camera = settings}));
  CHECK_THAT(video,
             Contains(app::has_video_cameras() ? "cannot be opened as a video camera" : "libopencv-videoio-dev"));
  if (app::has_video_cameras()) CHECK_THAT(message_of(app::open_video_camera({.name = "0"})), Contains("--camera"));
}

TEST_CASE("colour and depth of one time are paired, whichever stream is ahead, and whatever is lost") {
  struct taken {
    app::stream of;
    int number;
  };
  using app::stream;
  const auto pairs_of = [](double fps, const std::vector<taken>& order) {
    app::frame_pairs<int> pairs{1.0 / fps};
    std::vector<std::pair<int, int>> found;
    for (const taken& t : order)
      if (const auto both = pairs.add(t.of, t.number, t.number / fps + (t.of == stream::depth ? 0.003 : 0.0)))
        found.emplace_back(both->color, both->depth);
    return found;
  };
  for (const double fps : {15.0, 30.0, 60.0})
    for (const int ahead : {-9, -2, 0, 2, 9}) {  // of depth
      CAPTURE(fps, ahead);
      std::vector<taken> order;
      std::vector<std::pair<int, int>> expected;
      for (int i = 0; i != 60; ++i) {
        const int depth = i + ahead;
        if (depth >= 0 && depth < 60 && depth != 20) order.push_back({stream::depth, depth});
        if (i != 30) order.push_back({stream::color, i});
      }
      for (int depth = 60 + ahead; depth < 60; ++depth) order.push_back({stream::depth, depth});
      for (int i = 0; i != 60; ++i)
        if (i != 20 && i != 30 && i >= ahead) expected.emplace_back(i, i);
      CHECK(pairs_of(fps, order) == expected);
    }
  // What waits for more than sixteen frames is given up.
  std::vector<taken> late;
  for (int i = 0; i != 20; ++i) late.push_back({stream::color, i});
  for (int i = 0; i != 20; ++i) late.push_back({stream::depth, i});
  const auto found = pairs_of(30.0, late);
  REQUIRE(found.size() == 16);
  CHECK(found.front() == std::pair{4, 4});
}

#ifdef RGBD_SLAM_OPENNI
TEST_CASE("frames come from the device without hardware that OpenNI2 has for tests") {
  auto opened = app::open_openni({.name = "Dummy"});
  if (!opened) {
    WARN("OpenNI2 has no such device here: " + opened.error().to_string());
    return;
  }
  app::live_source live{*std::move(opened)};
  CHECK(live.device().sensor == slam::sensor_kind::rgbd);
  CHECK(live.device().camera.model.width() == 320);
  CHECK(!live.device().notes.empty());  // not calibrated
  double last = -1.0;
  for (int i = 0; i != 5; ++i) {
    const auto given = live.next(never);
    INFO(message_of(given));
    REQUIRE(given);
    const auto& frame = *given;
    CHECK(frame.timestamp > last);
    last = frame.timestamp;
    CHECK(frame.color.width() == 320);
    CHECK(frame.depth.height() == 240);
    CHECK(frame.depth_scale == 1000.0);
  }
}
#endif

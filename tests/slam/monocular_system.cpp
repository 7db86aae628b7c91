// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

#include <orbis/eval/ate.hpp>
#include <orbis/io/mono_recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/slam/system.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/temporary_folder.hpp"
#include "support/validate.hpp"

using namespace orbis;

namespace {

/// The diagonal of the box around the poses.
double extent_of(const trajectory& poses) {
  vec3 low = poses.front().T_world_camera.translation(), high = low;
  for (const auto& p : poses) {
    low = low.cwiseMin(p.T_world_camera.translation());
    high = high.cwiseMax(p.T_world_camera.translation());
  }
  return (high - low).norm();
}

double length(const trajectory& poses) {
  double sum = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i)
    sum += (poses[i].T_world_camera.translation() - poses[i - 1].T_world_camera.translation()).norm();
  return sum;
}

struct tracked {
  std::optional<std::size_t> first;  ///< frame with a pose
  std::size_t lost = 0;              ///< frames without, after it
};

template <class System>
tracked track_all(System& slam, const io::synthetic_recording& room) {
  tracked sum;
  for (std::size_t i = 0; i != room.size(); ++i) {
    const auto frame = room.frame(i).value();
    const auto found = slam.track(frame.timestamp, frame.color.view());
    if (found.tracked() && !sum.first) sum.first = i;
    sum.lost += sum.first && !found.tracked();
  }
  return sum;
}

template <class System>
std::string fault_of(const System& slam) {
  const auto valid = test::validate(slam.map());
  return valid ? "" : valid.error().to_string();
}

}  // namespace

TEST_CASE("One camera's round of a room has the shape of the truth, in a unit of its own, and closes the loop") {
  for (const std::uint64_t seed : {1U, 4U}) {
    const io::synthetic_recording room{{.frames = 200, .fps = 20, .seed = seed, .width = 640, .height = 480}};
    slam::system<camera::any_camera> slam{room.camera().model, slam::monocular_options()};
    const tracked sum = track_all(slam, room);
    REQUIRE(sum.first.has_value());
    CHECK(*sum.first < 30);
    CHECK(sum.lost == 0);
    CHECK(slam.map().sensor() == slam::sensor_kind::monocular);
    CHECK(slam.counters().loops_closed >= 1);
    CHECK(fault_of(slam) == "");
    const trajectory found = slam.trajectory();
    CHECK(found.size() == room.size() - *sum.first + 1);  // and the frame that the map began with
    const auto error = eval::ate(found, room.ground_truth(), {.with_scale = true});
    REQUIRE(error);
    CHECK(error->translation.rmse < 0.01 * extent_of(room.ground_truth()));
    CHECK(error->aligned.scale > 1.3);  // the walls are further than a metre
  }
}

TEST_CASE("One camera's round of a room is as good with threads, and goes on after its loop") {
  const io::synthetic_recording room{
      {.frames = 230, .fps = 20, .seed = 4, .width = 640, .height = 480, .frames_around = 200}};
  auto options = slam::monocular_options();
  options.threads.enabled = options.threads.wait = true;
  slam::system<camera::any_camera> slam{room.camera().model, options};
  const tracked sum = track_all(slam, room);
  slam.wait();
  REQUIRE(sum.first.has_value());
  CHECK(*sum.first < 30);
  CHECK(sum.lost == 0);
  CHECK(slam.counters().loops_closed >= 1);
  CHECK(slam.counters().tracked == room.size() - *sum.first + 1);
  CHECK(fault_of(slam) == "");
  const trajectory found = slam.trajectory();
  CHECK(found.size() == slam.counters().tracked);
  const auto error = eval::ate(found, room.ground_truth(), {.with_scale = true});
  REQUIRE(error);
  CHECK(error->translation.rmse < 0.01 * extent_of(room.ground_truth()));
}

TEST_CASE("A camera that only turns begins no map") {
  const io::synthetic_recording room{{.frames = 40,
                                      .seed = 4,
                                      .width = 640,
                                      .height = 480,
                                      .frames_around = 200,
                                      .path = {.semi_axis_x = 0.0, .semi_axis_y = 0.0, .wobble = 0.0, .jitter = 0.0}}};
  slam::system<camera::any_camera> slam{room.camera().model, slam::monocular_options()};
  const tracked sum = track_all(slam, room);
  CHECK(!sum.first.has_value());
  CHECK(slam.state() == slam::track_state::not_started);
  CHECK(slam.keyframes().empty());
}

TEST_CASE("A map that is lost young is begun anew at once") {
  const io::synthetic_recording room{{.frames = 160, .fps = 20, .seed = 1, .width = 640, .height = 480}};
  const image<rgb8> black(640, 480);
  auto options = slam::monocular_options();
  options.recovery.min_map_keyframes = 1000;  // every map is young
  options.recovery.new_map_after = 1000.0;
  slam::system<camera::any_camera> slam{room.camera().model, options};
  std::size_t i = 0;
  const auto track_until = [&](auto&& done) {
    for (; i != room.size(); ++i) {
      const auto frame = room.frame(i).value();
      if (done(slam.track(frame.timestamp, frame.color.view()))) return ++i, true;
    }
    return false;
  };
  REQUIRE(track_until([](const auto& found) { return found.tracked(); }));
  const slam::map_id first = slam.active_map();
  CHECK(slam.track(room.frame(i).value().timestamp, black.view()).state == slam::track_state::lost);
  i += 40;  // the room beyond what the first map knows
  REQUIRE(track_until([](const auto& found) { return found.tracked(); }));
  CHECK(slam.active_map() != first);
  CHECK(slam.inspect([&](const slam::atlas& maps) { return maps.size(); }) == 1);  // the young one is gone
  CHECK(fault_of(slam) == "");
}

TEST_CASE("A camera that comes back to a map is found in it") {
  const io::synthetic_recording room{{.frames = 100, .fps = 20, .seed = 1, .width = 640, .height = 480}};
  const image<rgb8> black(640, 480);
  slam::system<camera::any_camera> slam{room.camera().model, slam::monocular_options()};
  track_all(slam, room);
  const slam::map_id first = slam.active_map();
  double time = room.ground_truth().back().timestamp;
  for (int i = 0; i != 10; ++i) CHECK(slam.track(time += 0.05, black.view()).state == slam::track_state::lost);
  CHECK(slam.track(time + 0.05, room.frame(60).value().color.view()).state == slam::track_state::relocalized);
  CHECK(slam.active_map() == first);
}

TEST_CASE("A map without depth is loaded by a system without depth only, which is then found in it") {
  const test::temporary_folder folder;
  const auto file = folder.path() / "room.map";
  const io::synthetic_recording room{{.frames = 80, .fps = 20, .seed = 1, .width = 640, .height = 480}};
  slam::system<camera::any_camera> slam{room.camera().model, slam::monocular_options()};
  track_all(slam, room);
  REQUIRE(slam.save_map(file));
  slam::system<camera::any_camera> again{room.camera().model, slam::monocular_options()};
  REQUIRE(again.load_map(file));
  const auto frame = room.frame(60).value();
  CHECK(again.track(frame.timestamp, frame.color.view()).state == slam::track_state::relocalized);
  slam::system<camera::any_camera> with_depth{room.camera().model, slam::options{}};
  const auto refused = with_depth.load_map(file);
  REQUIRE(!refused);
  CHECK(refused.error().code == errc::unsupported);
  CHECK(refused.error().message == "the map was built without depth; its unit of length is not the metre");
}

TEST_CASE("A drive with one camera has the shape of the truth") {
  ORBIS_NEEDS_DATA("kitti07_mono");
  const auto recording = io::open_mono_recording(test::data_dir() / "kitti07_mono").value();
  slam::system<camera::any_camera> slam{recording.camera().model, slam::monocular_options()};
  std::size_t first = recording.size(), lost = 0;
  for (std::size_t i = 0; i != recording.size(); ++i) {
    const auto frame = recording.frame(i).value();
    const bool tracked = slam.track(frame.timestamp, frame.color.view()).tracked();
    if (tracked && first == recording.size()) first = i;
    lost += first != recording.size() && !tracked;
  }
  CHECK(first < 60);
  CHECK(lost == 0);
  CHECK(fault_of(slam) == "");
  const trajectory& truth = recording.ground_truth();
  const auto error = eval::ate(slam.trajectory(), truth, {.with_scale = true});
  REQUIRE(error);
  CHECK(error->translation.rmse < 0.01 * length(truth));
}

TEST_CASE("A sensor of a user's own measures frames for the system") {
  const io::synthetic_recording room{{.frames = 40, .fps = 20, .seed = 1, .width = 640, .height = 480}};
  slam::system own{room.camera().model, slam::monocular_options()},
      library{room.camera().model, slam::monocular_options()};
  for (std::size_t i = 0; i != room.size(); ++i) {
    const auto frame = room.frame(i).value();
    const auto measured = own.track_measured(frame.timestamp, [&](const auto& rig, const auto& extract) {
      auto f = slam::measure_monocular(rig, extract, frame.color.view());
      f.sensor = slam::sensor_kind::unknown;
      return f;
    });
    CHECK(measured.tracked() == library.track(frame.timestamp, frame.color.view()).tracked());
  }
  CHECK(own.landmark_count() == library.landmark_count());
  CHECK(own.landmark_count() > 200);
  CHECK_FALSE(own.map().scale_is_known());
}

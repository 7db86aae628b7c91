// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <thread>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/slam/detail/system/back_end.hpp>

#include "slam/ring_world.hpp"
#include "support/catch.hpp"
#include "support/validate.hpp"

using namespace orbis;

namespace {

using bow_places = slam::bag_of_words_places;

/// A round with the drift of its keyframes, whose last ones show what the first ones do.
struct scene {
  test::ring_world world{{.steps = 60}};
  slam::options options;
  slam::detail::shared_state<camera::any_camera, features::binary_descriptor<256>, bow_places> shared{
      world.rig, options, {}};

  explicit scene(bool threads) {
    options.threads.enabled = threads;
    shared.atlas.active() = world.round(4);
    for (const auto& k : shared.atlas.active().keyframes())
      if (k.id < 63) shared.places.add({0, k.id}, shared.places.describe(k.features));
  }
};

}  // namespace

TEST_CASE("A keyframe is mapped, closes a loop, and the map is adjusted, in threads as well") {
  for (const bool threads : {false, true}) {
    scene s{threads};
    const double before = s.world.errors(s.shared.atlas.active())[0];
    slam::detail::back_end<camera::any_camera, features::binary_descriptor<256>, bow_places> back_end{s.shared};
    back_end.process({0, 63});
    back_end.wait();
    CHECK(s.shared.loops_closed == 1);
    CHECK(s.world.errors(s.shared.atlas.active())[0] < 0.6 * before);
    CHECK(test::validate(s.shared.atlas.active()));
    CHECK_FALSE(back_end.is_full());
  }
}

TEST_CASE("Frames are improved once a keyframe has been mapped, until there is none or the back end is stopped") {
  using back_end_type = slam::detail::back_end<camera::any_camera, features::binary_descriptor<256>, bow_places>;
  for (const bool threads : {false, true})
    for (const bool stops : {false, true}) {
      scene s{threads};
      const std::size_t places = s.shared.places.size();
      std::size_t calls = 0;
      bool is_mapped = true;
      back_end_type back_end{s.shared, [&] {
                               is_mapped =
                                   is_mapped && s.shared.places.size() + s.shared.keyframes_culled == places + 1;
                               if (stops) back_end.stop();
                               return ++calls <= 3;
                             }};
      back_end.process({0, 63});
      back_end.wait();
      CHECK(is_mapped);
      CHECK(calls == (stops ? 1 : 4));
    }
}

TEST_CASE("A back end that ends does not wait for what is in its queue") {
  scene s{true};
  {
    slam::detail::back_end<camera::any_camera, features::binary_descriptor<256>, bow_places> back_end{s.shared};
    for (std::uint32_t k = 0; k != 64; ++k) back_end.process({0, k});
  }
  CHECK(test::validate(s.shared.atlas.active()));
}

TEST_CASE("A back end that is stopped works on nothing more, and can be waited for") {
  for (const bool threads : {false, true}) {
    scene s{threads};
    const double before = s.world.errors(s.shared.atlas.active())[0];
    slam::detail::back_end<camera::any_camera, features::binary_descriptor<256>, bow_places> back_end{s.shared};
    back_end.stop();
    for (std::uint32_t k = 0; k != 64; ++k) back_end.process({0, k});
    back_end.wait();
    CHECK(s.shared.loops_closed == 0);
    CHECK(s.world.errors(s.shared.atlas.active())[0] == before);
    CHECK(test::validate(s.shared.atlas.active()));
  }
}

TEST_CASE("Where loop closing takes long, keyframes wait for mapping, not in a queue behind it") {
  scene s{true};
  std::atomic<bool> may_end{false};
  s.shared.callbacks.map_corrected = [&](const slam::correction_event&) {
    while (!may_end) std::this_thread::sleep_for(std::chrono::milliseconds{1});
  };
  slam::detail::back_end<camera::any_camera, features::binary_descriptor<256>, bow_places> back_end{s.shared};
  for (std::uint32_t k = 63; k != 54; --k) back_end.process({0, k});
  bool always_full = true;
  for (int i = 0; i != 500 && always_full; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
    always_full = back_end.is_full();
  }
  CHECK(always_full);
  may_end = true;
  back_end.wait();
  CHECK_FALSE(back_end.is_full());
  CHECK(s.shared.loops_closed >= 1);
  CHECK(test::validate(s.shared.atlas.active()));
}

TEST_CASE("Where frames wait for the mapping, keyframes that wait do not cut an adjustment short") {
  using back_end_type = slam::detail::back_end<camera::any_camera, features::binary_descriptor<256>, bow_places>;
  const auto poses_after = [](bool threads) {
    scene s{threads};
    s.options.threads.wait = true;
    back_end_type back_end{s.shared};
    for (const std::uint32_t k : {20U, 30U, 40U}) back_end.process({0, k});
    back_end.wait();
    CHECK(s.shared.loops_closed == 0);
    std::vector<double> out;
    for (const auto& k : s.shared.atlas.active().keyframes()) {
      const vec6 pose = k.T_world_camera.log();
      out.insert(out.end(), pose.begin(), pose.end());
    }
    return out;
  };
  CHECK(poses_after(true) == poses_after(false));
}

TEST_CASE("What a callback throws on a thread of the back end comes to its user") {
  scene s{true};
  s.shared.callbacks.map_corrected = [](const slam::correction_event&) { throw std::runtime_error{"of a callback"}; };
  slam::detail::back_end<camera::any_camera, features::binary_descriptor<256>, bow_places> back_end{s.shared};
  back_end.process({0, 63});
  CHECK_THROWS_AS(back_end.wait(), std::runtime_error);
}

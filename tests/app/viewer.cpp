// SPDX-License-Identifier: BSD-3-Clause
//
// The viewer without a run: what the scene is made of, and what the page's server gives and refuses.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/io/jpeg.hpp>

#include "support/catch.hpp"
#include "viewer/backend.hpp"
#include "viewer/scene_builder.hpp"
#include "viewer/viewer_thread.hpp"
#include "viewer/web_messages.hpp"
#include "voxel_colors.hpp"

#ifdef HAS_HTTPLIB
#include <httplib.h>  // after Eigen: it brings a macro, _res
#endif
#ifdef __linux__
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif
#ifdef __GLIBC__
#include <pthread.h>
#endif

using namespace app;
using orbis::rgb8;
using orbis::se3;
using orbis::vec3;
using orbis::vec3f;
using orbis::slam::map_keyframe;

namespace {

constexpr int width = 64, height = 48;

orbis::camera::ray_table rays() {
  return orbis::camera::ray_table{orbis::camera::pinhole{width, height, 50, 50, 32, 24}};
}

se3 at(double x, double y = 0.0, double z = 0.0) { return {{}, {x, y, z}}; }

/// A frame that hangs at a keyframe; a wall of one colour, two metres away.
viewer_frame frame_at(std::uint64_t number, map_keyframe reference, const se3& T_reference_camera, rgb8 color = {}) {
  viewer_frame f;
  f.number = number;
  f.state = "tracking";
  f.tracking_ms = static_cast<double>(number + 1);
  f.T_world_camera = T_reference_camera;
  f.tracked = orbis::slam::tracked_frame{reference, T_reference_camera, {{1.0F, 2.0F, true}, {3.5F, 4.25F, false}}};
  f.color = orbis::image<rgb8>(width, height, color);
  f.depth = orbis::image<std::uint16_t>(width, height, 2000);
  f.depth_scale = 1000.0;
  return f;
}

/// Some keyframes of a map that can be moved.
struct told_graph {
  std::vector<se3> poses;  // of the keyframes of map 0, by id
  double scale = 1.0;      // of all of them
  bool changed = true;
  int answers = 0;
  scene_sources sources() {
    scene_sources s;
    s.graph = [this](slam_graph& g, bool always) {
      if (!std::exchange(changed, false) && !always) return false;
      ++answers;
      g.poses.clear();
      for (const map_keyframe& k : g.asked)
        if (k.map == 0 && k.keyframe.value() < poses.size()) {
          const se3& pose = poses[k.keyframe.value()];
          g.poses.emplace_back(orbis::sim3(pose.rotation(), pose.translation(), scale));
        } else {
          g.poses.emplace_back();
        }
      g.keyframes = poses;
      g.edges.clear();
      for (std::uint32_t i = 1; i < poses.size(); ++i) g.edges.push_back({i, i - 1, edge_kind::tree});
      return true;
    };
    return s;
  }
};

std::vector<vec3f> positions(const viewer_scene& scene) {
  std::vector<vec3f> all;
  for (const trail_point& p : scene.graph.trail) all.push_back(p.position);
  return all;
}

/// The centres of all cubes, as (x, y, z, edge) in voxels' halves, and their colours.
std::set<std::array<long, 4>> cubes_of(const shown_voxels& voxels) {
  std::set<std::array<long, 4>> all;
  for (const auto& [index, block] : voxels.blocks)
    for (const shown_voxel& v : block.voxels) {
      const long edge = 2L << v.level;
      const std::array<std::uint8_t, 3> inside{v.x, v.y, v.z};
      std::array<long, 4> cube{};
      for (std::size_t i = 0; i != 3; ++i) cube[i] = 2L * (index[i] * block_voxels + inside[i]) + edge / 2;
      cube[3] = edge;
      all.insert(cube);
    }
  return all;
}

}  // namespace

TEST_CASE("The newest frame is shown, the path has those that nobody looked at as well") {
  told_graph told{{at(0)}};
  scene_builder builder{"a run", 10, rays(), 0.05};
  for (std::uint64_t i = 0; i != 5; ++i)
    builder.push(frame_at(i, {0, 0}, at(0.1 * static_cast<double>(i)), {static_cast<std::uint8_t>(i), 0, 0}));
  const viewer_scene& scene = builder.update_at_once(told.sources());
  REQUIRE(scene.frame);
  CHECK(scene.title == "a run");
  CHECK(scene.frame->number == 4);
  CHECK(scene.frame->state == "tracking");
  CHECK((*scene.frame->image)(5, 5) == rgb8{4, 0, 0});
  REQUIRE(scene.frame->features.size() == 2);
  CHECK(scene.frame->features[0].tracked);
  CHECK_FALSE(scene.frame->features[1].tracked);
  CHECK(scene.frame->features[1].y == 4.25F);
  REQUIRE(scene.graph.trail.size() == 5);
  for (std::size_t i = 0; i != 5; ++i) {
    CHECK(scene.graph.trail[i].position.x() == Approx(0.1 * static_cast<double>(i)));
    CHECK(scene.graph.trail[i].begins == (i == 0));
  }
  CHECK(scene.numbers.tracking_ms == 5.0);
  CHECK(scene.numbers.frames == 10);
}

TEST_CASE("A camera at rest adds nothing to the path, and a lost one interrupts it") {
  told_graph told{{at(0)}};
  scene_builder builder{"", 0, rays(), 0.05};
  for (std::uint64_t i = 0; i != 100; ++i) builder.push(frame_at(i, {0, 0}, at(0.0001 * static_cast<double>(i))));
  CHECK(builder.update_at_once(told.sources()).graph.trail.size() == 1);
  viewer_frame lost = frame_at(100, {0, 0}, at(0));
  lost.tracked.reset();
  lost.T_world_camera.reset();
  lost.state = "lost";
  builder.push(std::move(lost));
  builder.push(frame_at(101, {0, 0}, at(1.0)));
  const viewer_scene& scene = builder.update_at_once(told.sources());
  REQUIRE(scene.graph.trail.size() == 2);
  CHECK(scene.graph.trail[1].begins);
}

TEST_CASE("Path and keyframes follow corrections, and what is of another map is left out") {
  told_graph told{{at(0), at(10)}};
  scene_builder builder{"", 0, rays(), 0.05};
  builder.push(frame_at(0, {0, 0}, at(0.5)));
  builder.push(frame_at(1, {7, 0}, at(0.5)));  // of a map that is not the active one
  builder.push(frame_at(2, {0, 1}, at(0.5)));
  const viewer_scene& scene = builder.update_at_once(told.sources());
  REQUIRE(positions(scene) == std::vector<vec3f>{{0.5F, 0, 0}, {10.5F, 0, 0}});
  CHECK(scene.graph.trail[1].begins);  // the way through the other map is not drawn as a line
  CHECK(scene.graph.keyframes.size() == 2);
  REQUIRE(scene.graph.edges.size() == 1);
  CHECK(scene.graph.edges[0].kind == edge_kind::tree);

  const std::uint64_t before = scene.graph.revision;
  told.poses[1] = at(10, 3);
  told.changed = true;
  static_cast<void>(builder.update_at_once(told.sources()));
  CHECK(scene.graph.revision > before);
  CHECK(positions(scene) == std::vector<vec3f>{{0.5F, 0, 0}, {10.5F, 3, 0}});
}

TEST_CASE("The path follows corrections of the scale") {
  told_graph told{{at(0), at(10)}};
  scene_builder builder{"", 0, rays(), 0.05};
  builder.push(frame_at(0, {0, 0}, at(0.5)));
  builder.push(frame_at(1, {0, 1}, at(0.5)));
  told.scale = 3.0;
  CHECK(positions(builder.update_at_once(told.sources())) == std::vector<vec3f>{{1.5F, 0, 0}, {11.5F, 0, 0}});
}

TEST_CASE("SLAM is asked from time to time only, and at once where that is wanted") {
  told_graph told{{at(0)}};
  scene_builder builder{"", 0, rays(), 0.05};
  const scene_sources sources = told.sources();
  for (std::uint64_t i = 0; i != 50; ++i) {
    builder.push(frame_at(i, {0, 0}, at(static_cast<double>(i))));
    static_cast<void>(builder.update(sources));
  }
  CHECK(told.answers < 10);
  static_cast<void>(builder.update_at_once(sources));
  CHECK(builder.update(sources).graph.trail.size() == 50);
}

TEST_CASE("Voxels are shown where they are, large ones and those below zero as well") {
  scene_builder builder{"", 0, rays(), 0.05};
  // (x, y, z) of the lowest voxel and the level.
  const std::vector<std::array<int, 4>> wanted{
      {0, 0, 0, 0}, {31, 0, 5, 0}, {32, 0, 5, 0}, {-1, -32, -33, 0}, {-8, 8, 16, 3}};
  std::vector<voxel> cubes;
  std::set<std::array<long, 4>> expected;
  for (const auto& [x, y, z, level] : wanted) {
    const double edge = 0.05 * (1 << level);
    cubes.push_back({vec3f(vec3(0.05 * x + edge / 2, 0.05 * y + edge / 2, 0.05 * z + edge / 2).cast<float>()),
                     static_cast<float>(edge),
                     {1, 2, 3}});
    const long e = 2L << level;
    expected.insert({2L * x + e / 2, 2L * y + e / 2, 2L * z + e / 2, e});
  }
  scene_sources sources;
  int asked = 0;
  sources.voxels = [&](std::vector<voxel>& out) {
    if (asked++ != 0) return false;
    out = cubes;
    return true;
  };
  const viewer_scene& scene = builder.update_at_once(sources);
  CHECK(cubes_of(scene.voxels) == expected);
  CHECK(scene.voxels.count == wanted.size());
  CHECK(scene.voxels.revision == 1);
  static_cast<void>(builder.update_at_once(sources));
  CHECK(scene.voxels.revision == 1);

  // The map in the end takes their place: of the blocks only those count as changed that did.
  const std::uint64_t untouched = scene.voxels.blocks.at({0, 0, 0}).revision;
  std::vector<voxel> last{{cubes[0]}, {cubes[1]}, {cubes[4]}};
  for (voxel& v : last) v.color = no_color;
  builder.set_voxels(last);
  CHECK(scene.voxels.revision == 2);
  CHECK(scene.voxels.count == 3);
  CHECK(scene.voxels.blocks.at({0, 0, 0}).revision == untouched);
  CHECK(scene.voxels.blocks.at({1, 0, 0}).revision == 2);
  CHECK(scene.voxels.blocks.at({1, 0, 0}).voxels.empty());
}

TEST_CASE("Voxels have the colours of keyframes, which follow their corrections") {
  told_graph told{{at(0)}};
  scene_builder builder{"", 0, rays(), 0.05};
  viewer_frame keyframe = frame_at(0, {0, 0}, at(0), {200, 10, 30});
  keyframe.keyframe = map_keyframe{0, 0};
  builder.push(std::move(keyframe));
  builder.push(frame_at(1, {0, 0}, at(0), {1, 1, 1}));  // takes the keyframe's place in the box
  scene_sources sources = told.sources();
  const voxel wall{{0.025F, 0.025F, 2.025F}, 0.05F}, nowhere{{0.025F, 0.025F, -1.025F}, 0.05F},
      later{{5.025F, 0.025F, 2.025F}, 0.05F};
  bool is_new = true;
  sources.voxels = [&](std::vector<voxel>& out) {
    if (std::exchange(is_new, false)) return out = {wall, nowhere, later}, true;
    return false;
  };
  const viewer_scene& scene = builder.update_at_once(sources);
  const auto color_in = [&](const block_index& block) { return scene.voxels.blocks.at(block).voxels.at(0).color; };
  const block_index in_wall{0, 0, 1}, in_nowhere{0, 0, -1}, in_later{3, 0, 1};
  CHECK(color_in(in_wall) == rgb8{200, 10, 30});
  CHECK(color_in(in_nowhere) == no_color);
  CHECK(color_in(in_later) == no_color);
  told.poses[0] = at(5);
  told.changed = true;
  static_cast<void>(builder.update_at_once(sources));
  CHECK(color_in(in_wall) == no_color);
  CHECK(color_in(in_later) == rgb8{200, 10, 30});
  told.poses.clear();  // it is in no map any more
  told.changed = true;
  static_cast<void>(builder.update_at_once(sources));
  CHECK(color_in(in_later) == no_color);
}

TEST_CASE("The colour of a voxel is the mean of its points, what is taken out leaves no trace") {
  voxel_colors colors{0.1};
  colors.add({0.05F, 0.05F, 0.05F}, {100, 0, 0});
  colors.add({0.06F, 0.05F, 0.05F}, {200, 50, 0});
  const voxel here{{0.05F, 0.05F, 0.05F}, 0.1F}, beside{{0.15F, 0.05F, 0.05F}, 0.1F}, far{{0.35F, 0.05F, 0.05F}, 0.1F},
      large{{0.2F, 0.2F, 0.2F}, 0.4F};
  CHECK(colors.mean_color(here) == rgb8{150, 25, 0});
  CHECK(colors.mean_color(beside) == rgb8{150, 25, 0});
  CHECK_FALSE(colors.mean_color(far));
  CHECK(colors.mean_color(large) == rgb8{150, 25, 0});
  colors.remove({0.05F, 0.05F, 0.05F}, {100, 0, 0});
  CHECK(colors.mean_color(here) == rgb8{200, 50, 0});
  colors.remove({0.06F, 0.05F, 0.05F}, {200, 50, 0});
  CHECK_FALSE(colors.mean_color(here));
  CHECK_FALSE(colors.mean_color({{1e9F, 0.0F, 0.0F}, 0.1F}));
  colors.add({std::nanf(""), 0.0F, 0.0F}, {1, 1, 1});
}

TEST_CASE("What voxels without points took is used again") {
  voxel_colors colors{0.1};
  const auto at_step = [](int i) { return vec3f{0.1F * static_cast<float>(i) + 0.05F, 0.05F, 0.05F}; };
  for (int i = 0; i != 100; ++i) colors.add(at_step(i), {1, 2, 3});
  CHECK(colors.size() == 100);
  for (int i = 0; i != 100; ++i) colors.remove(at_step(i), {1, 2, 3});
  CHECK(colors.size() == 0);
  const std::size_t memory = colors.memory_bytes();
  for (int i = 100; i != 10000; ++i) {
    colors.add(at_step(i), {1, 2, 3});
    if (i >= 200) colors.remove(at_step(i - 100), {1, 2, 3});
  }
  CHECK(colors.size() == 100);
  CHECK(colors.memory_bytes() <= 2 * memory);
  CHECK(colors.mean_color({at_step(9999), 0.1F}) == rgb8{1, 2, 3});
}

namespace {

/// Keyframes in a row, five metres from each other, that look at a wall each; the wall of the last one is green.
struct row_of_walls {
  static constexpr std::size_t count = 20, most = 2000;
  told_graph told;
  scene_builder builder{"", 0, rays(), 0.05, most};
  std::vector<voxel> cubes;
  scene_sources sources = told.sources();
  explicit row_of_walls(double y) {
    sources.voxels = [this, is_new = true](std::vector<voxel>& out) mutable {
      out = cubes;
      return std::exchange(is_new, false);
    };
    for (std::size_t i = 0; i != count; ++i) {
      const double x = 5.0 * static_cast<double>(i);
      for (int a = -10; a != 10; ++a)
        for (int b = -8; b != 8; ++b)
          cubes.push_back({vec3f(vec3(x + 0.05 * a + 0.025, y + 0.05 * b + 0.025, 2.025).cast<float>()), 0.05F});
    }
  }
  void push(std::size_t i) {
    viewer_frame keyframe =
        frame_at(i, {0, static_cast<std::uint32_t>(i)}, at(0), i + 1 == count ? rgb8{10, 200, 30} : rgb8{200, 10, 30});
    keyframe.keyframe = map_keyframe{0, static_cast<std::uint32_t>(i)};
    builder.push(std::move(keyframe));
  }
  /// The share of the cubes that have a colour.
  [[nodiscard]] static double colored(const shown_voxels& voxels) {
    std::size_t all = 0, with_color = 0;
    for (const auto& [index, block] : voxels.blocks)
      for (const shown_voxel& v : block.voxels) {
        ++all;
        if (v.color != no_color) ++with_color;
      }
    return static_cast<double>(with_color) / static_cast<double>(all);
  }
};

}  // namespace

TEST_CASE("The pixels that are kept for colours have a limit, and what is given up leaves no trace") {
  row_of_walls row{3.0};
  for (std::size_t i = 0; i != row_of_walls::count; ++i) {
    row.told.poses.push_back(at(5.0 * static_cast<double>(i)));
    row.told.changed = true;
    row.push(i);
    static_cast<void>(row.builder.update_at_once(row.sources));
    CHECK(row.builder.color_samples() <= row_of_walls::most);
  }
  CHECK(row.builder.color_samples() > row_of_walls::most / 2);
  // Where the keyframes were is nothing of them any more; where they are now, all have something left.
  for (se3& pose : row.told.poses) pose = at(pose.translation().x(), 3.0);
  row.told.changed = true;
  const viewer_scene& scene = row.builder.update_at_once(row.sources);
  CHECK(row_of_walls::colored(scene.voxels) > 0.3);  // a third of the pixels is left
  bool has_green = false;
  for (const auto& [index, block] : scene.voxels.blocks)
    for (const shown_voxel& v : block.voxels) has_green = has_green || v.color == rgb8{10, 200, 30};
  CHECK(has_green);
  for (se3& pose : row.told.poses) pose = at(pose.translation().x(), 300.0);
  row.told.changed = true;
  static_cast<void>(row.builder.update_at_once(row.sources));
  CHECK(row_of_walls::colored(scene.voxels) == 0.0);

  row.builder.finish(row.sources);
  CHECK(scene.is_over);
  CHECK(row.builder.color_samples() == 0);

  // A second run begins with an empty scene, and viewers see that it has changed.
  const auto graph = scene.graph.revision, voxels = scene.voxels.revision;
  row.builder.begin();
  CHECK_FALSE(scene.is_over);
  CHECK_FALSE(scene.frame);
  CHECK(scene.graph.revision > graph);
  CHECK(scene.graph.trail.empty());
  CHECK(scene.voxels.revision > voxels);
  for (const auto& [index, block] : scene.voxels.blocks) CHECK(block.voxels.empty());
  row.push(0);
  static_cast<void>(row.builder.update_at_once(row.sources));
  CHECK(scene.frame);
  CHECK(scene.graph.trail.size() == 1);
  CHECK(row.builder.color_samples() > 0);
}

TEST_CASE("Keyframes that nobody takes do not pile up, and without a live map none of their pixels are kept") {
  row_of_walls row{0.0};
  for (std::size_t i = 0; i != row_of_walls::count; ++i) {
    row.told.poses.push_back(at(5.0 * static_cast<double>(i)));
    row.push(i);
  }
  static_cast<void>(row.builder.update_at_once(row.sources));
  CHECK(row.builder.color_samples() > 0);
  CHECK(row.builder.color_samples() <= row_of_walls::most / 2);

  row_of_walls other{0.0};
  other.builder.set_no_voxels("no live map");
  for (std::size_t i = 0; i != row_of_walls::count; ++i) {
    other.told.poses.push_back(at(0));
    other.push(i);
    static_cast<void>(other.builder.update_at_once(other.sources));
    CHECK(other.builder.color_samples() == 0);
  }
}

TEST_CASE("Tracking never waits for who looks at the scene") {
  told_graph told{{at(0)}};
  scene_builder builder{"", 0, rays(), 0.05};
  std::atomic<bool> asked{false}, ends{false};
  scene_sources slow;
  slow.graph = [&](slam_graph&, bool) {
    asked = true;
    while (!ends) std::this_thread::sleep_for(std::chrono::milliseconds{1});
    return false;
  };
  std::thread viewer{[&] { static_cast<void>(builder.update_at_once(slow)); }};
  while (!asked) std::this_thread::yield();
  for (std::uint64_t i = 0; i != 200; ++i) builder.push(frame_at(i, {0, 0}, at(static_cast<double>(i))));
  ends = true;  // nothing above could have come this far if it waited
  viewer.join();
  CHECK(builder.update_at_once(told.sources()).frame->number == 199);
}

namespace {

/// Does what it is told to when it draws.
class told_backend final : public viewer_backend {
 public:
  explicit told_backend(std::function<bool(const viewer_scene&)> draw) : draw_{std::move(draw)} {}
  [[nodiscard]] bool draw(const viewer_scene& scene) override { return draw_(scene); }
  [[nodiscard]] std::string where() const override { return "here"; }
  [[nodiscard]] std::chrono::milliseconds interval() const override { return std::chrono::milliseconds{1}; }

 private:
  std::function<bool(const viewer_scene&)> draw_;
};

viewer_thread::open_backend opens(std::function<bool(const viewer_scene&)> draw) {
  return [draw = std::move(draw)]() -> orbis::result<std::unique_ptr<viewer_backend>> {
    return std::make_unique<told_backend>(draw);
  };
}

/// False if it does not come true within ten seconds.
template <class Condition>
bool comes_true(const Condition& condition) {
  for (int i = 0; i != 10000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds{1});
  return condition();
}

#ifdef __linux__
int niceness() { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid))); }
#endif

}  // namespace

TEST_CASE("The viewer draws what it is shown and what its sources say, until it is closed") {
  viewer_thread viewer{"a run", 3, rays(), 0.05};
  CHECK_FALSE(viewer.is_open());
  std::atomic<bool> sees_all{false}, closes{false};
  REQUIRE(viewer.start(opens([&](const viewer_scene& scene) {
    sees_all =
        scene.frame && scene.frame->number == 2 && scene.graph.keyframes.size() == 1 && scene.numbers.insertions == 2;
    return !closes;
  })) == "here");
  CHECK(viewer.is_open());
  told_graph told{{at(0)}};
  scene_sources sources = told.sources();
  sources.numbers = [] {
    live_results live;
    live.insert_ms = {1.0, 2.0};
    return live;
  };
  viewer.connect(sources);
  for (std::uint64_t i = 0; i != 3; ++i) viewer.show([&] { return frame_at(i, {0, 0}, at(0)); });
  CHECK(comes_true([&] { return sees_all.load(); }));
  viewer.disconnect();
  closes = true;
  CHECK(comes_true([&] { return !viewer.is_open(); }));
  bool was_asked = false;
  viewer.show([&] { return was_asked = true, frame_at(4, {0, 0}, at(0)); });
  CHECK_FALSE(was_asked);
  CHECK(viewer.take_error().empty());
}

TEST_CASE("A viewer that cannot be opened says why") {
  viewer_thread viewer{"", 0, rays(), 0.05};
  const auto where = viewer.start([]() -> orbis::result<std::unique_ptr<viewer_backend>> {
    return orbis::fail(orbis::errc::unsupported, "a screen", "there is none");
  });
  REQUIRE_FALSE(where);
  CHECK(where.error().message == "there is none");
  CHECK_FALSE(viewer.is_open());
  CHECK(viewer.take_error().empty());
}

TEST_CASE("An exception closes the viewer, which says so once, and reaches nobody else") {
  const std::string where_it_happens =
      GENERATE(as<std::string>{}, "open", "draw", "draw, unknown", "graph", "numbers", "voxels", "show", "disconnect");
  INFO(where_it_happens);
  const auto happens = [&](const char* here) {
    if (where_it_happens == here) throw std::runtime_error{"no more memory"};
  };
  viewer_thread viewer{"", 0, rays(), 0.05};
  const auto where = viewer.start([&]() -> orbis::result<std::unique_ptr<viewer_backend>> {
    happens("open");
    return std::make_unique<told_backend>([&](const viewer_scene&) {
      happens("draw");
      if (where_it_happens == "draw, unknown") throw 1;
      return true;
    });
  });
  REQUIRE(where);
  CHECK(*where == (where_it_happens == "open" ? "" : "here"));
  scene_sources sources;
  sources.graph = [&](slam_graph&, bool) { return happens("graph"), false; };
  sources.numbers = [&] { return happens("numbers"), live_results{}; };
  std::atomic<bool> is_over{false};
  sources.voxels = [&](std::vector<voxel>&) {
    happens("voxels");
    if (is_over) happens("disconnect");
    return false;
  };
  viewer.connect(sources);
  viewer.show([&] {
    happens("show");
    return frame_at(0, {0, 0}, at(0));
  });
  if (where_it_happens == "disconnect") {
    CHECK(viewer.is_open());
    is_over = true;
    viewer.disconnect();
  }
  CHECK(comes_true([&] { return !viewer.is_open(); }));
  viewer.show([&] { return frame_at(1, {0, 0}, at(0)); });
  viewer.disconnect();
  viewer.show_map({});
  CHECK(viewer.take_error() == (where_it_happens == "draw, unknown" ? "unknown exception" : "no more memory"));
  CHECK(viewer.take_error().empty());
}

#ifdef __GLIBC__
TEST_CASE("Where the system gives no thread, the viewer is closed and says so") {
  pthread_attr_t before, huge;
  REQUIRE(::pthread_getattr_default_np(&before) == 0);
  REQUIRE(::pthread_attr_init(&huge) == 0);
  REQUIRE(::pthread_attr_setstacksize(&huge, std::size_t{1} << 47U) == 0);  // more than there are addresses
  viewer_thread viewer{"", 0, rays(), 0.05};
  REQUIRE(::pthread_setattr_default_np(&huge) == 0);
  const auto where = viewer.start(opens([](const viewer_scene&) { return true; }));
  REQUIRE(::pthread_setattr_default_np(&before) == 0);
  REQUIRE(where);
  CHECK(where->empty());
  CHECK_FALSE(viewer.is_open());
  viewer.connect({});
  viewer.show([&] { return frame_at(0, {0, 0}, at(0)); });
  viewer.disconnect();
  CHECK_FALSE(viewer.take_error().empty());
}
#endif

#ifdef __linux__
TEST_CASE("The viewer gives way to tracking, but does not take its locks at low priority") {
  const int here = niceness();
  if (here > 9) return;  // it cannot be lowered by ten
  std::atomic<int> of_open{100}, of_draw{100}, of_graph{100}, of_numbers{100};
  viewer_thread viewer{"", 0, rays(), 0.05};
  REQUIRE(viewer.start([&]() -> orbis::result<std::unique_ptr<viewer_backend>> {
    of_open = niceness();
    return std::make_unique<told_backend>([&](const viewer_scene&) {
      of_draw = niceness();
      return true;
    });
  }));
  scene_sources sources;
  sources.graph = [&](slam_graph&, bool) { return of_graph = niceness(), false; };
  sources.numbers = [&] { return of_numbers = niceness(), live_results{}; };
  viewer.connect(sources);
  CHECK(comes_true([&] { return of_draw != 100 && of_graph != 100 && of_numbers != 100; }));
  CHECK(of_open == here + 10);
  CHECK(of_draw == here + 10);
  CHECK(of_graph == here);
  CHECK(of_numbers == here);
  CHECK(niceness() == here);
}
#endif

TEST_CASE("Frames can be shown while the viewer hangs in a drawing") {
  std::atomic<bool> draws{false}, ends{false};
  std::atomic<std::uint64_t> last{0};
  viewer_thread viewer{"", 0, rays(), 0.05};
  REQUIRE(viewer.start(opens([&](const viewer_scene& scene) {
    draws = true;
    while (!ends) std::this_thread::sleep_for(std::chrono::milliseconds{1});
    if (scene.frame) last = scene.frame->number;
    return true;
  })));
  while (!draws) std::this_thread::yield();
  for (std::uint64_t i = 0; i != 200; ++i) viewer.show([&] { return frame_at(i, {0, 0}, at(static_cast<double>(i))); });
  ends = true;  // nothing above could have come this far if it waited
  CHECK(comes_true([&] { return last == 199; }));
}

#ifdef HAS_HTTPLIB

namespace {

/// Reads numbers one after the other.
class reader {
 public:
  explicit reader(const std::string& bytes) : bytes_{bytes} {}
  template <class T>
  T next() {
    REQUIRE(at_ + sizeof(T) <= bytes_.size());
    T value;
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::string text(std::size_t size) { return bytes_.substr(std::exchange(at_, at_ + size), size); }
  std::string rest() { return bytes_.substr(at_); }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

struct served {
  std::unique_ptr<viewer_backend> backend = open_web(0).value();
  std::string where = backend->where();
  int port = std::stoi(where.substr(where.rfind(':') + 1));
  httplib::Client client{"127.0.0.1", port};
};

viewer_scene small_scene() {
  viewer_scene scene;
  scene.title = "a \"run\"\xff";
  shown_frame frame{41, "tracking", at(1, 2, 3), std::make_shared<orbis::image<rgb8>>(32, 16, rgb8{50, 100, 150}), {}};
  frame.features = {{1.5F, 2.25F, true}, {30.0F, 3.0F, false}};
  scene.frame = frame;
  scene.graph = {3, {at(0), at(1)}, {{1, 0, edge_kind::loop}}, {{{1, 2, 3}, true}, {{4, 5, 6}, false}}};
  scene.voxels.revision = 2;
  scene.voxels.resolution = 0.05;
  scene.voxels.count = 2;
  scene.voxels.ceiling = 2.5F;
  scene.voxels.blocks[{0, -1, 2}] = {1, {{1, 2, 3, 0, {7, 8, 9}}}};
  scene.voxels.blocks[{5, 6, 7}] = {2, {{4, 5, 6, 1, {10, 11, 12}}}};
  return scene;
}

std::string body(const httplib::Result& answer) {
  REQUIRE(answer);
  REQUIRE(answer->status == 200);
  return answer->body;
}

}  // namespace

TEST_CASE("The server gives a page that needs nothing else, and forbids it to fetch from elsewhere") {
  served s;
  CHECK(s.where == "http://127.0.0.1:" + std::to_string(s.port) + "/");
  const auto page = s.client.Get("/");
  const std::string html = body(page);
  CHECK(html.find("</html>") != std::string::npos);
  CHECK(html.find("gl_VertexID") != std::string::npos);  // the shaders are in it
  CHECK(html.find("/*voxel") == std::string::npos);
  for (const char* elsewhere : {"http:", "https:", "src=\"", "@import", "url("})
    CHECK(html.find(elsewhere) == std::string::npos);
  CHECK(page->get_header_value("Content-Security-Policy").find("default-src 'none'") == 0);
  CHECK(page->get_header_value("Content-Type").find("text/html") == 0);
  CHECK_FALSE(page->has_header("Access-Control-Allow-Origin"));
}

TEST_CASE("The server gives the scene, and not again what was seen") {
  served s;
  CHECK(body(s.client.Get("/frame")).find("{}") != std::string::npos);  // nothing yet
  const viewer_scene scene = small_scene();
  REQUIRE(s.backend->draw(scene));

  const std::string frame = body(s.client.Get("/frame"));
  reader f{frame};
  const std::string json = f.text(f.next<std::uint32_t>());
  CHECK(json.find("\"number\":41") != std::string::npos);
  CHECK(json.find("a \\\"run\\\"") != std::string::npos);
  CHECK(json.find("\"tracked\":1") != std::string::npos);
  REQUIRE(f.next<std::uint32_t>() == 2);
  CHECK(f.next<std::uint16_t>() == 12);
  CHECK(f.next<std::uint16_t>() == 18);
  CHECK(f.next<std::uint16_t>() == 1);
  f.text(6);
  const auto image = orbis::io::decode_jpeg(f.rest()).value();
  REQUIRE(image.width() == 32);
  CHECK(int{image(16, 8).b} == Approx(150).margin(8));
  const std::string again = body(s.client.Get("/frame?since=42"));
  CHECK(again.size() == 4 + json.size() + 4);

  const std::string graph = body(s.client.Get("/graph"));
  reader g{graph};
  REQUIRE(g.next<std::uint32_t>() == 2);
  g.text(48 + 12);
  CHECK(g.next<float>() == 1.0F);  // x of the second keyframe
  g.text(48 - 16);
  REQUIRE(g.next<std::uint32_t>() == 1);
  CHECK(g.next<std::uint32_t>() == 1);
  CHECK(g.next<std::uint32_t>() == 0);
  CHECK(g.next<std::uint32_t>() == 2);
  REQUIRE(g.next<std::uint32_t>() == 2);
  CHECK(g.next<float>() == 1.0F);
  CHECK(s.client.Get("/graph?since=3")->status == 204);

  for (const auto& [since, blocks] : {std::pair{0, 2U}, std::pair{1, 1U}, std::pair{2, 0U}}) {
    const std::string voxels = body(s.client.Get("/voxels?since=" + std::to_string(since)));
    reader v{voxels};
    CHECK(v.next<float>() == 0.05F);
    CHECK(v.next<float>() == 0.0F);
    CHECK(v.next<float>() == 2.5F);
    CHECK(v.next<std::uint32_t>() == 2);
    CHECK(v.next<std::uint32_t>() == blocks);
    if (since != 1) continue;
    for (const int i : {5, 6, 7}) CHECK(v.next<std::int32_t>() == i);
    REQUIRE(v.next<std::uint32_t>() == 1);
    for (const int b : {4, 5, 6, 1, 10, 11, 12, 0}) CHECK(int{v.next<std::uint8_t>()} == b);
    CHECK(v.rest().empty());
  }
}

TEST_CASE("The server answers this machine only, reads only, and knows no files") {
  served s;
  for (const char* host :
       {"localhost", "127.0.0.1", "localhost:9999", "127.0.0.1:80"})  // a tunnel has a port of its own
    CHECK(s.client.Get("/", {{"Host", host}})->status == 200);
  for (const char* host : {"example.org", "example.org:8090", "127.0.0.1.example.org", "localhost.example.org",
                           "127.0.0.1:80@example.org", "localhost:x", "", "127.0.0.2", "[::1]:8090"})
    for (const char* path : {"/", "/frame", "/voxels"}) {
      INFO(host);
      const auto answer = s.client.Get(path, {{"Host", host}});
      REQUIRE(answer);
      CHECK(answer->status == 403);
    }
  CHECK(s.client.Post("/frame", "{}", "application/json")->status == 405);
  CHECK(s.client.Put("/", "x", "text/plain")->status == 405);
  CHECK(s.client.Delete("/frame")->status == 405);
  CHECK(s.client.Head("/")->status == 405);
  CHECK(s.client.Options("/")->status == 405);
  for (const char* path : {"/etc/passwd", "/../../../../etc/passwd", "/..%2f..%2fetc/passwd", "//etc/passwd",
                           "/index.html", "/frame/", "/page.html"}) {
    INFO(path);
    const auto answer = s.client.Get(path);
    REQUIRE(answer);
    CHECK((answer->status == 404 || answer->status == 400));
    CHECK(answer->body.find("root:") == std::string::npos);
  }
  for (const char* path :
       {"/frame?since=x", "/voxels?since=-1", "/graph?since=1e3", "/graph?since=99999999999999999999"})
    CHECK(s.client.Get(path)->status == 400);
}

TEST_CASE("The server gives no parts of anything, so that nobody can ask for one part many times") {
  served s;
  REQUIRE(s.backend->draw(small_scene()));
  std::string many = "bytes=0-";
  for (int i = 0; i != 2000; ++i) many += ",0-";
  for (const std::string& range :
       {std::string{"bytes=0-9"}, std::string{"bytes=5-"}, std::string{"bytes=-5"}, std::string{"bytes=99999999-"},
        std::string{"bytes=5-2"}, std::string{"bytes=-"}, std::string{"bytes=0-1,3-4"}, std::string{"lines=1-2"},
        std::string{"bytes=99999999999999999999999-1"}, "bytes=" + std::string(8000, '1') + "-", many})
    for (const char* path : {"/", "/frame", "/voxels", "/nothing"}) {
      INFO(path << " " << range.substr(0, 40));
      const auto answer = s.client.Get(path, {{"Range", range}});
      REQUIRE(answer);
      CHECK(answer->status == 416);
      CHECK(answer->body.size() < 1000);
    }
  CHECK(body(s.client.Get("/")).size() > 1000);
  CHECK(s.backend->draw(small_scene()));
}

TEST_CASE("A port that is taken is an error, and is free again afterwards") {
  auto first = std::make_unique<served>();
  const auto port = static_cast<unsigned>(first->port);
  const auto second = open_web(port);
  REQUIRE_FALSE(second);
  CHECK(second.error().to_string().find("--viewer-port") != std::string::npos);
  CHECK(body(first->client.Get("/")).size() > 1000);
  first.reset();
  CHECK(open_web(port));
}

TEST_CASE("Many who ask at once are all answered, and the end waits for nobody who is silent") {
  auto s = std::make_unique<served>();
  REQUIRE(s->backend->draw(small_scene()));
  std::atomic<int> answered{0};
  std::vector<std::thread> askers;
  for (int i = 0; i != 24; ++i)
    askers.emplace_back([&, port = s->port] {
      httplib::Client client{"127.0.0.1", port};
      client.set_keep_alive(true);
      client.set_read_timeout(60);
      client.set_connection_timeout(60);
      for (int k = 0; k != 25; ++k)
        if (const auto answer = client.Get("/frame"); answer && answer->status == 200) ++answered;
    });
  for (std::thread& t : askers) t.join();
  CHECK(answered == 24 * 25);
  httplib::Client idle{"127.0.0.1", s->port};
  idle.set_keep_alive(true);
  CHECK(idle.Get("/frame")->status == 200);
  const auto start = std::chrono::steady_clock::now();
  s.reset();
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds{10});
}

#endif

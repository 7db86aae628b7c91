// SPDX-License-Identifier: BSD-3-Clause
//
// explore MAP.bt: autonomous mapping of a synthetic building with three furnished rooms, with known poses. A flying
// robot repeatedly chooses a view that shows much unknown space after a short path, flies to it through known free
// space, and takes views along the path, until no view shows enough unknown space.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <orbis/camera.hpp>
#include <orbis/io.hpp>
#include <orbis/nav.hpp>
#include <orbis/octree.hpp>

#include "../common/program.hpp"
#include "../common/same_file.hpp"

using orbis::se3;
using orbis::vec3;

using map_type = orbis::octree::occupancy_octree<>;

int report_error(int code, const std::string& why) { return examples::report_error("explore", code, why); }

/// A furnished room, divided by two walls, each with a door. z is up; the origin is the centre of the floor.
class building {
 public:
  explicit building(std::uint64_t seed)
      : room_{{.seed = seed,
               .scene = {.length = 2 * half.x(), .width = 2 * half.y(), .height = 2.6, .size_jitter = 0.0}}} {
    for (const double x : {-2.0, 1.9}) {
      walls_.push_back({{x, -half.y(), 0.0}, {x + 0.1, x < 0 ? -0.3 : -1.2, 2.6}});
      walls_.push_back({{x, x < 0 ? 0.9 : 0.0, 0.0}, {x + 0.1, half.y(), 2.6}});
      walls_.push_back({{x, -half.y(), 2.1}, {x + 0.1, half.y(), 2.6}});  // above the doors
    }
  }
  [[nodiscard]] orbis::octree::bounding_box bounds() const {
    return {{-half.x(), -half.y(), 0.0}, {half.x(), half.y(), 2.6}};
  }
  /// The distance to the nearest surface in metres.
  [[nodiscard]] double distance(const vec3& p) const {
    double d = room_.surface_distance(p);
    for (const auto& w : walls_) {
      const double outside = (p - p.cwiseMax(w.min).cwiseMin(w.max)).norm();
      d = std::min(d, outside);
    }
    return d;
  }
  /// A depth image of the camera: depth along the optical axis, metres.
  template <class Camera>
  [[nodiscard]] orbis::image<float> depth(const Camera& camera, const se3& T_world_camera) const {
    auto image = room_.exact_depth(orbis::par, camera, T_world_camera);
    for (int y = 0; y != image.height(); ++y)
      for (int x = 0; x != image.width(); ++x)
        if (const auto ray = camera.unproject(orbis::vec2{double(x), double(y)}))
          for (const auto& w : walls_)
            if (const double d = enter(w, T_world_camera.translation(), T_world_camera.rotation() * *ray);
                d < image(x, y))
              image(x, y) = static_cast<float>(d);
    return image;
  }

 private:
  inline static const orbis::vec2 half{6.0, 3.0};

  /// The distance along a ray at which it enters a box.
  [[nodiscard]] static double enter(const orbis::octree::bounding_box& b, const vec3& origin, const vec3& direction) {
    const vec3 one = (b.min - origin).cwiseQuotient(direction), other = (b.max - origin).cwiseQuotient(direction);
    const double in = one.cwiseMin(other).maxCoeff(), out = one.cwiseMax(other).minCoeff();
    return in <= out && in > 0.0 ? in : std::numeric_limits<double>::infinity();
  }

  orbis::io::synthetic_recording room_;
  std::vector<orbis::octree::bounding_box> walls_;
};

/// Calls `visit(key)` for the voxels in a box.
template <class Visit>
void for_each_voxel(const orbis::octree::voxel_grid& grid, const orbis::octree::bounding_box& box, Visit&& visit) {
  const auto keys = *orbis::octree::keys_between(grid, box.min, box.max);
  for (auto z = keys.low.z; z <= keys.high.z; ++z)
    for (auto y = keys.low.y; y <= keys.high.y; ++y)
      for (auto x = keys.low.x; x <= keys.high.x; ++x) visit(orbis::octree::voxel_key{x, y, z});
}

struct explorer {
  const building& world;
  orbis::camera::pinhole camera;
  double radius, range;
  map_type map;
  orbis::nav::distance_field field;
  orbis::nav::frontiers frontiers;
  vec3 position;
  std::vector<vec3> trail;  ///< previous positions
  double travelled = 0.0;
  int views = 0;

  explorer(const building& b, double resolution, int width, double robot_radius, double max_range, const vec3& start)
      : world{b},
        camera{width, width * 3 / 4, 0.6 * width, 0.6 * width, 0.5 * (width - 1), 0.5 * (width * 3 / 4 - 1)},
        radius{robot_radius},
        range{max_range},
        map{resolution},
        field{map.grid(), {.reach = robot_radius + 4 * resolution}},
        frontiers{map.grid()},
        position{start} {
    map.track_changes();
    // The space that the robot occupies is free.
    const vec3 around = vec3::Constant(radius + 2 * resolution);
    for_each_voxel(map.grid(), {start - around, start + around}, [&](const auto& k) {
      map.edit_octant(k, [&](auto& voxels) {
        const auto i = orbis::octree::morton_code(k) & 63U;
        voxels.known |= std::uint64_t{1} << i;
        voxels.value[i] = -0.4F;
      });
    });
  }

  [[nodiscard]] orbis::nav::planning_view<map_type> view() const { return {map, field, radius}; }
  void look(const se3& T_world_camera) {
    const auto depth = world.depth(camera, T_world_camera);
    map.integrate(orbis::camera::depth_view<float>{depth.view()}, camera, T_world_camera, {.max_range = range});
    ++views;
    field.update(map);
    frontiers.update(map);
  }
  void look_around() {
    for (const double z : {-0.4, 0.4})
      for (int i = 0; i != 8; ++i) {
        const double yaw = 0.7853981633974483 * i;
        look(orbis::nav::looking_at(position, position + vec3{std::cos(yaw), std::sin(yaw), z}));
      }
  }
  void go(const vec3& next) {
    travelled += (next - position).norm();
    position = next;
  }
  /// Moves back along the trail to a free position, because a wall seen from nearby may extend into voxels that were
  /// free.
  bool back_out() {
    for (; !view().is_free(position) && !trail.empty(); trail.pop_back()) go(trail.back());
    return view().is_free(position);
  }
  /// Flies to a position in steps of one second, from rest to rest; after each step, takes a view and replans. Returns
  /// false if there is no path or no view is left.
  bool fly_to(const vec3& goal, int budget) {
    orbis::nav::replanner planner{goal};
    while (views < budget) {
      if (position == goal) return true;
      const auto now = view();
      const auto& path = planner.update(now, position);
      if (path.status != orbis::nav::path_status::found) return false;
      const auto motion = orbis::nav::make_trajectory(now, path.points, {.speed = 1.0, .acceleration = 1.0});
      const double seconds = std::min(1.0, motion.duration());
      for (const double share : {0.25, 0.5, 0.75, 1.0}) {
        trail.push_back(position);
        go(motion.at(share * seconds).position);
      }
      if (seconds == motion.duration()) position = goal;
      const vec3 ahead = position - trail.back();
      const orbis::vec2 level = ahead.head<2>();
      if (level.norm() > 0.1 * ahead.norm())
        look(orbis::nav::looking_at(position, position + vec3{level.x(), level.y(), 0.0}));
    }
    return false;
  }
};

/// The share of the reachable free space that is free in the map. Reachable free space consists of the voxels that
/// touch no surface and are connected to the start; `air` receives their number.
double coverage(const explorer& robot, const vec3& start, std::size_t& air) {
  const auto& grid = robot.map.grid();
  const auto keys = *orbis::octree::keys_between(grid, robot.world.bounds().min, robot.world.bounds().max);
  const std::array<std::uint32_t, 3> size{keys.high.x - keys.low.x + 1, keys.high.y - keys.low.y + 1,
                                          keys.high.z - keys.low.z + 1};
  std::vector<bool> seen(std::size_t{size[0]} * size[1] * size[2]);
  const double clear = 0.87 * grid.resolution();  // half of a voxel's diagonal
  std::vector<orbis::octree::voxel_key> open;
  const auto offer = [&](const orbis::octree::voxel_key& k) {
    const std::uint32_t x = k.x - keys.low.x, y = k.y - keys.low.y, z = k.z - keys.low.z;
    if (x >= size[0] || y >= size[1] || z >= size[2]) return;
    const std::size_t i = (std::size_t{z} * size[1] + y) * size[0] + x;
    if (seen[i]) return;
    seen[i] = true;
    if (robot.world.distance(grid.center(k)) > clear) open.push_back(k);
  };
  offer(*grid.key(start));
  air = 0;
  std::size_t known = 0;
  while (!open.empty()) {
    const auto k = open.back();
    open.pop_back();
    ++air;
    known += robot.map.state(grid.center(k)) == orbis::octree::occupancy::free ? 1 : 0;
    for (const std::uint32_t by : {1U, ~0U}) {
      offer({k.x + by, k.y, k.z});
      offer({k.x, k.y + by, k.z});
      offer({k.x, k.y, k.z + by});
    }
  }
  return static_cast<double>(known) / static_cast<double>(std::max<std::size_t>(1, air));
}

int run(int argc, char** argv) {
  std::string output;
  double resolution = 0.05, radius = 0.2, range = 4.0;
  int budget = 600, width = 160;
  std::uint64_t seed = 1;
  CLI::App cli{"Autonomous mapping of a synthetic building", "explore"};
  cli.add_option("MAP", output, "output .bt file")->required();
  cli.add_option("--resolution", resolution, "voxel size in metres")
      ->check(CLI::Range(0.02, 0.2))
      ->capture_default_str();
  cli.add_option("--robot-radius,--radius", radius, "radius of the robot in metres")
      ->check(CLI::Range(0.05, 0.35))
      ->capture_default_str();
  cli.add_option("--range", range, "range of the camera in metres")
      ->check(CLI::Range(1.0, 10.0))
      ->capture_default_str();
  cli.add_option("--width", width, "width of the depth images in pixels")
      ->check(CLI::Range(40, 640))
      ->capture_default_str();
  cli.add_option("--views", budget, "maximum number of views")->check(CLI::Range(16, 100000))->capture_default_str();
  cli.add_option("--seed", seed, "seed of the building")->capture_default_str();
  if (const auto code = examples::parse(cli, argc, argv)) return *code;
  if (const std::string why = examples::unwritable_message(output); !why.empty()) return report_error(2, why);

  const building world{seed};
  const vec3 start{-4.0, 0.0, 1.3};
  explorer robot{world, resolution, width, radius, range, start};
  robot.look_around();

  const double spacing = 0.8;
  orbis::nav::next_view_options options;
  options.gain = {.max_range = range, .pixel_step = std::max(1, width / 40), .bounds = world.bounds()};
  options.min_gain = 0.01;
  std::vector<vec3> done;  // targets whose unknown space was not visible in a view
  std::string why = "maximum number of views";
  while (robot.views < budget) {
    if (!robot.back_out()) {
      why = "no free space around the robot";
      break;
    }
    auto places =
        orbis::nav::candidate_viewpoints(robot.frontiers.clusters({.min_size = 10}), robot.map.grid(), spacing);
    std::erase_if(places, [&](const vec3& p) {
      return std::any_of(done.begin(), done.end(), [&](const vec3& d) { return (p - d).norm() < spacing / 2; });
    });
    ++options.seed;
    const auto next = orbis::nav::next_best_view(robot.view(), places, robot.camera, robot.position, options);
    if (next.status != orbis::nav::next_view_status::found) {
      why = next.status == orbis::nav::next_view_status::nothing_to_see ? "no view shows enough unknown space"
                                                                        : std::string{to_string(next.status)};
      break;
    }
    orbis::nav::view_gain gain{robot.map, robot.camera, options.gain};
    const auto before = gain(next.T_world_camera);
    if (!robot.fly_to(next.T_world_camera.translation(), budget)) continue;
    robot.look(next.T_world_camera);
    // Space that is still unknown is not visible from here.
    orbis::nav::view_gain after{robot.map, robot.camera, options.gain};
    if (2 * after(next.T_world_camera) > before) done.push_back(next.place);
  }

  std::size_t air = 0;
  const double share = coverage(robot, start, air);
  std::printf("views: %d\npath: %.2f m\ncoverage: %.2f %% of %.1f m3\nfrontier: %zu voxels\nended: %s\n", robot.views,
              robot.travelled, 100.0 * share, static_cast<double>(air) * std::pow(resolution, 3),
              robot.frontiers.size(), why.c_str());
  if (const auto written = write_bt(robot.map, output); !written)
    return report_error(2, examples::describe(written.error()));
  return 0;
}

int main(int argc, char** argv) {
  return examples::run_program("explore", [&] { return run(argc, argv); });
}

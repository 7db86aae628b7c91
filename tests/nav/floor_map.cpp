// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/nav/floor_map.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "support/catch.hpp"

using namespace orbis;
using nav::floor_state;
using octree::occupancy;
using octree::voxel_key;

namespace {

using map_type = octree::occupancy_octree<>;

/// Boxes of voxels in the middle of a map with voxels of 0.1 m; voxel (0, 0, 0) is at the world's origin.
class world {
 public:
  explicit world(int width = 60, int depth = 40, int height = 30) : size_{width, depth, height} {}

  void fill(std::array<int, 3> low, std::array<int, 3> high, occupancy what) {
    for (int z = low[2]; z < high[2]; ++z)
      for (int y = low[1]; y < high[1]; ++y)
        for (int x = low[0]; x < high[0]; ++x) set(x, y, z, what);
  }
  void set(int x, int y, int z, occupancy what) {
    if (x < 0 || y < 0 || z < 0 || x >= size_[0] || y >= size_[1] || z >= size_[2]) return;
    map_.edit_octant(key(x, y, z), [&](octree::block<float>& b) {
      const auto i = octree::morton_code(key(x, y, z)) & 63U;
      b.known = (b.known & ~(std::uint64_t{1} << i)) | std::uint64_t{what != occupancy::unknown} << i;
      b.value[i] = what == occupancy::occupied ? 1.0F : -1.0F;
    });
  }
  /// A floor whose top is at height 0.3 m, and free space above it.
  void make_room() {
    fill({0, 0, 0}, {size_[0], size_[1], 3}, occupancy::occupied);
    fill({0, 0, 3}, {size_[0], size_[1], size_[2]}, occupancy::free);
  }
  [[nodiscard]] occupancy at(int x, int y, int z) const { return map_.state(key(x, y, z)); }
  [[nodiscard]] const map_type& map() const { return map_; }
  [[nodiscard]] map_type& map() { return map_; }

 private:
  [[nodiscard]] static voxel_key key(int x, int y, int z) {
    const auto along = [](int c) { return static_cast<std::uint32_t>(c + 32768); };
    return {along(x), along(y), along(z)};
  }
  map_type map_{0.1};
  std::array<int, 3> size_;
};

/// The definition, column by column, for voxels of 0.1 m.
class expected_floor {
 public:
  expected_floor(const world& w, std::array<int, 4> area, int floor, const nav::ground_robot& robot, occupancy unknown)
      : w_{w}, area_{area}, unknown_{unknown} {
    clear_ = static_cast<int>(std::ceil(robot.height / 0.1 - 1e-6));
    step_ = static_cast<int>(std::floor(robot.step / 0.1 + 1e-6));
    radius_ = static_cast<int>(std::lround(robot.radius / 0.1));
    steepest_ = std::tan(robot.max_slope);
    std::deque<std::array<int, 3>> waiting;
    std::set<std::array<int, 3>> reached;
    const auto get_to = [&](std::array<int, 3> p) {
      if (is_surface(p) && reached.insert(p).second) waiting.push_back(p);
    };
    for (int y = area[1]; y != area[3]; ++y)
      for (int x = area[0]; x != area[2]; ++x)
        for (int z = floor - step_; z <= floor + step_; ++z) get_to({x, y, z});
    while (!waiting.empty()) {
      const auto [x, y, z] = waiting.front();
      waiting.pop_front();
      const auto [at, is_new] = level_.try_emplace({x, y}, z);
      at->second = std::min(at->second, z);
      for (const auto& [dx, dy] : sides)
        for (int d = -step_; d <= step_; ++d)
          if (is_inside(x + dx, y + dy)) get_to({x + dx, y + dy, z + d});
    }
    floor_ = floor;
  }
  [[nodiscard]] std::optional<int> level(int x, int y) const {
    const auto found = level_.find({x, y});
    return found == level_.end() ? std::nullopt : std::optional{found->second};
  }
  [[nodiscard]] floor_state state(int x, int y) const {
    const floor_state doubt = unknown_ == occupancy::free       ? floor_state::free
                              : unknown_ == occupancy::occupied ? floor_state::occupied
                                                                : floor_state::unknown;
    if (const auto z = level(x, y)) {
      for (const auto& [dx, dy] : sides)
        if (const auto other = level(x + dx, y + dy); other && *other < *z - step_) return floor_state::occupied;
      if (is_steep(x, y, *z)) return floor_state::occupied;
      for (int d = 1; d <= clear_; ++d)
        if (w_.at(x, y, *z + d) == occupancy::unknown) return doubt;
      return floor_state::free;
    }
    const int beside = nearest_level(x, y);
    bool is_hole = true;
    for (int z = beside - step_; z <= beside; ++z) is_hole = is_hole && w_.at(x, y, z) == occupancy::free;
    for (int z = beside + step_ + 1; z <= beside + step_ + clear_; ++z)
      if (w_.at(x, y, z) == occupancy::occupied) return floor_state::occupied;
    return is_hole ? floor_state::occupied : doubt;
  }

 private:
  static constexpr std::array<std::pair<int, int>, 4> sides{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

  [[nodiscard]] bool is_inside(int x, int y) const {
    return x >= area_[0] && y >= area_[1] && x < area_[2] && y < area_[3];
  }
  [[nodiscard]] bool is_surface(const std::array<int, 3>& p) const {
    if (w_.at(p[0], p[1], p[2]) != occupancy::occupied) return false;
    for (int d = 1; d <= clear_; ++d) {
      const occupancy above = w_.at(p[0], p[1], p[2] + d);
      if (above == occupancy::occupied || (above == occupancy::unknown && unknown_ == occupancy::occupied))
        return false;
    }
    return true;
  }
  /// By steps to neighbours; the lowest of the nearest ones is the one that comes with the fewest steps.
  [[nodiscard]] int nearest_level(int x, int y) const {
    std::optional<int> best;
    for (int steps = 1; !best && steps < 200; ++steps)
      for (const auto& [at, z] : level_)
        if (std::abs(at.first - x) + std::abs(at.second - y) == steps) best = std::min(best.value_or(z), z);
    return best.value_or(floor_);
  }
  [[nodiscard]] bool is_steep(int x, int y, int z) const {
    std::vector<std::array<double, 3>> points;
    double low = z, high = z;
    for (int dy = -radius_; dy <= radius_; ++dy)
      for (int dx = -radius_; dx <= radius_; ++dx) {
        const auto other = level(x + dx, y + dy);
        if (!other || std::abs(*other - z) > step_ * std::max(std::abs(dx), std::abs(dy))) continue;
        points.push_back({static_cast<double>(dx), static_cast<double>(dy), static_cast<double>(*other)});
        low = std::min<double>(low, *other), high = std::max<double>(high, *other);
      }
    if (high - low <= step_) return false;
    Eigen::MatrixXd a(static_cast<Eigen::Index>(points.size()), 3);
    Eigen::VectorXd b(a.rows());
    for (Eigen::Index i = 0; i != a.rows(); ++i) {
      const auto& p = points[static_cast<std::size_t>(i)];
      a.row(i) << p[0], p[1], 1.0;
      b[i] = p[2];
    }
    const Eigen::Vector3d plane = a.completeOrthogonalDecomposition().solve(b);
    return std::hypot(plane[0], plane[1]) > steepest_;
  }

  const world& w_;
  std::array<int, 4> area_;
  occupancy unknown_;
  int clear_ = 0, step_ = 0, radius_ = 0, floor_ = 0;
  double steepest_ = 0.0;
  std::map<std::pair<int, int>, int> level_;
};

floor_state state_of(const nav::floor_map& floor, int x, int y) {
  return floor.state(vec2{0.1 * (x + 0.5), 0.1 * (y + 0.5)});
}

}  // namespace

TEST_CASE("A floor with a table, a wall, a threshold, a hole and a ramp") {
  world w{80, 40, 30};
  w.make_room();
  w.fill({10, 10, 9}, {16, 20, 10}, occupancy::occupied);  // a table top 0.6 m above the floor
  w.fill({20, 10, 6}, {26, 20, 7}, occupancy::occupied);   // a bench, 0.3 m
  w.fill({30, 0, 3}, {31, 30, 20}, occupancy::occupied);   // a wall with a gap
  w.fill({35, 0, 3}, {36, 40, 4}, occupancy::occupied);    // a threshold of 0.1 m
  w.fill({40, 10, 0}, {44, 14, 3}, occupancy::free);       // a hole
  w.fill({40, 20, 0}, {44, 24, 30}, occupancy::unknown);   // nothing known
  w.fill({46, 30, 5}, {50, 34, 30}, occupancy::unknown);   // the floor is known, not all above it
  for (int x = 52; x != 72; ++x)                           // a ramp of 1 : 5, and a platform of 0.4 m at its end
    w.fill({x, 5, 3}, {x + 1, 15, 3 + std::min((x - 52) / 5 + 1, 4)}, occupancy::occupied);
  const nav::ground_robot robot{.radius = 0.2, .height = 0.5, .step = 0.1, .max_slope = 0.4};

  REQUIRE(nav::find_floor(w.map()).has_value());
  CHECK(*nav::find_floor(w.map()) == Approx(0.3));
  const auto floor = nav::make_floor_map(w.map(), robot);
  REQUIRE(floor.has_value());
  CHECK(floor->resolution == 0.1);
  CHECK(floor->origin.isApprox(vec2::Zero(), 1e-12));
  CHECK(floor->states.width() == 80);
  CHECK(floor->states.height() == 40);
  const auto at = [&](int x, int y) { return state_of(*floor, x, y); };
  CHECK(at(5, 5) == floor_state::free);
  CHECK(at(12, 15) == floor_state::free);  // under the table
  CHECK(at(22, 15) == floor_state::occupied);
  CHECK(at(30, 15) == floor_state::occupied);
  CHECK(at(30, 35) == floor_state::free);
  CHECK(at(35, 20) == floor_state::free);
  CHECK(at(42, 12) == floor_state::occupied);
  CHECK(at(42, 22) == floor_state::unknown);
  CHECK(at(48, 32) == floor_state::unknown);
  CHECK(at(60, 10) == floor_state::free);
  CHECK(at(70, 10) == floor_state::free);
  CHECK(floor->heights(70, 10) == Approx(0.7));
  CHECK(at(70, 5) == floor_state::occupied);  // the platform's edge
  CHECK(at(70, 4) == floor_state::free);      // beneath it
  CHECK(std::isnan(floor->heights(30, 15)));
  CHECK(at(-1, 5) == floor_state::unknown);
  CHECK(at(80, 5) == floor_state::unknown);

  const auto after = [&](const nav::ground_robot& r, const nav::floor_map_options& options, int x, int y) {
    return state_of(nav::make_floor_map(w.map(), r, options).value(), x, y);
  };
  nav::ground_robot other = robot;
  other.height = 0.7;  // too high for the table
  CHECK(after(other, {}, 12, 15) == floor_state::occupied);
  other = robot;
  other.height = 0.3;
  CHECK(after(other, {}, 22, 15) == floor_state::free);
  other = robot;
  other.step = 0.05;
  CHECK(after(other, {}, 35, 20) == floor_state::occupied);
  other = robot;
  other.radius = 0.6;
  CHECK(after(other, {}, 60, 10) == floor_state::free);
  other.max_slope = 0.1;
  CHECK(after(other, {}, 60, 10) == floor_state::occupied);
  CHECK(after(robot, {.unknown = occupancy::free}, 42, 22) == floor_state::free);
  CHECK(after(robot, {.unknown = occupancy::free}, 48, 32) == floor_state::free);
  CHECK(after(robot, {.unknown = occupancy::occupied}, 42, 22) == floor_state::occupied);
  CHECK(after(robot, {.unknown = occupancy::occupied}, 48, 32) == floor_state::occupied);
}

TEST_CASE("A floor map is what its definition says, column by column") {
  const occupancy unknown = GENERATE(occupancy::unknown, occupancy::free, occupancy::occupied);
  std::array<std::size_t, 3> seen{};
  for (std::uint64_t seed = 0; seed != 12; ++seed) {
    random_bits random{seed};
    const auto below = [&](int n) { return static_cast<int>(random.below(static_cast<std::uint32_t>(n))); };
    world w{28, 24, 24};
    w.make_room();
    for (int i = 0; i != 30; ++i) {  // boxes that stand, hang, are missing or unknown
      const std::array<int, 3> low{below(28), below(24), below(4) == 0 ? below(20) : below(4)};
      const std::array<int, 3> high{low[0] + 1 + below(8), low[1] + 1 + below(8), low[2] + 1 + below(3)};
      const int what = below(6);
      w.fill(low, high, what == 0 ? occupancy::unknown : what == 1 ? occupancy::free : occupancy::occupied);
    }
    if (seed % 3 == 0) w.map().prune();
    const nav::ground_robot robot{.radius = 0.1 * (1 + below(3)),
                                  .height = 0.1 * (1 + below(6)),
                                  .step = 0.1 * below(3),
                                  .max_slope = 0.05 + 0.2 * below(5)};
    const auto floor = nav::make_floor_map(w.map(), robot, {.floor = 0.3, .unknown = unknown});
    REQUIRE(floor.has_value());
    const expected_floor expected{w, {0, 0, 28, 24}, 2, robot, unknown};
    std::string wrong;
    for (int y = 0; y != floor->states.height(); ++y)
      for (int x = 0; x != floor->states.width(); ++x) {
        const floor_state state = floor->states(x, y);
        ++seen[static_cast<std::size_t>(state)];
        const auto level = expected.level(x, y);
        const float height = floor->heights(x, y);
        if (state != expected.state(x, y) || std::isnan(height) != !level ||
            (level && std::abs(height - 0.1F * static_cast<float>(*level + 1)) > 1e-5F))
          wrong += std::to_string(x) + " " + std::to_string(y) + "; ";
      }
    CAPTURE(seed);
    CHECK(wrong == "");
  }
  CHECK(seen[static_cast<std::size_t>(floor_state::free)] > 1000);
  CHECK(seen[static_cast<std::size_t>(floor_state::occupied)] > 1000);
  CHECK((seen[static_cast<std::size_t>(floor_state::unknown)] > 100) == (unknown == occupancy::unknown));
}

TEST_CASE("The floor is the lowest of the large layers") {
  world w{40, 40, 28};
  CHECK_FALSE(nav::find_floor(w.map()).has_value());
  CHECK(nav::make_floor_map(w.map()).error().code == errc::no_data);
  w.make_room();
  w.fill({0, 0, 10}, {30, 40, 12}, occupancy::occupied);  // a gallery, 3/4 of the floor
  CHECK(*nav::find_floor(w.map()) == Approx(0.3));
  w.fill({0, 0, 24}, {40, 40, 28}, occupancy::occupied);  // a ceiling, nothing known above it
  CHECK(*nav::find_floor(w.map()) == Approx(0.3));
  w.fill({0, 0, 0}, {40, 30, 3}, occupancy::unknown);  // a quarter of the floor is left
  CHECK(*nav::find_floor(w.map()) == Approx(1.2));
  w.map().prune();
  CHECK(*nav::find_floor(w.map()) == Approx(1.2));
}

TEST_CASE("A region of a floor map, and what cannot be had") {
  world w{40, 40, 16};
  w.make_room();
  const octree::bounding_box region{vec3{0.9, 1.7, 0.0}, vec3{2.0, 2.4, 0.0}};
  const auto part = nav::make_floor_map(w.map(), {}, {.region = region});
  REQUIRE(part.has_value());
  CHECK(part->states.width() == 16);  // octants
  CHECK(part->states.height() == 12);
  CHECK(part->origin.isApprox(vec2{0.8, 1.6}, 1e-12));
  CHECK(part->cell(vec2{0.85, 1.65}) == std::array{0, 0});
  CHECK(part->center(1, 2).isApprox(vec2{0.95, 1.85}, 1e-12));
  CHECK(nav::make_floor_map(w.map(), {}, {.region = octree::bounding_box{vec3::Constant(8), vec3::Constant(9)}})
            .error()
            .code == errc::no_data);
  CHECK(nav::make_floor_map(w.map(), {}, {.floor = 50.0}).error().code == errc::no_data);
  CHECK(nav::make_floor_map(w.map(), {}, {.floor = 1e9}).error().code == errc::no_data);
  w.map().set_unknown_node({0, 0, 0}, 2, -0.5F);  // 16384 voxels wide
  w.map().set_unknown_node({32768 + 16384, 32768, 32768}, 2, -0.5F);
  CHECK(nav::make_floor_map(w.map(), {}, {.floor = 0.3}).error().code == errc::invalid_argument);
  CHECK(nav::make_floor_map(w.map(), {}, {.floor = 0.3, .region = region}).has_value());
  // Heights of a region mean nothing, and it has to be one.
  const octree::bounding_box elsewhere{vec3{0.9, 1.7, 1e6}, vec3{2.0, 2.4, -1e6}};
  const auto same = nav::make_floor_map(w.map(), {}, {.region = elsewhere});
  REQUIRE(same.has_value());
  CHECK(same->states == part->states);
  const octree::bounding_box inverted{vec3{2.0, 1.7, 0.0}, vec3{0.9, 2.4, 0.0}};
  CHECK(nav::make_floor_map(w.map(), {}, {.region = inverted}).error().code == errc::invalid_argument);
  // No limits are limits, too.
  constexpr double inf = std::numeric_limits<double>::infinity();
  const auto open = nav::make_floor_map(w.map(), {}, {.above = inf, .region = region});
  CHECK((open.has_value() || open.error().code == errc::invalid_argument));
  CHECK(nav::make_floor_map(w.map(), {.radius = 0.2, .height = 1e9}, {.region = region}).has_value());
}

TEST_CASE("Very large leaves cost what is near the floor, or too much") {
  // A floor of 64 x 64 voxels in and above leaves of 1024 and more.
  world w{64, 64, 3};
  w.fill({0, 0, 0}, {64, 64, 3}, occupancy::occupied);
  map_type& map = w.map();
  for (const std::uint32_t x : {0U, 1U})
    for (const std::uint32_t y : {0U, 1U})
      for (std::uint32_t z = 0; z != 2; ++z)
        if (z == 1 || x == 0 || y == 0)
          map.set_unknown_node(
              {32768 - 1024 + 1024 * x - 1024, 32768 - 1024 + 1024 * y - 1024, 32768 + 1024 * z - 1024}, 6,
              z == 0 ? 0.5F : -0.5F);
  CHECK(*nav::find_floor(map) == Approx(0.0));
  const auto floor = nav::make_floor_map(map, {}, {.floor = 0.0});
  REQUIRE(floor.has_value());
  CHECK(floor->states.width() == 2048 + 64);
  CHECK(floor->state(vec2{-20.0, -150.0}) == floor_state::free);
  CHECK(floor->heights((*floor->cell(vec2{-20.0, -150.0}))[0], (*floor->cell(vec2{-20.0, -150.0}))[1]) == 0.0F);
  // As high as the leaves are, there are too many words; a region has few.
  constexpr double inf = std::numeric_limits<double>::infinity();
  const nav::floor_map_options high{.floor = 0.0, .below = inf, .above = inf};
  CHECK(nav::make_floor_map(map, {}, high).error().code == errc::invalid_argument);
  nav::floor_map_options part = high;
  part.region = octree::bounding_box{vec3{-60.0, -160.0, 0.0}, vec3{-10.0, -110.0, 0.0}};
  const auto some = nav::make_floor_map(map, {}, part);
  REQUIRE(some.has_value());
  CHECK(some->state(vec2{-20.0, -150.0}) == floor_state::free);
  // All of the grid.
  map_type whole{0.1};
  whole.set_unknown_node({0, 0, 0}, 1, 0.5F);
  whole.set_unknown_node({0, 0, 32768}, 1, -0.5F);
  CHECK_FALSE(nav::find_floor(whole).has_value());
  CHECK(nav::make_floor_map(whole, {}, {.floor = 0.0}).error().code == errc::invalid_argument);
}

// SPDX-License-Identifier: BSD-3-Clause
//
// Paths and collision checks of a ball with a radius of 0.2 m in the known free space of a recording's map, beside OMPL
// (RRTConnect's first solution; RRT* and BIT* after a second) and FCL. OMPL's planners run with our checkers
// (interop/ompl.hpp) and with FCL's, which is asked about states half a voxel apart; for it unknown space around the
// map is filled with obstacles beforehand. Lengths are over those of our own paths between the same places, of which
// all are found. Times are CPU time.
#if defined(ORBIS_BENCH_WITH_OMPL) && defined(ORBIS_BENCH_WITH_FCL)
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#ifdef ORBIS_BENCH_WITH_DYNAMIC_EDT
#include <dynamicEDT3D/dynamicEDT3D.h>
#endif
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/base/ScopedState.h>
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/geometric/planners/rrt/RRTstar.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <orbis/core/random.hpp>
#include <orbis/interop/fcl.hpp>
#include <orbis/interop/ompl.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_view.hpp>

#include "octree/insertion.hpp"
#include "octree/peers.hpp"

namespace orbis::bench {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

constexpr double radius = 0.2, resolution = 0.05;

/// A map, and what the rows have in common.
struct world {
  map known;
  nav::distance_field field;
  nav::planning_view<map> view{known, field, radius};
  octree::bounding_box box = known.bounds().value();
  std::shared_ptr<fcl::OcTreed> tree;  ///< unknown space around is an obstacle
  struct query {
    vec3 from, to;
    double length;  ///< of our path
  };
  std::vector<query> queries;
  std::vector<vec3> places;  ///< anywhere in the box

  explicit world(map m) : known{std::move(m)}, field{known, {.reach = 1.0}} {
    map filled = known;
    const vec3 margin = vec3::Constant(radius + 4 * resolution);
    const octree::key_box keys = octree::keys_between(known.grid(), box.min - margin, box.max + margin).value();
    const auto down = [](std::uint32_t k) { return k & ~3U; };
    for (std::uint32_t z = down(keys.low.z); z <= keys.high.z; z += 4)
      for (std::uint32_t y = down(keys.low.y); y <= keys.high.y; y += 4)
        for (std::uint32_t x = down(keys.low.x); x <= keys.high.x; x += 4)
          filled.edit_octant({x, y, z}, [](octree::block<float>& b) {
            for (std::size_t i = 0; i != 64; ++i)
              if ((b.known >> i & 1U) == 0) b.value[i] = 1.0F;
            b.known = ~std::uint64_t{0};
          });
    filled.prune();
    tree = interop::to_fcl(filled);
    random_bits random{1};
    const auto place = [&] {
      vec3 p;
      for (int i = 0; i != 3; ++i) p[i] = box.min[i] + random.uniform() * (box.max[i] - box.min[i]);
      return p;
    };
    for (int i = 0; i != 1000; ++i) places.push_back(place());
    const auto free_place = [&] {
      vec3 p = place();
      while (!view.is_free(p)) p = place();
      return p;
    };
    while (queries.size() != 20) {
      const vec3 a = free_place(), b = free_place();
      const nav::found_path path = nav::find_path(view, a, b);
      if (path.status == nav::path_status::found && path.expanded != 0) queries.push_back({a, b, path.length});
    }
  }
  world(const world&) = delete;
  world& operator=(const world&) = delete;

  [[nodiscard]] bool is_free_for_fcl(const vec3& p) const {
    static const fcl::Sphered ball{radius};
    fcl::Transform3d pose = fcl::Transform3d::Identity();
    pose.translation() = p;
    fcl::CollisionResultd result;
    return fcl::collide(tree.get(), fcl::Transform3d::Identity(), &ball, pose, fcl::CollisionRequestd{}, result) == 0;
  }
};

/// Made once for all rows of a recording.
using worlds = std::function<const world&()>;
worlds world_of(const std::vector<scan>& (*scans)()) {
  return [scans, made = std::make_shared<std::unique_ptr<world>>()]() -> const world& {
    if (!*made) {
      map m{resolution};
      for (const scan& s : scans()) m.integrate(s.depth_metres(), s.camera, s.T_world_camera, {.max_range = 5.0});
      *made = std::make_unique<world>(std::move(m));
    }
    return **made;
  };
}

// -- paths

void bench_orbis(benchmark::State& state, const world& w) {
  for (auto _ : state) {
    std::vector<double> seconds;
    for (const world::query& q : w.queries) {
      const std::clock_t start = std::clock();
      benchmark::DoNotOptimize(nav::find_path(w.view, q.from, q.to).length);
      seconds.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    state.counters["found"] = 1.0;
    state.counters["length"] = 1.0;
    report_frames(state, std::move(seconds));
  }
}

class fcl_checker : public ob::StateValidityChecker {
 public:
  fcl_checker(const ob::SpaceInformationPtr& information, const world& w)
      : StateValidityChecker{information}, position_{*information->getStateSpace()}, world_{w} {}
  [[nodiscard]] bool isValid(const ob::State* state) const override { return world_.is_free_for_fcl(position_(state)); }

 private:
  interop::ompl_position position_;
  const world& world_;
};

/// `limit`: seconds for each query, of which only the first `queries` are asked.
template <class Planner>
void bench_ompl(benchmark::State& state, const world& w, bool with_fcl, double limit, std::size_t queries) {
  ompl::msg::noOutputHandler();
  const auto space = std::make_shared<ob::RealVectorStateSpace>(3);
  ob::RealVectorBounds bounds{3};
  for (unsigned i = 0; i != 3; ++i) {
    bounds.setLow(i, w.box.min[static_cast<int>(i)]);
    bounds.setHigh(i, w.box.max[static_cast<int>(i)]);
  }
  space->setBounds(bounds);
  const auto information = std::make_shared<ob::SpaceInformation>(space);
  if (with_fcl) {
    information->setStateValidityChecker(std::make_shared<fcl_checker>(information, w));
    information->setStateValidityCheckingResolution(0.5 * resolution / space->getMaximumExtent());
  } else {
    interop::use_planning_space(information, w.view);
  }
  information->setup();
  for (auto _ : state) {
    std::vector<double> seconds;
    double found = 0.0, length = 0.0;
    for (std::size_t i = 0; i != queries; ++i) {
      const world::query& q = w.queries[i];
      const auto problem = std::make_shared<ob::ProblemDefinition>(information);
      ob::ScopedState<> from{space}, to{space};
      for (unsigned axis = 0; axis != 3; ++axis) {
        from[axis] = q.from[static_cast<int>(axis)];
        to[axis] = q.to[static_cast<int>(axis)];
      }
      problem->setStartAndGoalStates(from, to);
      problem->setOptimizationObjective(std::make_shared<ob::PathLengthOptimizationObjective>(information));
      Planner planner{information};
      planner.setProblemDefinition(problem);
      planner.setup();
      const std::clock_t start = std::clock();
      const auto passed = [&] { return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC; };
      const ob::PlannerTerminationCondition late{[&] { return passed() > limit; }};
      const bool is_found = planner.solve(late) == ob::PlannerStatus::EXACT_SOLUTION;
      seconds.push_back(passed());
      if (!is_found) continue;
      found += 1.0;
      length += problem->getSolutionPath()->length() / q.length;
    }
    state.counters["found"] = found / static_cast<double>(queries);
    state.counters["length"] = length / std::max(1.0, found);
    report_frames(state, std::move(seconds));
  }
}

// -- checks

/// `is_free`: of a place. All places in each iteration; "us" is the time of one.
template <class IsFree>
void bench_checks(benchmark::State& state, const world& w, const IsFree& is_free) {
  std::size_t free = 0;
  double all = 0.0, seconds = 0.0;
  for (auto _ : state) {
    const std::clock_t start = std::clock();
    for (const vec3& p : w.places) free += is_free(p) ? 1U : 0U;
    seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    all += static_cast<double>(w.places.size());
  }
  state.counters["us"] = 1e6 * seconds / all;
  state.counters["free_percent"] = 100.0 * static_cast<double>(free) / all;
}
void bench_check_view(benchmark::State& state, const world& w) {
  bench_checks(state, w, [&](const vec3& p) { return w.view.is_free(p); });
}
void bench_check_overlaps(benchmark::State& state, const world& w) {
  bench_checks(state, w, [&](const vec3& p) {
    return !octree::overlaps(w.known, octree::sphere{p, radius}, {.unknown = octree::occupancy::occupied});
  });
}
void bench_check_field(benchmark::State& state, const world& w) {
  bench_checks(state, w, [&](const vec3& p) { return w.field.distance(p) > radius; });
}
void bench_check_fcl(benchmark::State& state, const world& w) {
  bench_checks(state, w, [&](const vec3& p) { return w.is_free_for_fcl(p); });
}
#ifdef ORBIS_BENCH_WITH_DYNAMIC_EDT
void bench_check_dynamic_edt(benchmark::State& state, const world& w) {
  const octree::key_box box = octree::keys_between(w.known.grid(), w.box.min, w.box.max).value();
  const auto along = [](std::uint32_t a, std::uint32_t b) { return static_cast<int>(b - a); };
  DynamicEDT3D theirs{400};
  theirs.initializeEmpty(along(box.low.x, box.high.x) + 1, along(box.low.y, box.high.y) + 1,
                         along(box.low.z, box.high.z) + 1);
  for (std::uint32_t z = box.low.z; z <= box.high.z; ++z)
    for (std::uint32_t y = box.low.y; y <= box.high.y; ++y)
      for (std::uint32_t x = box.low.x; x <= box.high.x; ++x)
        if (w.known.state(octree::voxel_key{x, y, z}) != octree::occupancy::free)
          theirs.occupyCell(along(box.low.x, x), along(box.low.y, y), along(box.low.z, z));
  theirs.update(true);
  bench_checks(state, w, [&](const vec3& p) {
    const octree::voxel_key k = *w.known.grid().key(p);
    const float d = theirs.getDistance(along(box.low.x, k.x), along(box.low.y, k.y), along(box.low.z, k.z));
    return d * resolution > radius;
  });
}
#endif

[[maybe_unused]] const bool registered = [] {
  const auto add = [](const std::string& name, const std::vector<scan>& (*scans)()) {
    const worlds get = world_of(scans);
    const auto plan = [&](const std::string& row, auto body) {
      timed_by_itself(add_row("nav_ompl/" + name + "/" + row, [=](auto& s) { body(s, get()); }), 1);
    };
    const auto check = [&](const std::string& row, auto body) {
      add_row("nav_check/" + name + "/" + row, [=](auto& s) { body(s, get()); });
    };
    plan("first/orbis", bench_orbis);
    for (const bool with_fcl : {false, true}) {
      const std::string on = with_fcl ? "_on_fcl" : "_on_orbis";
      plan("first/rrt_connect" + on,
           [=](auto& s, const world& w) { bench_ompl<og::RRTConnect>(s, w, with_fcl, 5.0, w.queries.size()); });
      plan("after_1_s/bit_star" + on,
           [=](auto& s, const world& w) { bench_ompl<og::BITstar>(s, w, with_fcl, 1.0, 5); });
      plan("after_1_s/rrt_star" + on,
           [=](auto& s, const world& w) { bench_ompl<og::RRTstar>(s, w, with_fcl, 1.0, 5); });
    }
    check("state/orbis", bench_check_view);
    check("state/orbis_overlaps", bench_check_overlaps);
    check("state/fcl", bench_check_fcl);
    check("look_up/orbis", bench_check_field);
#ifdef ORBIS_BENCH_WITH_DYNAMIC_EDT
    check("look_up/dynamic_edt_3d", bench_check_dynamic_edt);
#endif
  };
  add("room", room);
  if (have_kitchen()) add("kitchen", kitchen);
  return true;
}();

}  // namespace
}  // namespace orbis::bench
#endif

// SPDX-License-Identifier: BSD-3-Clause
//
// Where OMPL is installed.
#ifdef ORBIS_TEST_WITH_OMPL
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include <ompl/base/ScopedState.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/goals/GoalState.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/base/spaces/SE3StateSpace.h>
#include <ompl/base/terminationconditions/IterationTerminationCondition.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/PathSimplifier.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <orbis/core/random.hpp>
#include <orbis/interop/ompl.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/overlap.hpp>

#include "support/catch.hpp"

using namespace orbis;
using octree::occupancy;
namespace ob = ompl::base;
namespace og = ompl::geometric;

namespace {

using map_type = octree::occupancy_octree<>;

/// A room of 4 x 4 x 2 m of known free space, and a wall across it (x = 0) with a gap in a corner.
map_type make_room() {
  map_type map{0.1};
  for (std::uint32_t z = 0; z != 20; z += 4)
    for (std::uint32_t y = 0; y != 40; y += 4)
      for (std::uint32_t x = 0; x != 40; x += 4)
        map.edit_octant({32748 + x, 32748 + y, 32758 + z - 2}, [&](octree::block<float>& b) {
          b.known = ~std::uint64_t{0};
          const bool is_wall = x == 20 && !(y >= 32 && z >= 12);
          b.value.fill(is_wall ? 0.5F : -0.5F);
        });
  return map;
}

struct scene {
  map_type map = make_room();
  nav::distance_field field{map, {.reach = 1.0}};
  nav::planning_view<map_type> view{map, field, 0.15};
};

ob::StateSpacePtr make_space(bool has_rotation) {
  ob::RealVectorBounds bounds{3};
  for (const unsigned i : {0U, 1U, 2U}) {
    bounds.setLow(i, i == 2 ? -1.2 : -2.0);
    bounds.setHigh(i, i == 2 ? 0.8 : 2.0);
  }
  if (has_rotation) {
    const auto space = std::make_shared<ob::SE3StateSpace>();
    space->setBounds(bounds);
    return space;
  }
  const auto space = std::make_shared<ob::RealVectorStateSpace>(3);
  space->setBounds(bounds);
  return space;
}
ob::ScopedState<> state_at(const ob::StateSpacePtr& space, const vec3& p) {
  ob::ScopedState<> state{space};
  state.random();  // the rotation
  for (unsigned i = 0; i != 3; ++i) state[i] = p[static_cast<int>(i)];
  return state;
}
vec3 random_place(random_bits& random) {
  const auto along = [&](double half) { return half * (2.0 * random.uniform() - 1.0); };
  return {along(2.2), along(2.2), along(1.1)};
}

}  // namespace

TEST_CASE("OMPL's states and motions are judged by exact overlaps") {
  ompl::msg::noOutputHandler();
  const scene s;
  const ob::StateSpacePtr space = make_space(GENERATE(false, true));
  const auto information = std::make_shared<ob::SpaceInformation>(space);
  interop::use_planning_space(information, s.view);
  information->setup();
  const auto& checker = information->getStateValidityChecker();
  CHECK(checker->getSpecs().clearanceComputationType == ob::StateValidityCheckerSpecs::BOUNDED_APPROXIMATE);
  const auto is_free = [&](const vec3& a, const vec3& b, double radius) {
    return !overlaps(s.map, octree::capsule{a, b, radius}, {.unknown = occupancy::occupied});
  };
  random_bits random{3};
  std::size_t valid = 0, cut = 0;
  for (int i = 0; i != 1000; ++i) {
    const vec3 a = random_place(random), b = random_place(random);
    const ob::ScopedState<> from = state_at(space, a), to = state_at(space, b);
    const bool is_valid = information->isValid(from.get());
    CHECK(is_valid == is_free(a, a, 0.15));
    const double clearance = checker->clearance(from.get());
    CHECK(clearance >= 0.0);
    if (!is_valid) {
      CHECK(clearance == 0.0);
      continue;
    }
    ++valid;
    CHECK(is_free(a, a, 0.15 + clearance - 1e-9));
    const auto& motions = information->getMotionValidator();
    const unsigned asked = motions->getCheckedMotionCount();
    const bool is_way_free = information->checkMotion(from.get(), to.get());
    CHECK(is_way_free == is_free(a, b, 0.15));
    ob::ScopedState<> last{space};
    std::pair<ob::State*, double> last_valid{last.get(), -1.0};
    CHECK(information->checkMotion(from.get(), to.get(), last_valid) == is_way_free);
    CHECK(motions->getCheckedMotionCount() == asked + 2);
    if (is_way_free) {
      CHECK(last_valid.second == -1.0);
      continue;
    }
    ++cut;
    const vec3 at{last[0], last[1], last[2]};
    REQUIRE((last_valid.second >= 0.0 && last_valid.second < 1.0));
    CHECK((a + last_valid.second * (b - a) - at).norm() < 1e-12);
    CHECK(is_free(a, at, 0.15 - 1e-9));
    CHECK_FALSE(is_free(a, at + 0.001 * (b - a).normalized(), 0.15 + 1e-9));
    last_valid.first = nullptr;
    CHECK_FALSE(information->checkMotion(from.get(), to.get(), last_valid));
  }
  CHECK(valid > 300);
  CHECK(cut > 100);
}

TEST_CASE("RRTConnect finds a way through a gap, and each of its segments is free") {
  ompl::msg::noOutputHandler();
  ompl::RNG::setSeed(5);
  const scene s;
  const ob::StateSpacePtr space = make_space(GENERATE(false, true));
  const auto information = std::make_shared<ob::SpaceInformation>(space);
  interop::use_planning_space(information, s.view);
  information->setup();
  const auto problem = std::make_shared<ob::ProblemDefinition>(information);
  const vec3 start{-1.5, -1.5, -0.5}, goal{1.5, -1.0, 0.0};
  problem->setStartAndGoalStates(state_at(space, start), state_at(space, goal));
  CHECK_FALSE(s.view.is_free(start, goal));
  og::RRTConnect planner{information};
  planner.setProblemDefinition(problem);
  planner.setup();
  ob::IterationTerminationCondition enough{200'000};
  REQUIRE(planner.solve(enough) == ob::PlannerStatus::EXACT_SOLUTION);
  og::PathGeometric path = *problem->getSolutionPath()->as<og::PathGeometric>();
  const auto check = [&] {
    const auto at = [&](std::size_t i) {
      const ob::ScopedState<> state{space, path.getState(static_cast<unsigned>(i))};
      return vec3{state[0], state[1], state[2]};
    };
    REQUIRE(path.getStateCount() > 2);
    CHECK(at(0) == start);
    CHECK(at(path.getStateCount() - 1) == goal);
    for (std::size_t i = 1; i != path.getStateCount(); ++i)
      CHECK_FALSE(overlaps(s.map, octree::capsule{at(i - 1), at(i), 0.15 - 1e-9}, {.unknown = occupancy::occupied}));
  };
  check();
  og::PathSimplifier{information}.reduceVertices(path);
  check();
}
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// OMPL planners on orbis maps: a planning space of `nav` checks states and motions exactly.
///
/// @code
///   const auto space = std::make_shared<ompl::base::RealVectorStateSpace>(3);   // or SE3StateSpace
///   ...                                                                         // its bounds
///   const auto information = std::make_shared<ompl::base::SpaceInformation>(space);
///   orbis::interop::use_planning_space(information, orbis::nav::planning_view{map, field, 0.2});
///   information->setup();
/// @endcode
///
/// I. A. Sucan, M. Moll, L. E. Kavraki, "The Open Motion Planning Library", IEEE Robotics & Automation Magazine 19(4),
/// 2012.
#pragma once

#include <algorithm>
#include <cassert>
#include <concepts>
#include <memory>
#include <utility>

#include <ompl/base/MotionValidator.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/State.h>
#include <ompl/base/StateSpace.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>

#include <orbis/core/types.hpp>
#include <orbis/nav/planning_space.hpp>
#include <orbis/nav/robot_shape.hpp>

namespace orbis::interop {

/// Position of a state in metres: the values of a two- or three-dimensional `RealVectorStateSpace`, or of the first
/// part of a compound space (`SE2StateSpace`, `SE3StateSpace`) if that part is a `RealVectorStateSpace`. The rest of
/// the state is ignored, because rotation about the vertical axis does not change the robot's shape.
class ompl_position {
 public:
  /// @pre the space has one of the types above
  explicit ompl_position(const ompl::base::StateSpace& space) : is_compound_{space.isCompound()} {
    const ompl::base::StateSpace* const part =
        is_compound_ ? space.as<ompl::base::CompoundStateSpace>()->getSubspace(0).get() : &space;
    dimensions_ = part->getDimension();
    assert(part->getType() == ompl::base::STATE_SPACE_REAL_VECTOR && (dimensions_ == 2 || dimensions_ == 3));
  }
  [[nodiscard]] vec3 operator()(const ompl::base::State* state) const noexcept {
    using point = ompl::base::RealVectorStateSpace::StateType;
    const double* const v =
        is_compound_ ? state->as<ompl::base::CompoundState>()->as<point>(0)->values : state->as<point>()->values;
    return {v[0], v[1], dimensions_ == 3 ? v[2] : 0.0};
  }

 private:
  bool is_compound_;
  unsigned dimensions_ = 3;
};

/// Checks whether the robot is free in a state. Safe for concurrent use.
template <nav::planning_space Space>
class ompl_validity_checker : public ompl::base::StateValidityChecker {
 public:
  /// Objects that the space refers to must outlive the checker and not change. @pre same as for ompl_position
  ompl_validity_checker(const ompl::base::SpaceInformationPtr& information, const Space& space)
      : StateValidityChecker{information}, position_{*information->getStateSpace()}, space_{space} {
    if constexpr (is_ball) specs_.clearanceComputationType = ompl::base::StateValidityCheckerSpecs::BOUNDED_APPROXIMATE;
  }
  using StateValidityChecker::clearance;
  using StateValidityChecker::isValid;

  [[nodiscard]] bool isValid(const ompl::base::State* state) const override { return space_.is_free(position_(state)); }
  /// For a ball in a 3D space: a lower bound on the distance to the nearest obstacle, metres. It underestimates the
  /// distance by less than two voxels, is at most the field's reach, and is 0 if the ball may touch an obstacle. For
  /// other robots: 0. O(1).
  [[nodiscard]] double clearance(const ompl::base::State* state) const override {
    if constexpr (is_ball)
      return std::max(0.0, space_.field().clearance(position_(state)) - space_.radius());
    else
      return 0.0;
  }

 private:
  static constexpr bool is_ball = requires(const Space& s, const vec3& p) {
    { s.shape() } -> std::same_as<const nav::ball&>;
    { s.field().clearance(p) } -> std::convertible_to<double>;
  };

  ompl_position position_;
  Space space_;
};

/// Checks whether the robot is free on the straight segment from one state to another, in continuous space rather than
/// at samples. Safe for concurrent use, but OMPL's motion counters are then approximate, as with OMPL's own validator.
template <nav::planning_space Space>
class ompl_motion_validator : public ompl::base::MotionValidator {
 public:
  /// Objects that the space refers to must outlive the validator and not change. @pre same as for ompl_position; the
  /// state space interpolates positions linearly
  ompl_motion_validator(const ompl::base::SpaceInformationPtr& information, const Space& space)
      : MotionValidator{information}, position_{*information->getStateSpace()}, space_{space} {}

  [[nodiscard]] bool checkMotion(const ompl::base::State* a, const ompl::base::State* b) const override {
    const bool is_free = space_.is_free(position_(a), position_(b));
    ++(is_free ? valid_ : invalid_);
    return is_free;
  }
  /// The last valid state is at most a hundredth of a voxel before the first contact, and the segment up to it is free.
  [[nodiscard]] bool checkMotion(const ompl::base::State* a, const ompl::base::State* b,
                                 std::pair<ompl::base::State*, double>& last_valid) const override {
    if (checkMotion(a, b)) return true;
    const vec3 from = position_(a), way = position_(b) - from;
    double free = 0.0, blocked = 1.0;
    for (const double near = 0.01 * space_.resolution(); (blocked - free) * way.norm() > near;) {
      const double middle = 0.5 * (free + blocked);
      (space_.is_free(from, vec3{from + middle * way}) ? free : blocked) = middle;
    }
    last_valid.second = free;
    if (last_valid.first != nullptr) si_->getStateSpace()->interpolate(a, b, free, last_valid.first);
    return false;
  }

 private:
  ompl_position position_;
  Space space_;
};

/// Makes `information` check states and motions with `space`. Call it before `setup()`.
/// @pre same as for ompl_motion_validator
template <nav::planning_space Space>
void use_planning_space(const ompl::base::SpaceInformationPtr& information, const Space& space) {
  information->setStateValidityChecker(std::make_shared<ompl_validity_checker<Space>>(information, space));
  information->setMotionValidator(std::make_shared<ompl_motion_validator<Space>>(information, space));
}

}  // namespace orbis::interop

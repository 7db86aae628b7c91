// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A ray traversal that crosses whole nodes in one step.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>

namespace orbis::octree::detail {

/// Takes the same steps as `ray_traversal`, but can cross a whole node at once. The parameters of the next steps along
/// each axis are precomputed in the same order of summation, so that the number of steps up to a node's face is found
/// by a look-up instead of by stepping.
template <class = void>
class basic_skipping_traversal {
 public:
  explicit basic_skipping_traversal(const ray_traversal& c) noexcept
      : at_{c.at}, step_{c.step}, delta_{c.delta}, cells_{c.cells} {
    for (std::size_t i = 0; i != 3; ++i) per_step_[i] = step_[i] == 0 ? 0.0 : 1.0 / delta_[i];
    sum_up(c.next[0], c.next[1], c.next[2]);
  }

  [[nodiscard]] voxel_key key() const noexcept { return {at_[0], at_[1], at_[2]}; }
  [[nodiscard]] bool is_outside() const noexcept { return (at_[0] | at_[1] | at_[2]) >= cells_; }
  /// Reverts the last step, along `axis`.
  void step_back(std::size_t axis) noexcept { at_[axis] -= static_cast<std::uint32_t>(step_[axis]); }

  struct crossing {
    std::size_t axis;
    double parameter;  ///< ray parameter at the face
  };
  /// Takes one step.
  crossing step() noexcept {
    const crossing face = first(ahead_[0][used_[0]], ahead_[1][used_[1]], ahead_[2][used_[2]]);
    at_[face.axis] += static_cast<std::uint32_t>(step_[face.axis]);
    if (++used_[face.axis] == count - 1) renew();
    return face;
  }
  /// Exit of the ray from the current node with edge `cells`.
  struct node_exit {
    crossing face;
    std::array<std::uint32_t, 3> steps;  ///< for each axis, number of steps along it that leave the node
  };
  /// Finds the exit from the current node. @pre cells is a power of two, at most 32
  [[nodiscard]] node_exit find_node_exit(std::uint32_t cells) noexcept {
    node_exit way{};
    const auto steps_along = [&](std::size_t i) {
      const std::uint32_t inside = at_[i] & (cells - 1);
      way.steps[i] = step_[i] > 0 ? cells - inside : inside + 1;
      return used_[i] + way.steps[i] >= count - 1;  // step() reads one more
    };
    const bool short_x = steps_along(0), short_y = steps_along(1), short_z = steps_along(2);
    if (short_x || short_y || short_z) renew();
    const auto last = [&](std::size_t i) { return ahead_[i][used_[i] + way.steps[i] - 1]; };
    way.face = first(last(0), last(1), last(2));
    return way;
  }
  /// Takes all steps up to an exit.
  void take(const node_exit& way) noexcept {
    const double end = way.face.parameter;
    const auto take_along = [&](std::size_t i) {
      // Steps are `delta` apart up to rounding, so only the step next to the face must be examined. The first is less
      // than one step before the ray and the last is not before the face, so no clamping is needed.
      const double* const next = ahead_[i].data() + used_[i];
      const double near = (end - next[0]) * per_step_[i] + 0.5;
      const auto sure = static_cast<std::uint32_t>(static_cast<std::int32_t>(near));
      const bool is_before = (next[sure] < end) | ((next[sure] == end) & (i >= way.face.axis));
      const std::uint32_t taken = sure + (is_before ? 1 : 0);
      at_[i] += static_cast<std::uint32_t>(step_[i]) * taken;
      used_[i] += taken;
    };
    take_along(0);
    take_along(1);
    take_along(2);
  }

 private:
  static constexpr std::uint32_t count = 64;

  /// Returns the face that the ray crosses first; ties go to the last axis, as in ray_traversal.
  [[nodiscard]] static crossing first(double x, double y, double z) noexcept {
    const bool is_x = x < y && x < z, is_z = !(y < z) || (x < y && !is_x);
    const double parameter = x < y ? x : y;
    return {is_x ? std::size_t{0} : is_z ? std::size_t{2} : std::size_t{1}, parameter < z ? parameter : z};
  }
  void renew() noexcept { sum_up(ahead_[0][used_[0]], ahead_[1][used_[1]], ahead_[2][used_[2]]); }
  void sum_up(double x, double y, double z) noexcept {
    const double dx = delta_[0], dy = delta_[1], dz = delta_[2];
    for (std::size_t i = 0; i != count; ++i) {
      ahead_[0][i] = x;
      ahead_[1][i] = y;
      ahead_[2][i] = z;
      x += dx;
      y += dy;
      z += dz;
    }
    used_ = {};
  }

  std::array<std::uint32_t, 3> at_;
  std::array<std::int32_t, 3> step_;
  std::array<double, 3> delta_;
  std::array<double, 3> per_step_{};
  std::array<std::uint32_t, 3> used_{};
  std::uint32_t cells_;
  std::array<std::array<double, count>, 3> ahead_;
};
using skipping_traversal = basic_skipping_traversal<>;

}  // namespace orbis::octree::detail

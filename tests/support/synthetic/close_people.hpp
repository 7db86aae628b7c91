// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// People who come close to a camera on its way: they cover much of the view, stop, go along with it, and leave.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/io/detail/synthetic/arithmetic.hpp>

#include "support/synthetic/sequence.hpp"
#include "support/synthetic/walk.hpp"
#include "support/synthetic/world.hpp"

namespace orbis::test {

/// Where somebody is at a moment, as the camera sees it then.
struct visit {
  double time;          ///< seconds
  double ahead, left;   ///< metres from the camera, along the floor
  bool stands = false;  ///< stays where it is until the next moment, whose place does not count
};

/// The way of somebody who goes from each of these places to the next, relative to the camera, with gentle starts and
/// stops: who stays at one place of the view goes along with the camera. @pre at least two visits, by ascending time
template <camera_motion Path>
[[nodiscard]] std::vector<whereabouts> way_beside(const Path& path, const std::vector<visit>& visits) {
  assert(visits.size() > 1);
  constexpr double step = 1.0 / 30.0;
  std::vector<whereabouts> way;
  const auto yaw_at = [&](double time) {  // towards where the camera looks; no jumps
    const triple f = path.at(time).forward;
    const double turns = 0.15915494309189535 * std::atan2(f.y, f.x);
    return way.empty() ? turns : turns - std::round(turns - way.back().yaw);
  };
  const auto at = [&](double time, double ahead, double left) { return detail::on_floor(path.at(time), ahead, left); };
  double ahead = visits.front().ahead, left = visits.front().left;
  for (std::size_t i = 0; i + 1 != visits.size(); ++i) {
    const visit &from = visits[i], &to = visits[i + 1];
    if (from.stands) {
      const triple place = at(from.time, ahead, left);
      way.push_back({from.time, place, yaw_at(from.time)});
      way.push_back({to.time, place, way.back().yaw});
      // Where it stands, as the camera sees it at the end.
      const camera_pose then = path.at(to.time);
      const triple front = detail::on_floor(then, 1.0, 0.0) - detail::on_floor(then, 0.0, 0.0);
      const triple d = place - detail::on_floor(then, 0.0, 0.0);
      ahead = front.x * d.x + front.y * d.y;
      left = front.x * d.y - front.y * d.x;
      continue;
    }
    const int steps = std::max(1, static_cast<int>((to.time - from.time) / step + 0.5));
    // Who stood turns towards the new way while it begins to go.
    const double turned = i == 0 ? 0.0 : way.back().yaw - yaw_at(from.time);
    for (int k = 0; k != steps; ++k) {
      const double s = static_cast<double>(k) / steps, f = s * s * (3.0 - 2.0 * s);
      const double time = from.time + s * (to.time - from.time);
      way.push_back({time, at(time, ahead + f * (to.ahead - ahead), left + f * (to.left - left)),
                     yaw_at(time) + (1.0 - f) * turned});
    }
    ahead = to.ahead;
    left = to.left;
  }
  way.push_back({visits.back().time, at(visits.back().time, ahead, left), yaw_at(visits.back().time)});
  return way;
}

/// A grown person on this way, whose arms and legs swing while it goes: trunk and head, and four bodies for the limbs.
[[nodiscard]] inline std::vector<moving_body> walker_on(const std::vector<whereabouts>& way, std::uint64_t seed) {
  const moving_body whole = person(way, seed);
  std::vector<moving_body> parts(1);
  parts[0].way = way;
  for (const solid& s : whole.solids) {
    if (s.kind != shape::cylinder) {
      parts[0].solids.push_back(s);
      continue;
    }
    const bool is_leg = s.centre.z < 0.8;
    moving_body limb{{s}, way};
    double gone = 0.0;
    for (std::size_t i = 0; i != way.size(); ++i) {
      if (i != 0) gone += length(way[i].position - way[i - 1].position);
      const double swing = (is_leg ? 0.15 : 0.1) * (is_leg == (s.centre.y > 0.0) ? 1.0 : -1.0) * sin_turns(gone / 1.3);
      limb.way[i].position.x += swing * cos_turns(way[i].yaw);
      limb.way[i].position.y += swing * sin_turns(way[i].yaw);
    }
    parts.push_back(std::move(limb));
  }
  return parts;
}

/// What somebody close to the camera does.
enum class company {
  crosses,      ///< from left to right
  stops,        ///< comes, stands for two seconds and leaves
  goes_along,   ///< stays in the middle of the view for four seconds
  comes_near,   ///< from afar up to the camera, and away again
  stands_first  ///< stands there from the beginning, and leaves
};

/// A room with somebody in it, 8 s; see `with_company`.
struct company_options {
  company what = company::crosses;
  double distance = 1.0;   ///< metres: 1.0 covers half of the view, 1.5 a third of it
  double duration = 24.0;  ///< of the camera's way round the room, seconds
  sequence_options sequence{};
  std::uint64_t seed = 1;  ///< of room, textures and way
};

/// What a camera sees that goes round a room while somebody is close to it.
[[nodiscard]] inline sequence<camera_path> with_company(company_options o) {
  const synthetic_path_options round{};
  const camera_path way{round, o.seed, o.duration};
  const double d = o.distance, out = 0.75 * d + 0.5;
  std::vector<visit> visits;
  switch (o.what) {
    case company::crosses: visits = {{2.0, d, out}, {6.0, d, -out}}; break;
    case company::stops: visits = {{1.5, d, -out}, {3.0, d, 0.1, true}, {5.0, 0.0, 0.0}, {6.5, d, -out}}; break;
    case company::goes_along: visits = {{1.0, d, -out}, {2.2, d, 0.0}, {6.2, d, 0.05}, {7.2, d, out}}; break;
    case company::comes_near: visits = {{1.5, 2.6, 0.2}, {4.0, d, 0.0}, {4.5, d, 0.0}, {7.5, 2.6, -0.4}}; break;
    case company::stands_first: visits = {{0.0, d, 0.15, true}, {2.5, 0.0, 0.0}, {5.0, d, out}}; break;
  }
  world place{scene{{}, o.seed}};
  for (const moving_body& part : walker_on(way_beside(way, visits), mix64(o.seed))) place.add(part);
  if (o.sequence.frames == 0) o.sequence.frames = static_cast<int>(8.0 * o.sequence.fps);
  return {std::move(place), way, o.sequence};
}

}  // namespace orbis::test

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recall of a vocabulary in place recognition.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <orbis/places/keyframe_database.hpp>
#include <orbis/places/vocabulary.hpp>

#include "sources.hpp"

namespace recall {

using sources::view;

/// Database views, query views, and the criterion for two views of the same place.
struct task {
  std::string name;
  orbis::camera::camera_settings camera{};
  std::vector<view> map{}, queries{};
  double overlap = 0.6;   ///< minimum share of each view's surface that is visible in the other
  double turned = 0.6;    ///< maximum rotation between the two views, radians
  bool within = false;    ///< true if the queries are views in the database
  std::size_t apart = 0;  ///< minimum difference of the indices of query and match; used if `within` is true
};

struct outcome {
  std::size_t queries = 0;    ///< number of queries whose place is in the database
  double first = 0.0;         ///< share of queries whose best view is correct
  double among_ten = 0.0;     ///< share of queries with a correct view among the best ten
  double candidate = 0.0;     ///< share of queries whose first candidate from the database is correct
  double transform_ms = 0.0;  ///< median time to compute a bag of words
};

[[nodiscard]] inline bool same_place(const task& t, const view& a, const view& b) {
  if (a.place != b.place) return false;
  if ((a.T_world_camera.inverse() * b.T_world_camera).rotation().angle() > t.turned) return false;
  return sources::overlap(a, b, t.camera) > t.overlap && sources::overlap(b, a, t.camera) > t.overlap;
}

[[nodiscard]] inline outcome measure(const task& t, const orbis::places::vocabulary& words) {
  using namespace orbis::places;
  keyframe_database database;
  transform_workspace memory;
  std::vector<double> times;
  std::vector<bag_of_words> bags(t.map.size());
  for (std::size_t i = 0; i != t.map.size(); ++i) {
    words.transform(t.map[i].found, bags[i], memory);
    database.add(static_cast<std::uint32_t>(i), bags[i]);
  }
  outcome o;
  bag_of_words bag;
  const auto& queries = t.within ? t.map : t.queries;
  for (std::size_t q = 0; q != queries.size(); ++q) {
    const auto excluded = [&](std::uint32_t i) { return t.within && (i > q ? i - q : q - i) < t.apart; };
    const auto right = [&](std::uint32_t i) { return !excluded(i) && same_place(t, queries[q], t.map[i]); };
    bool known = false;
    for (std::uint32_t i = 0; i != t.map.size() && !known; ++i) known = right(i);
    if (!known) continue;
    const auto begin = std::chrono::steady_clock::now();
    words.transform(queries[q].found, bag, memory);
    times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    ++o.queries;
    const auto best = database.best(bag, 10, excluded);
    o.first += !best.empty() && right(best.front().id) ? 1.0 : 0.0;
    o.among_ten += std::ranges::any_of(best, [&](const auto& c) { return right(c.id); }) ? 1.0 : 0.0;
    // The temporal neighbours of a view take the role of its covisible keyframes.
    const auto neighbors = [&](std::uint32_t i) {
      std::vector<std::uint32_t> near;
      for (std::uint32_t j = i < 5 ? 0 : i - 5; j != std::min<std::size_t>(i + 6, t.map.size()); ++j)
        if (j != i && t.map[j].place == t.map[i].place) near.push_back(j);
      return near;
    };
    const auto candidates = database.query(bag, {}, excluded, neighbors);
    o.candidate += !candidates.empty() && right(candidates.front().id) ? 1.0 : 0.0;
  }
  for (double* share : {&o.first, &o.among_ten, &o.candidate})
    *share /= std::max<double>(1.0, static_cast<double>(o.queries));
  std::ranges::sort(times);
  if (!times.empty()) o.transform_ms = times[times.size() / 2];
  return o;
}

}  // namespace recall

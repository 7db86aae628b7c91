// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/brute_force.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/motion_statistics.hpp>
#include <orbis/features/stages.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

struct scene {
  std::vector<keypoint> queries, trains;
  std::vector<candidate> candidates;
  std::vector<bool> right;
};

/// Points that a similarity moves, and as many that go anywhere.
scene moved(double angle, double scale, double share_right, std::uint64_t seed, int count = 1500) {
  random_bits random{seed};
  scene s;
  for (int i = 0; i != count; ++i) {
    const double x = random.uniform(0.0, 640.0), y = random.uniform(0.0, 480.0);
    const double c = scale * std::cos(angle), d = scale * std::sin(angle);
    double u = 320.0 + c * (x - 320.0) - d * (y - 240.0) + 12.0, v = 240.0 + d * (x - 320.0) + c * (y - 240.0) - 7.0;
    const bool right = random.uniform(0.0, 1.0) < share_right;
    if (!right) u = random.uniform(0.0, 640.0), v = random.uniform(0.0, 480.0);
    const auto index = static_cast<std::uint32_t>(i);
    s.queries.push_back({.x = static_cast<float>(x), .y = static_cast<float>(y)});
    s.trains.push_back({.x = static_cast<float>(u), .y = static_cast<float>(v)});
    s.candidates.push_back({index, index, 10});
    s.right.push_back(right);
  }
  return s;
}

/// The definition with maps and no shortcuts, for one scale and no turn.
std::set<std::uint32_t> naive_kept(const scene& s, int cells, double strictness) {
  using cell = std::pair<int, int>;
  std::set<std::uint32_t> kept;
  for (const float shift_x : {0.0F, 0.5F})
    for (const float shift_y : {0.0F, 0.5F}) {
      const auto n = static_cast<float>(cells);
      const auto inside = [&](cell c) { return c.first >= 0 && c.second >= 0 && c.first < cells && c.second < cells; };
      const auto from = [&](const candidate& c) {
        const keypoint& k = s.queries[c.query];
        return cell{static_cast<int>(std::floor(k.x / 640.0F * n + shift_x)),
                    static_cast<int>(std::floor(k.y / 480.0F * n + shift_y))};
      };
      const auto to = [&](const candidate& c) {
        const keypoint& k = s.trains[c.train];
        return cell{static_cast<int>(std::floor(k.x / 640.0F * n)), static_cast<int>(std::floor(k.y / 480.0F * n))};
      };
      std::map<std::pair<cell, cell>, int> moves;
      std::map<cell, int> count;
      for (const candidate& c : s.candidates)
        if (inside(from(c)) && inside(to(c))) ++moves[{from(c), to(c)}], ++count[from(c)];
      for (const candidate& c : s.candidates) {
        const cell a = from(c), b = to(c);
        if (!inside(a) || !inside(b)) continue;
        const int own = moves[{a, b}];
        bool most = true;
        for (const auto& [move, times] : moves)
          if (move.first == a && (times > own || (times == own && std::pair{move.second.second, move.second.first} <
                                                                      std::pair{b.second, b.first})))
            most = false;
        if (!most) continue;
        int alike = 0, all = 0, regions = 0;
        for (int dx = -1; dx <= 1; ++dx)
          for (int dy = -1; dy <= 1; ++dy) {
            const cell near{a.first + dx, a.second + dy}, near_to{b.first + dx, b.second + dy};
            if (!inside(near) || !inside(near_to)) continue;
            const auto found = moves.find({near, near_to});
            alike += found == moves.end() ? 0 : found->second;
            all += count.contains(near) ? count[near] : 0;
            ++regions;
          }
        if (alike > strictness * std::sqrt(static_cast<double>(all) / regions)) kept.insert(c.query);
      }
    }
  return kept;
}

std::set<std::uint32_t> queries_of(const std::vector<candidate>& candidates) {
  std::set<std::uint32_t> queries;
  for (const candidate& c : candidates) queries.insert(c.query);
  return queries;
}

}  // namespace

TEST_CASE("motion statistics keep exactly what their definition keeps") {
  for (const double share : {0.3, 0.7, 1.0})
    for (const int cells : {1, 8, 20}) {
      const scene s = moved(0.05, 1.0, share, static_cast<std::uint64_t>(cells), 600);
      auto kept = s.candidates;
      motion_statistics stage;
      stage.cells = cells;
      stage.strictness = 2.5F;
      stage(kept, s.queries, s.trains);
      INFO(share << " right, " << cells << " cells");
      CHECK(queries_of(kept) == naive_kept(s, cells, 2.5));
      CHECK(std::is_sorted(kept.begin(), kept.end(),
                           [](const candidate& a, const candidate& b) { return a.query < b.query; }));
    }
}

TEST_CASE("motion statistics tell right from wrong without looking at descriptors") {
  const scene s = moved(0.03, 1.0, 0.5, 4, 3000);
  auto kept = s.candidates;
  motion_statistics{.strictness = 4.0F}(kept, s.queries, s.trains);
  const auto right = static_cast<std::size_t>(
      std::count_if(kept.begin(), kept.end(), [&](const candidate& c) { return s.right[c.query]; }));
  CHECK(right > 1200);  // of about 1500; those near the borders have few around them
  CHECK(kept.size() - right < kept.size() / 50);

  const scene noise = moved(0.0, 1.0, 0.0, 5, 3000);
  kept = noise.candidates;
  motion_statistics{.strictness = 4.0F}(kept, noise.queries, noise.trains);
  CHECK(kept.size() < 30);
}

TEST_CASE("turned and scaled images need the turns and the scales") {
  const double quarter = 1.5707963267948966;
  motion_statistics plain{.strictness = 4.0F};
  motion_statistics both = plain;
  both.rotations = both.scales = true;
  const auto kept_by = [](const motion_statistics& stage, const scene& s) {
    auto kept = s.candidates;
    stage(kept, s.queries, s.trains);
    return kept.size();
  };
  // A quarter turn about the middle of a square part of the image.
  scene turned = moved(quarter, 0.7, 0.8, 6, 3000);
  CHECK(kept_by(both, turned) > 1500);
  CHECK(kept_by(both, turned) > 2 * kept_by(plain, turned));
  const scene half = moved(0.0, 0.5, 0.8, 7, 3000);
  CHECK(kept_by(both, half) > 1800);
}

TEST_CASE("motion statistics survive nothing, positions outside the image and used memory") {
  motion_statistics::workspace memory;
  const motion_statistics stage{.strictness = 4.0F};
  std::vector<candidate> none_at_all;
  stage(none_at_all, {}, {}, memory);
  CHECK(none_at_all.empty());
  scene s = moved(0.0, 1.0, 0.6, 8, 2000);
  auto first = s.candidates;
  stage(first, s.queries, s.trains, memory);
  CHECK(first.size() > 800);
  auto again = s.candidates;
  stage(again, s.queries, s.trains, memory);
  CHECK(again == first);
  for (std::size_t i = 0; i < s.queries.size(); i += 2)
    s.queries[i] = {.x = i % 4 == 0 ? -5.0F : std::nanf(""), .y = 1e30F};
  auto half = s.candidates;
  stage(half, s.queries, s.trains, memory);
  for (const candidate& c : half) CHECK(c.query % 2 == 1);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <vector>

#include <orbis/cloud/voxel_sums.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using orbis::cloud::voxel_measurements;
using orbis::cloud::voxel_sums;

namespace {

struct measurement {
  orbis::vec3 point;
  orbis::rgb8 color;
  float range;
};

std::vector<measurement> some_measurements(std::size_t n, std::uint64_t seed, double reach) {
  orbis::random_bits random{seed};
  std::vector<measurement> out;
  for (std::size_t i = 0; i != n; ++i) {
    const double x = random.uniform(-reach, reach);
    const double y = random.uniform(-reach, reach);
    out.push_back({{x, y, 0.1 * std::sin(x)},
                   {static_cast<std::uint8_t>(random.below(256)), 7, static_cast<std::uint8_t>(random.below(3))},
                   static_cast<float>(random.uniform(0.5, 4.0))});
  }
  return out;
}

std::vector<voxel_measurements> parts_of(const std::vector<measurement>& all, double size, std::size_t count = 3) {
  std::vector<voxel_measurements> out(count, voxel_measurements{size});
  for (std::size_t i = 0; i != all.size(); ++i)
    out[i * count / all.size()].push(all[i].point, all[i].color, all[i].range);
  return out;
}

/// As it is defined, voxel by voxel.
struct reference {
  struct sum {
    std::array<std::uint64_t, 3> offset{};
    std::array<std::uint64_t, 3> color{};
    std::uint64_t range = 0;
    std::uint64_t count = 0;
  };
  double size;
  std::map<std::array<int, 6>, sum> voxels;  // in the order of bricks, then of cells

  void add(const measurement& m, bool back = false) {
    std::array<int, 6> key{};
    std::array<std::uint64_t, 3> offset{};
    for (std::size_t a = 0; a != 3; ++a) {
      const double scaled = m.point[static_cast<Eigen::Index>(a)] * (1.0 / size);
      const int cell = static_cast<int>(std::floor(scaled));
      key[2 - a] = cell >= 0 ? cell / 8 : -((7 - cell) / 8);
      key[5 - a] = cell - 8 * key[2 - a];
      offset[a] = static_cast<std::uint64_t>((scaled - std::floor(scaled)) * 1024.0);
    }
    sum& s = voxels[key];
    const std::uint64_t sign = back ? ~std::uint64_t{0} : 1;
    for (std::size_t a = 0; a != 3; ++a) s.offset[a] += sign * offset[a];
    s.color[0] += sign * m.color.r;
    s.color[1] += sign * m.color.g;
    s.color[2] += sign * m.color.b;
    s.range += sign * static_cast<std::uint64_t>(1000.0F * m.range + 0.5F);
    s.count += sign;
    if (s.count == 0) voxels.erase(key);
  }
};

void check_equal(const voxel_sums& sums, const reference& wanted) {
  REQUIRE(sums.size() == wanted.voxels.size());
  const auto order = sums.in_order();
  const auto cloud = sums.cloud(orbis::seq, order);
  const auto ranges = sums.ranges(orbis::par.with(3), order);
  CHECK(sums.cloud(orbis::par.with(2), order).points == cloud.points);
  REQUIRE(cloud.size() == wanted.voxels.size());
  std::size_t i = 0;
  std::size_t wrong = 0;
  for (const auto& [key, s] : wanted.voxels) {
    const auto n = static_cast<double>(s.count);
    for (std::size_t a = 0; a != 3; ++a) {
      const double within = (static_cast<double>(s.offset[a]) / n + 0.5) / 1024.0;
      const auto p = static_cast<float>((8 * key[2 - a] + key[5 - a] + within) * wanted.size);
      wrong += cloud.points[i][static_cast<Eigen::Index>(a)] == p ? 0 : 1;
    }
    wrong += cloud.colors[i].r == (s.color[0] + s.count / 2) / s.count ? 0 : 1;
    wrong += cloud.colors[i].g == 7 ? 0 : 1;
    wrong += ranges[i] == static_cast<float>(static_cast<double>(s.range) / (1000.0 * n)) ? 0 : 1;
    ++i;
  }
  CHECK(wrong == 0);
}

}  // namespace

TEST_CASE("voxel sums are those of the measurements that are there") {
  for (const double size : {0.01, 0.05, 0.7}) {
    voxel_sums sums{size};
    reference wanted{size, {}};
    std::vector<std::vector<measurement>> sets;
    for (std::uint64_t s = 0; s != 6; ++s)
      sets.push_back(some_measurements(3000, s, 0.3 + 0.3 * static_cast<double>(s)));
    check_equal(sums, wanted);
    orbis::random_bits random{8};
    std::array<int, 6> times{};
    for (int step = 0; step != 40; ++step) {
      const std::uint32_t which = random.below(6);
      const bool back = times[which] != 0 && random.below(2) == 0;
      auto parts = parts_of(sets[which], size, 1 + random.below(4));
      if (back) {
        sums.remove(orbis::par.with(1 + random.below(3)), parts);
      } else {
        sums.add(orbis::par.with(1 + random.below(3)), parts);
      }
      times[which] += back ? -1 : 1;
      for (const auto& m : sets[which]) wanted.add(m, back);
      if (step % 5 == 4) check_equal(sums, wanted);
    }
    for (std::uint32_t which = 0; which != 6; ++which) {
      for (; times[which] != 0; --times[which]) {
        auto parts = parts_of(sets[which], size);
        sums.remove(orbis::seq, parts);
      }
    }
    CHECK(sums.size() == 0);
    CHECK(sums.cloud(orbis::seq, sums.in_order()).empty());
  }
}

TEST_CASE("every measurement finds whether its voxel was chosen, others nothing") {
  const double size = 0.02;
  voxel_sums sums{size};
  const auto all = some_measurements(5000, 3, 1.0);
  auto parts = parts_of(all, size);
  sums.add(orbis::seq, parts);
  const auto cloud = sums.cloud(orbis::seq, sums.in_order());
  const auto voxel_of = [&](const orbis::vec3& p) {
    return std::array{std::floor(p.x() / size), std::floor(p.y() / size), std::floor(p.z() / size)};
  };
  orbis::random_bits random{8};
  std::vector<char> chosen(cloud.size());
  std::map<std::array<double, 3>, bool> is_chosen;
  for (std::size_t i = 0; i != cloud.size(); ++i) {
    chosen[i] = random.below(3) == 0 ? 1 : 0;
    is_chosen[voxel_of(cloud.points[i].cast<double>())] = chosen[i] != 0;
  }
  sums.finish();
  const auto choice = sums.choose(chosen);
  voxel_sums::choice::reader reader{choice};
  CHECK_FALSE(reader.find({0, 0, 5}).has_value());
  for (const auto& m : all) {
    const auto found = reader.find(m.point);
    REQUIRE(found.has_value());
    const auto wanted = is_chosen.find(voxel_of(m.point));
    if (wanted != is_chosen.end())
      CHECK(*found == wanted->second);  // but where a centroid was rounded out of its voxel
  }
  CHECK_FALSE(reader.find({0, 0, 5}).has_value());
  CHECK_FALSE(reader.find({std::nan(""), 0, 0}).has_value());
  CHECK_FALSE(reader.find({0, 1e300, 0}).has_value());
}

TEST_CASE("measurements without a voxel are counted and left out") {
  voxel_measurements some{0.01};
  const double inf = std::numeric_limits<double>::infinity();
  some.push({std::nan(""), 0, 0}, {}, 1);
  some.push({0, inf, 0}, {}, 1);
  some.push({0, 0, -3e7}, {}, 1);
  CHECK(some.size() == 0);
  CHECK(some.without_voxel() == 3);
  some.push({2.1e7, -2.1e7, 0}, {1, 2, 3}, std::numeric_limits<float>::quiet_NaN());
  some.push({-1e-12, 0, 0}, {1, 2, 3}, std::numeric_limits<float>::infinity());
  CHECK(some.size() == 2);
  voxel_sums sums{0.01};
  sums.add(orbis::seq, {&some, 1});
  CHECK(sums.size() == 2);
  const auto cloud = sums.cloud(orbis::seq, sums.in_order());
  CHECK(cloud.points[0].x() == Approx(2.1e7));
  CHECK(std::abs(cloud.points[1].x()) < 1e-5F);
  CHECK(cloud.colors[1] == orbis::rgb8{1, 2, 3});
  sums.remove(orbis::seq, {&some, 1});
  CHECK(sums.size() == 0);
  some.clear();
  CHECK(some.size() + some.without_voxel() == 0);
}

TEST_CASE("voxel sums give back what they no longer need") {
  const double size = 0.01;
  voxel_sums sums{size};
  std::size_t most = 0;
  for (int step = 0; step != 60; ++step) {  // a window that moves on
    const auto moved = [&](int by) {
      auto all = some_measurements(4000, 9, 0.5);
      for (auto& m : all) m.point.x() += 0.4 * by;
      return parts_of(all, size);
    };
    auto ahead = moved(step);
    sums.add(orbis::seq, ahead);
    if (step >= 3) {
      auto behind = moved(step - 3);
      sums.remove(orbis::seq, behind);
    }
    if (step == 9) most = sums.memory_bytes();
    if (step > 9) CHECK(sums.memory_bytes() <= most + most / 10);
  }
}

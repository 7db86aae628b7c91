// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/detail/knn/nearest_search.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/nanoflann.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::simd::level;
using orbis::test::points;

namespace {

constexpr std::array levels{level::portable, level::avx2, level::avx512};

std::size_t differences(const std::vector<float>& found, const std::vector<float>& expected) {
  if (found.size() != expected.size()) return found.size() + expected.size();
  std::size_t different = 0;
  for (std::size_t i = 0; i != found.size(); ++i) {
    const bool same = std::isnan(expected[i]) ? std::isnan(found[i]) : found[i] == expected[i];
    different += same ? 0 : 1;
  }
  return different;
}

}  // namespace

TEST_CASE("mean distances equal brute force with every instruction set and number of threads") {
  auto clouds = orbis::test::all_clouds();
  for (auto& hard : orbis::test::hard_clouds()) clouds.push_back(std::move(hard));
  for (const auto& [name, cloud] : clouds) {
    for (const std::size_t k : {1U, 2U, 15U, 16U, 50U, 200U}) {
      const auto expected = orbis::test::reference_mean_distances(cloud, k);
      for (const level l : levels) {
        INFO(name << " k " << k << " level " << static_cast<int>(l));
        const orbis::simd::level_limit limit{l};
        CHECK(differences(orbis::cloud::all_mean_knn_distance(orbis::seq, cloud, k), expected) == 0);
      }
      CHECK(differences(orbis::cloud::all_mean_knn_distance(orbis::par.with(3), cloud, k), expected) == 0);
    }
  }
}

TEST_CASE("the nearest are the same where too many rows are near to be shared") {
  using namespace orbis::cloud::detail;
  points cloud = orbis::test::uniform_cloud(9'000, 21, 1.0);
  const points far = orbis::test::uniform_cloud(60, 22, 200.0);
  cloud.insert(cloud.end(), far.begin(), far.end());
  const auto tree = make_leaves(orbis::seq, orbis::cloud::detail::viewed_points{cloud}, 9);
  for (const level l : levels) {
    const orbis::simd::level_limit limit{l};
    const knn_kernels kernels;
    const auto largest_of_all = [&](std::size_t most_near_rows) {
      nearest_search search{tree, kernels, 9, false, most_near_rows};
      std::vector<float> largest(leaf_width * tree.leaves.size());
      for (std::size_t leaf = 0; leaf != tree.leaves.size(); ++leaf)
        search.visit_sums(leaf, [&](std::size_t i, std::span<float>, const nearest_sum& sum) {
          largest[leaf * leaf_width + i] = sum.largest_squared;
        });
      return largest;
    };
    const auto expected = largest_of_all(10'000);
    CHECK(largest_of_all(128) == expected);
    CHECK(largest_of_all(16) == expected);  // too many for some
    CHECK(largest_of_all(0) == expected);   // too many for all
    std::size_t wrong = 0;
    for (std::size_t n = 0; n < tree.in_leaves; n += 97) {
      const orbis::vec3f p = cloud[tree.members[n]];
      std::vector<float> all;
      for (const orbis::vec3f& q : cloud)
        all.push_back(orbis::cloud::detail::squared_distance<float>({p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z()}));
      std::nth_element(all.begin(), all.begin() + 8, all.end());
      wrong += expected[n] == all[8] ? 0 : 1;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("mean distances of larger clouds equal those of a k-d tree") {
  points scattered = orbis::test::room_cloud(240, 160, 0.002, 3);
  orbis::random_bits random{4};
  for (std::size_t i = 0; i < scattered.size(); i += 50) scattered[i] *= static_cast<float>(random.uniform());
  for (std::size_t i = scattered.size(); i-- > 1;)
    std::swap(scattered[i], scattered[random.below(static_cast<std::uint32_t>(i + 1))]);
  for (const points& cloud : {scattered, orbis::test::uniform_cloud(20'000, 5, 10.0, 1000.0)}) {
    const orbis::cloud::nanoflann_search search{cloud};
    for (const std::size_t k : {8U, 50U}) {
      std::vector<float> expected;
      for (const orbis::vec3f& p : cloud) {
        std::vector<orbis::cloud::neighbor<float>> nearest;
        search.knn({p.x(), p.y(), p.z()}, k + 1, nearest);
        std::vector<float> squares;
        for (const auto& n : nearest) squares.push_back(orbis::test::squared(p, cloud[n.index]));
        std::sort(squares.begin(), squares.end());
        double sum = 0;
        for (const float s : squares) sum += std::sqrt(double{s});
        expected.push_back(static_cast<float>(sum / static_cast<double>(k)));
      }
      for (const level l : levels) {
        const orbis::simd::level_limit limit{l};
        CHECK(differences(orbis::cloud::all_mean_knn_distance(orbis::seq, cloud, k), expected) == 0);
        CHECK(differences(orbis::cloud::all_mean_knn_distance(orbis::par.with(2), cloud, k), expected) == 0);
      }
    }
  }
}

TEST_CASE("the nearest of some distances are selected and summed alike by all instruction sets") {
  orbis::random_bits random{6};
  for (int round = 0; round != 3000; ++round) {
    const std::size_t count = 1 + random.below(round % 3 == 0 ? 400 : 40);
    const std::size_t wanted = 1 + random.below(static_cast<std::uint32_t>(count));
    std::vector<float> values(count);
    const int kind = round % 6;
    for (float& v : values) {
      v = static_cast<float>(random.uniform());
      if (kind == 1) v = static_cast<float>(random.below(4));                           // ties
      if (kind == 2) v = static_cast<float>(std::pow(2.0, random.uniform(-140, 120)));  // all magnitudes
      if (kind == 3) v = v < 0.9F ? v * 1e-6F : v;                                      // a tail
      if (kind == 4) v = 0;
      if (kind == 5 && v < 0.5F) v = 0;
    }
    std::vector<float> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    double roots = 0;
    for (std::size_t i = 0; i != wanted; ++i) roots += std::sqrt(double{sorted[i]});
    for (const level l : levels) {
      INFO("round " << round << " level " << static_cast<int>(l));
      std::vector<float> found = values;
      found.resize(count + orbis::cloud::detail::leaf_width, std::numeric_limits<float>::infinity());
      const orbis::simd::level_limit limit{l};
      const orbis::cloud::detail::knn_kernels kernels;
      const auto sum = kernels.sum_nearest(found.data(), count, wanted, sorted.back());
      CHECK(sum.largest_squared == sorted[wanted - 1]);
      if (sum.roots >= 0) {
        CHECK(std::abs(sum.roots - roots) <= roots * orbis::cloud::detail::roots_slack(wanted));
      } else {
        CHECK(kind == 2);  // only where roots are too small for the fast way
      }
      if (count <= orbis::cloud::detail::leaf_width) CHECK(kernels.ranked(found.data(), wanted) == sorted[wanted - 1]);
      found.resize(count);
      std::sort(found.begin(), found.end());
      CHECK(found == sorted);  // they are still there
    }
  }
}

TEST_CASE("the nearest distances of several points are summed as those of each") {
  using orbis::cloud::detail::leaf_width;
  orbis::random_bits random{8};
  for (int round = 0; round != 200; ++round) {
    const std::size_t wanted = 1 + random.below(round % 2 == 0 ? 16 : 40);
    const std::size_t stride = 96 + random.below(3), first = random.below(8), last = 9 + random.below(8);
    std::vector<float> found(leaf_width * stride + leaf_width, 0.0F);  // what was found for other points before
    std::array<std::uint32_t, leaf_width> counts{};
    std::array<float, leaf_width> bounds{};
    for (std::size_t i = 0; i != leaf_width; ++i) {
      counts[i] = random.below(static_cast<std::uint32_t>(round % 3 == 0 ? stride - leaf_width : 36));
      std::fill_n(found.begin() + static_cast<std::ptrdiff_t>(i * stride + counts[i]), leaf_width,
                  std::numeric_limits<float>::infinity());
      bounds[i] = static_cast<float>(std::pow(2.0, random.uniform(round % 5 == 0 ? -140 : -3, 3)));
      for (std::size_t n = 0; n != counts[i]; ++n) {
        const double share = random.uniform();
        found[i * stride + n] = round % 4 == 1 ? bounds[i] * static_cast<float>(random.below(3))  // ties
                                               : bounds[i] * static_cast<float>(share);
      }
      if (round % 4 == 1) bounds[i] *= 2;
    }
    for (const level l : levels) {
      INFO("round " << round << " level " << static_cast<int>(l));
      const orbis::simd::level_limit limit{l};
      const orbis::cloud::detail::knn_kernels kernels;
      constexpr double unset = 0.125;
      std::array<orbis::cloud::detail::nearest_sum, leaf_width> sums;
      sums.fill({unset, 0.0F});
      kernels.sums_of_each(found.data(), stride, first, last, counts.data(), wanted, bounds.data(), sums.data());
      for (std::size_t i = 0; i != leaf_width; ++i) {
        INFO("point " << i << " count " << counts[i] << " wanted " << wanted);
        if (i < first || i >= last || counts[i] < wanted) {
          CHECK(sums[i].roots == unset);
          continue;
        }
        const auto alone = kernels.sum_nearest(found.data() + i * stride, counts[i], wanted, bounds[i]);
        CHECK(sums[i].largest_squared == alone.largest_squared);
        CHECK((sums[i].roots < 0) == (alone.roots < 0));
        CHECK(std::abs(sums[i].roots - alone.roots) <=
              2 * std::abs(alone.roots) * orbis::cloud::detail::roots_slack(wanted));
      }
    }
  }
}

// The kernels by their definition, one number after the other.
namespace {

using namespace orbis::cloud::detail;

/// The distance from a value to an interval.
[[nodiscard]] float gap(float low, float high, float from_low, float from_high) noexcept {
  return std::max(std::max(low - from_high, from_low - high), 0.0F);
}

std::uint32_t near_boxes_reference(const box_axes& boxes, const box3& query, float bound, float* distance) {
  std::uint32_t mask = 0;
  for (std::size_t i = 0; i != leaf_width; ++i) {
    std::array<float, 3> d;
    for (std::size_t a = 0; a != 3; ++a)
      d[a] =
          gap(boxes.first[a * boxes.stride + i], boxes.first[(a + 3) * boxes.stride + i], query.low[a], query.high[a]);
    distance[i] = squared_distance<float>(d, {0.0F, 0.0F, 0.0F});
    mask |= (distance[i] <= bound ? 1U : 0U) << i;
  }
  return mask;
}

std::uint32_t distances_reference(const point_row& leaf, const std::array<float, 3>& query, float bound,
                                  float* distance) {
  std::uint32_t mask = 0;
  for (std::size_t i = 0; i != leaf_width; ++i) {
    distance[i] = squared_distance<float>(query, {leaf.axis[0][i], leaf.axis[1][i], leaf.axis[2][i]});
    mask |= (distance[i] <= bound ? 1U : 0U) << i;
  }
  return mask;
}

std::size_t in_leaf_reference(const point_row& leaf, const std::array<float, 3>& query, float bound, float* found) {
  std::size_t count = 0;
  for (std::size_t i = 0; i != leaf_width; ++i) {
    const float d = squared_distance<float>(query, {leaf.axis[0][i], leaf.axis[1][i], leaf.axis[2][i]});
    found[count] = d;
    count += d <= bound ? 1 : 0;
  }
  return count;
}

std::size_t near_points_reference(const point_row* leaves, const nearby_leaves& near, const std::array<float, 3>& query,
                                  float bound, float* found, std::size_t capacity) {
  const box3 box{query, query};
  std::array<float, leaf_width> distance;
  std::size_t count = 0;
  for (std::size_t first = 0; first < near.count; first += leaf_width) {
    std::uint32_t mask = near_boxes_reference(near.row(first), box, bound, distance.data());
    for (; mask != 0; mask &= mask - 1) {
      const std::uint32_t leaf = near.leaves[first + static_cast<std::size_t>(std::countr_zero(mask))];
      count += in_leaf_reference(leaves[leaf], query, bound, found + count);
      if (count > capacity) break;
    }
    if (count > capacity) break;
  }
  std::fill_n(found + count, leaf_width, std::numeric_limits<float>::infinity());
  return count;
}

}  // namespace

TEST_CASE("boxes and leaves are measured alike by all instruction sets") {
  using orbis::cloud::detail::box3;
  const auto cloud = orbis::test::uniform_cloud(2000, 7, 3.0);
  const auto tree = orbis::cloud::detail::make_leaves(orbis::seq, orbis::cloud::detail::viewed_points{cloud}, 51);
  using namespace orbis::cloud::detail;
  for (const level l : levels) {
    const orbis::simd::level_limit limit{l};
    const knn_kernels kernels;
    nearby_leaves near{400};
    std::vector<std::uint32_t> leaves;
    const box3 box{{1.0F, 1.0F, 1.0F}, {1.5F, 1.25F, 1.0F}};
    for (std::uint32_t row = 0; row != tree.levels[0].size(); ++row) {
      std::array<float, 16> distance{};
      std::array<float, 16> expected{};
      const auto mask = kernels.near_boxes(tree.levels[0][row], box, 0.3F, distance.data());
      CHECK(mask == near_boxes_reference(tree.levels[0][row], box, 0.3F, expected.data()));
      CHECK(distance == expected);
      kernels.gather(tree.levels[0][row], mask, row * 16, near);
      for (std::uint32_t i = 0; i != 16; ++i) {
        if ((mask >> i & 1U) != 0) leaves.push_back(row * 16 + i);
      }
    }
    near.finish();
    for (const auto& leaf : tree.leaves) {
      const std::array<float, 3> q{leaf.axis[0][3], leaf.axis[1][0], leaf.axis[2][0]};
      if (!std::isfinite(q[0])) continue;
      std::array<float, 64> found{};
      std::array<float, 64> expected{};
      CHECK(kernels.distances(leaf, q, 0.05F, found.data()) == distances_reference(leaf, q, 0.05F, expected.data()));
      CHECK(found == expected);
      const std::size_t n = kernels.in_leaf(leaf, q, 0.05F, found.data());
      CHECK(n == in_leaf_reference(leaf, q, 0.05F, expected.data()));
      CHECK(std::equal(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(n), expected.begin()));
    }
    const std::array<float, 3> middle{1.2F, 1.1F, 1.0F};
    std::vector<std::uint32_t> scratch(16 * (near.leaves.size() + 16));
    std::vector<float> found(4000);
    std::vector<float> found_reference(4000);
    const std::size_t n =
        kernels.near_point(tree.leaves.data(), near, middle, 0.2F, scratch.data(), found.data(), nullptr, 3000);
    CHECK(n > 16);
    CHECK(n == near_points_reference(tree.leaves.data(), near, middle, 0.2F, found_reference.data(), 3000));
    found.resize(n + 16);
    found_reference.resize(n + 16);
    CHECK(found == found_reference);
    // The points of a leaf one after the other.
    constexpr std::size_t stride = 400;
    const std::uint32_t own = near.leaves[near.count / 2];
    const point_row& points_of_leaf = tree.leaves[own];
    const std::size_t first = 3, last = tree.leaf_size(own) - 2;
    std::vector<float> rows(leaf_width * stride, -1.0F);
    std::array<std::uint32_t, leaf_width> counts{};
    kernels.near_points_of_each(tree.leaves.data(), near, points_of_leaf, first, last, 0.2F, scratch.data(),
                                rows.data(), nullptr, stride, 300, counts.data());
    for (std::size_t i = 0; i != leaf_width; ++i) {
      const std::array<float, 3> q{points_of_leaf.axis[0][i], points_of_leaf.axis[1][i], points_of_leaf.axis[2][i]};
      const auto row = rows.begin() + static_cast<std::ptrdiff_t>(i * stride);
      if (i < first || i >= last) {
        CHECK(counts[i] == 0);
        CHECK(*row == -1.0F);
        continue;
      }
      std::vector<float> alone(stride);
      CHECK(counts[i] == near_points_reference(tree.leaves.data(), near, q, 0.2F, alone.data(), 300));
      CHECK(counts[i] > 8);
      CHECK(std::equal(row, row + static_cast<std::ptrdiff_t>(counts[i] + leaf_width), alone.begin()));
    }
    // And which they are.
    std::vector<float> rows_again(leaf_width * stride, -1.0F);
    std::vector<std::uint32_t> places(leaf_width * stride);
    std::array<std::uint32_t, leaf_width> counts_again{};
    kernels.near_points_of_each(tree.leaves.data(), near, points_of_leaf, first, last, 0.2F, scratch.data(),
                                rows_again.data(), places.data(), stride, 300, counts_again.data());
    CHECK(counts_again == counts);
    CHECK(rows_again == rows);
    std::size_t elsewhere = 0;
    for (std::size_t i = first; i != last; ++i)
      for (std::size_t n = 0; n != counts[i]; ++n) {
        const std::uint32_t place = places[i * stride + n];
        const point_row& at = tree.leaves[place / leaf_width];
        const std::size_t lane = place % leaf_width;
        const float d =
            squared_distance<float>({points_of_leaf.axis[0][i], points_of_leaf.axis[1][i], points_of_leaf.axis[2][i]},
                                    {at.axis[0][lane], at.axis[1][lane], at.axis[2][lane]});
        elsewhere += d == rows[i * stride + n] ? 0 : 1;
      }
    CHECK(elsewhere == 0);
    // With more than there is room for it ends early.
    constexpr std::size_t few = 8;
    std::fill(rows.begin(), rows.end(), -1.0F);
    kernels.near_points_of_each(tree.leaves.data(), near, points_of_leaf, first, last, 0.2F, scratch.data(),
                                rows.data(), nullptr, stride, few, counts.data());
    for (std::size_t i = first; i != last; ++i) {
      CHECK(counts[i] > few);
      CHECK(rows[i * stride + few + 3 * leaf_width] == -1.0F);
    }
    CHECK(near.count > 16);
    near.leaves.resize(near.count);
    CHECK(std::equal(near.leaves.begin(), near.leaves.end(), leaves.begin(), leaves.end()));
    for (std::size_t i = 0; i != near.count; ++i) {
      const auto& from = tree.levels[0][leaves[i] / 16];
      for (std::size_t a = 0; a != 3; ++a) {
        CHECK(near.boxes[a * near.stride + i] == from.low[a][leaves[i] % 16]);
        CHECK(near.boxes[(a + 3) * near.stride + i] == from.high[a][leaves[i] % 16]);
      }
    }
    for (std::size_t i = near.count; i % 16 != 0; ++i) CHECK(near.boxes[i] == std::numeric_limits<float>::infinity());
  }
}

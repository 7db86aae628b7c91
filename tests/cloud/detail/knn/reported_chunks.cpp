// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/detail/knn/reported_chunks.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/statistical.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

TEST_CASE("a reported loop does all of its work and says how far it is") {
  for (const unsigned threads : {1U, 3U}) {
    std::vector<int> visits(1000, 0);
    std::vector<std::pair<std::size_t, std::size_t>> reports;
    auto report = [&](std::size_t done, std::size_t total) {
      reports.emplace_back(done, total);
      return true;
    };
    CHECK(orbis::cloud::detail::for_each_reported_chunk(orbis::par.with(threads), 1000, 64, report,
                                                        [&](std::size_t begin, std::size_t end) {
                                                          for (std::size_t i = begin; i != end; ++i) ++visits[i];
                                                        }));
    CHECK(visits == std::vector<int>(1000, 1));
    REQUIRE(reports.size() == 16);
    for (std::size_t i = 1; i != reports.size(); ++i) CHECK(reports[i - 1].first < reports[i].first);
    CHECK(reports.back() == std::pair<std::size_t, std::size_t>{1000, 1000});
  }
}

TEST_CASE("the long searches of a cloud report, give the same, and can be called off") {
  const auto cloud = orbis::test::room_cloud(160, 120, 0.002, 1);
  for (const unsigned threads : {1U, 2U}) {
    const auto policy = orbis::par.with(threads);
    std::size_t calls = 0;
    auto go_on = [&](std::size_t done, std::size_t total) {
      CHECK(done <= total);
      ++calls;
      return true;
    };
    auto stop_soon = [&](std::size_t, std::size_t) { return ++calls < 3; };
    const auto check = [&](auto&& run, const auto& expected) {
      calls = 0;
      const auto finished = run(orbis::progress{go_on});
      REQUIRE(finished.has_value());
      CHECK(*finished == expected);
      CHECK(calls > 3);
      calls = 0;
      const auto called_off = run(orbis::progress{stop_soon});
      REQUIRE_FALSE(called_off.has_value());
      CHECK(called_off.error().code == orbis::errc::cancelled);
      CHECK(calls == 3);
      CHECK(*run(orbis::progress{}) == expected);
    };
    check([&](orbis::progress p) { return orbis::cloud::all_mean_knn_distance(policy, cloud, 8, p); },
          orbis::cloud::all_mean_knn_distance(orbis::seq, cloud, 8));
    check([&](orbis::progress p) { return orbis::cloud::radius_inliers(policy, cloud, {.radius = 0.03}, p); },
          orbis::cloud::radius_inliers(orbis::seq, cloud, {.radius = 0.03}));
    check(
        [&](orbis::progress p) -> orbis::result<std::vector<orbis::cloud::neighbor<float>>> {
          auto table = orbis::cloud::all_knn(policy, cloud, 8, p);
          if (!table) return orbis::fail(table.error());
          return table->rows;
        },
        orbis::cloud::all_knn(orbis::seq, cloud, 8).rows);
    check(
        [&](orbis::progress p) -> orbis::result<std::vector<std::uint32_t>> {
          auto filtered = orbis::cloud::statistical_filter(policy, cloud, {.neighbors = 8}, p);
          if (!filtered) return orbis::fail(filtered.error());
          return filtered->inliers;
        },
        orbis::cloud::statistical_inliers(orbis::seq, cloud, {.neighbors = 8}));
  }
}

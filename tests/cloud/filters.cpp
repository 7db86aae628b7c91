// SPDX-License-Identifier: BSD-3-Clause
//
// What holds for every filter, on every kind of cloud.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <orbis/cloud/cluster.hpp>
#include <orbis/cloud/log_statistical.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/statistical.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::non_finite;
using orbis::test::points;

namespace {

using indices = std::vector<std::uint32_t>;

/// The filters by name, `scale`: the unit of the cloud in metres.
struct filter {
  std::string name;
  std::function<indices(orbis::parallel_policy, const points&, non_finite, double scale)> run;
  bool in_any_unit;   ///< the same points, whatever the unit
  bool in_any_order;  ///< the same points, whatever their order
};

std::vector<filter> filters() {
  using orbis::parallel_policy;
  return {
      {"statistical",
       [](parallel_policy policy, const points& cloud, non_finite n, double) {
         return orbis::cloud::statistical_inliers(policy, cloud, {.neighbors = 10, .non_finite = n});
       },
       true, false},  // the threshold is a sum
      {"log-statistical",
       [](parallel_policy policy, const points& cloud, non_finite n, double) {
         return orbis::cloud::log_statistical_inliers(policy, cloud,
                                                      {.neighbors = 10, .threshold = 0.7, .non_finite = n});
       },
       false, true},
      {"range-statistical",
       [](parallel_policy policy, const points& cloud, non_finite n, double) {
         return orbis::cloud::range_statistical_inliers(policy, cloud, {.common = orbis::vec3{0, 0, -1}},
                                                        {.neighbors = 10, .non_finite = n});
       },
       false, false},
      {"radius",
       [](parallel_policy policy, const points& cloud, non_finite n, double scale) {
         return orbis::cloud::radius_inliers(policy, cloud,
                                             {.radius = 0.0625 * scale, .min_neighbors = 3, .non_finite = n});
       },
       true, true},
      {"cluster",
       [](parallel_policy policy, const points& cloud, non_finite n, double) {
         return orbis::cloud::cluster_inliers(policy, cloud, {.reach = 1.5, .min_gap = 2.0, .non_finite = n});
       },
       true, false},  // of equally near neighbours, those with low indices are linked
  };
}

std::vector<std::pair<std::string, points>> every_cloud() {
  auto out = orbis::test::all_clouds();
  points huge = orbis::test::uniform_cloud(300, 1);
  for (orbis::vec3f& p : huge) p *= 1e30F;
  out.emplace_back("1e30", huge);
  for (std::size_t i = 0; i < huge.size(); i += 2) huge[i] *= 1e-30F;
  out.emplace_back("1 and 1e30", huge);
  points sparse(2000, orbis::vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  const points some = orbis::test::uniform_cloud(130, 2);
  for (std::size_t i = 0; i != some.size(); ++i) sparse[15 * i] = some[i];
  out.emplace_back("mostly holes", sparse);
  return out;
}

}  // namespace

TEST_CASE("every filter gives ascending indices, the same for every policy and number of threads") {
  for (const auto& [name, cloud] : every_cloud()) {
    for (const filter& f : filters()) {
      INFO(f.name << " on " << name);
      const indices alone = f.run({1}, cloud, non_finite::drop, 1.0);
      CHECK(std::is_sorted(alone.begin(), alone.end(), std::less_equal<>{}));
      for (const std::uint32_t i : alone) {
        if (i >= cloud.size() || !orbis::test::finite(cloud[i])) FAIL("no point of the cloud, or none that is finite");
      }
      for (const unsigned threads : {2U, 3U, 8U}) CHECK(f.run({threads}, cloud, non_finite::drop, 1.0) == alone);
    }
  }
}

TEST_CASE("keeping points that are not finite adds them and nothing else") {
  for (const auto& [name, cloud] : every_cloud()) {
    for (const filter& f : filters()) {
      INFO(f.name << " on " << name);
      indices expected = f.run({1}, cloud, non_finite::drop, 1.0);
      for (std::uint32_t i = 0; i != cloud.size(); ++i) {
        if (!orbis::test::finite(cloud[i])) expected.push_back(i);
      }
      std::sort(expected.begin(), expected.end());
      CHECK(f.run({1}, cloud, non_finite::keep, 1.0) == expected);
    }
  }
}

TEST_CASE("holes in a cloud change nothing for the other points") {
  for (const auto& [name, cloud] : every_cloud()) {
    points dense;
    indices original;
    for (std::uint32_t i = 0; i != cloud.size(); ++i) {
      if (!orbis::test::finite(cloud[i])) continue;
      dense.push_back(cloud[i]);
      original.push_back(i);
    }
    for (const filter& f : filters()) {
      INFO(f.name << " on " << name);
      indices without;
      for (const std::uint32_t i : f.run({1}, dense, non_finite::drop, 1.0)) without.push_back(original[i]);
      CHECK(f.run({1}, cloud, non_finite::drop, 1.0) == without);
    }
  }
}

TEST_CASE("the unit of length does not matter") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    if (name == "tiny extent") continue;  // squares underflow
    points scaled = cloud;
    for (orbis::vec3f& p : scaled) p *= 8.0F;  // exact
    for (const filter& f : filters()) {
      if (!f.in_any_unit) continue;
      INFO(f.name << " on " << name);
      CHECK(f.run({1}, scaled, non_finite::drop, 8.0) == f.run({1}, cloud, non_finite::drop, 1.0));
    }
  }
}

TEST_CASE("the order of points does not matter where no sum depends on it") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    points reversed(cloud.rbegin(), cloud.rend());
    for (const filter& f : filters()) {
      if (!f.in_any_order) continue;
      INFO(f.name << " on " << name);
      indices expected;
      const indices inliers = f.run({1}, reversed, non_finite::drop, 1.0);
      for (auto i = inliers.rbegin(); i != inliers.rend(); ++i) {
        expected.push_back(static_cast<std::uint32_t>(cloud.size() - 1) - *i);
      }
      CHECK(f.run({1}, cloud, non_finite::drop, 1.0) == expected);
    }
  }
}

// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <cstdint>
#include <map>
#include <optional>
#include <tuple>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/storage/apply_scan.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("A scan gives every voxel its hit or its miss, and says which voxels changed") {
  using model = log_odds<>;
  random_bits random{404};
  brick_store<float> store;
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, float> expected;
  change_log log;
  for (int scan = 0; scan != 12; ++scan) {
    scan_masks masks;
    for (int i = 0; i != 400; ++i) {
      const voxel_key k{500 + random.below(20), 500 + random.below(20), 500 + random.below(20)};
      random.below(3) == 0 ? masks.mark_occupied(k) : masks.mark_free(k);
    }
    const auto before = expected;
    std::size_t free = 0, occupied = 0;
    for (const scan_brick& b : masks.bricks())
      for (std::uint32_t place = 0; place != 512; ++place) {
        const voxel_key low = named_key(b.name), in = voxel_in_brick(place);
        const bool hit = (b.occupied[place >> 6U] >> (place & 63U) & 1U) != 0;
        const bool miss = !hit && (b.free[place >> 6U] >> (place & 63U) & 1U) != 0;
        if (!hit && !miss) continue;
        float& v = expected[{low.x + in.x, low.y + in.y, low.z + in.z}];
        occupied += hit ? 1 : 0;
        free += miss && v > model::clamp_min ? 1 : 0;
        v = hit ? after_hit<model>(v) : after_miss<model>(v);
      }
    log.begin_revision();
    integration_summary summary;
    apply_scan<model>(store, masks, summary, &log);
    CHECK(summary.free == free);
    CHECK(summary.occupied == occupied);
    std::size_t changed = 0, recorded = 0;
    for (const auto& [k, v] : expected) {
      const auto [x, y, z] = k;
      REQUIRE(store.value({x, y, z}) == v);
      const auto old = before.find(k);
      changed += old == before.end() || old->second != v ? 1 : 0;
    }
    log.for_each_since(log.revision() - 1, [&](const voxel_key&, std::uint64_t mask) {
      recorded += static_cast<std::size_t>(std::popcount(mask));
    });
    CHECK(recorded == changed);
  }
}

TEST_CASE("A large leaf that is saturated free is not split by misses") {
  brick_store<float> store;
  store.set_node({512, 512, 512}, 6, log_odds<>::clamp_min);
  CHECK(is_saturated_leaf<log_odds<>>(store, {520, 520, 520}));
  std::array<std::uint64_t, 8> saturated{};
  find_saturated<log_odds<>>(store, node_name({520, 520, 520}, brick_level), saturated);
  for (const std::uint64_t octant : saturated) CHECK(octant == ~std::uint64_t{0});
  scan_masks masks;
  masks.mark_free({520, 520, 520});
  integration_summary summary;
  apply_scan<log_odds<>>(store, masks, summary, nullptr);
  CHECK(store.brick_count() == 0);
  masks.mark_occupied({521, 520, 520});
  apply_scan<log_odds<>>(store, masks, summary, nullptr);
  CHECK(store.brick_count() > 0);
  CHECK(store.value({521, 520, 520}) == after_hit<log_odds<>>(log_odds<>::clamp_min));
  CHECK(store.value({520, 520, 520}) == log_odds<>::clamp_min);
}

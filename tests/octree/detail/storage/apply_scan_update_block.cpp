// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/random.hpp>
#include <orbis/octree/detail/storage/apply_scan.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

template <sensor_model M>
void check_update() {
  using value_type = typename M::value_type;
  random_bits random{3};
  octree::detail::block<value_type> b;
  for (int i = 0; i != 3000; ++i) {
    if (i % 40 == 0) {
      b = {};
      // Now and then values beyond the bounds, as a file may bring them.
      b.known = random() & random();
      for (unsigned k = 0; k != 64; ++k)
        if ((b.known >> k & 1U) != 0) b.value[k] = static_cast<value_type>(random.uniform(-7.0, 7.0));
    }
    const std::uint64_t occupied = random() & random();
    const std::uint64_t free = random() & ~occupied;
    const octree::detail::block<value_type> before = b;
    const std::uint64_t changed = update_block<M>(b, free, occupied);
    REQUIRE(b.known == (before.known | free | occupied));
    for (unsigned k = 0; k != 64; ++k) {
      const value_type v = before.value[k];
      const bool hit = (occupied >> k & 1U) != 0, miss = (free >> k & 1U) != 0;
      const value_type expected = hit ? after_hit<M>(v) : miss ? after_miss<M>(v) : v;
      REQUIRE(b.value[k] == expected);
      const bool is_new = (b.known >> k & 1U) != (before.known >> k & 1U);
      REQUIRE((changed >> k & 1U) == std::uint64_t{is_new || expected != v});
    }
  }
}

}  // namespace

TEST_CASE("Sixty-four voxels at once get what one voxel would get at every instruction set") {
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    check_update<log_odds<float>>();
    check_update<log_odds<double>>();
  }
}

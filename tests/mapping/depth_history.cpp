// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include <orbis/core/image.hpp>
#include <orbis/mapping/depth_history.hpp>
#include <orbis/mapping/depth_store.hpp>

#include "mapping/memory_depths.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

struct without_errors {
  void put(std::uint64_t, image_view<const std::uint16_t>) {}
  void get(std::uint64_t, image<std::uint16_t>&) const {}
  void erase(std::uint64_t) {}
};

}  // namespace

static_assert(mapping::masks_depth<mapping::depth_store>);
static_assert(mapping::depth_history<test::memory_depths> && !mapping::masks_depth<test::memory_depths>);
static_assert(!mapping::depth_history<without_errors> && !mapping::depth_history<int>);

TEMPLATE_TEST_CASE("a history returns the last image of a frame until it is erased", "", mapping::depth_store,
                   test::memory_depths) {
  TestType store;
  image<std::uint16_t> out, first(4, 3, 1000), second(5, 2, 2000);
  CHECK_FALSE(store.get(7, out));
  REQUIRE(store.put(7, first));
  REQUIRE(store.put(9, second));
  REQUIRE(store.get(7, out));
  CHECK(out == first);
  REQUIRE(store.put(7, second));
  first(0, 0) = 1;  // the store has a copy
  REQUIRE(store.get(7, out));
  CHECK(out == second);
  store.erase(7);
  store.erase(8);
  CHECK_FALSE(store.get(7, out));
  REQUIRE(store.get(9, out));
  CHECK(out == second);
}

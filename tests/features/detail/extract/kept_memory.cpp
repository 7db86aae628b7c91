// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include <orbis/features/detail/extract/kept_memory.hpp>

#include "support/catch.hpp"

using namespace orbis::features;
using namespace orbis::features::detail;

TEST_CASE("memory given back is taken again, copies have their own") {
  kept_memory<std::vector<int>> kept;
  auto a = kept.take();
  auto b = kept.take();
  CHECK(a != b);
  a->push_back(7);
  const auto* first = a.get();
  kept.give(std::move(a));
  const kept_memory<std::vector<int>> copy{kept};
  auto again = kept.take();
  CHECK(again.get() == first);
  CHECK(again->size() == 1);
  auto other = kept_memory<std::vector<int>>{copy}.take();
  CHECK(other->empty());
}

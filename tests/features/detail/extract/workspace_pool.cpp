// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include <orbis/features/detail/extract/workspace_pool.hpp>

#include "support/catch.hpp"

using namespace orbis::features;
using namespace orbis::features::detail;

TEST_CASE("released workspaces are reused, and copies of the pool are empty") {
  workspace_pool<std::vector<int>> pool;
  auto a = pool.acquire();
  auto b = pool.acquire();
  CHECK(a != b);
  a->push_back(7);
  const auto* first = a.get();
  pool.release(std::move(a));
  const workspace_pool<std::vector<int>> copy{pool};
  auto again = pool.acquire();
  CHECK(again.get() == first);
  CHECK(again->size() == 1);
  auto other = workspace_pool<std::vector<int>>{copy}.acquire();
  CHECK(other->empty());
}

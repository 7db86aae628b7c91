// error: execution_policy
// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>

#include <orbis/core/execution.hpp>

void f() {
  orbis::for_each_index(4, 100, 10, [](std::size_t) {});
}

// SPDX-License-Identifier: BSD-3-Clause
#include "adjust.hpp"

int adjust_convex(const settings& s, orbis::io::bal_problem& problem) {
  if (s.loss == "huber") return adjust(s, problem, optimize::huber{s.width});
  return adjust(s, problem, optimize::trivial{});
}

// SPDX-License-Identifier: BSD-3-Clause
#include "adjust.hpp"

int adjust_redescending(const settings& s, orbis::io::bal_problem& problem) {
  if (s.loss == "cauchy") return adjust(s, problem, optimize::cauchy{s.width});
  return adjust(s, problem, optimize::tukey{s.width});
}

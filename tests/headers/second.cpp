// SPDX-License-Identifier: BSD-3-Clause
#include "everything.hpp"

int second();
int second() { return static_cast<int>(orbis::seq.threads()); }

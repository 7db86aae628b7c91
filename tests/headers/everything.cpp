// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/orbis.hpp>

#include "everything.hpp"

extern "C" unsigned first();

extern "C" unsigned first() { return orbis::seq.threads(); }

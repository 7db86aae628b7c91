// SPDX-License-Identifier: BSD-3-Clause
#include "support/count_allocations.hpp"  // counts for this executable

// SPDX-License-Identifier: BSD-3-Clause
#include "optimize/allocations.cpp"  // counts for this executable

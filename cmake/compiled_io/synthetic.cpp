// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/io/detail/compiled/synthetic_functions.hpp>

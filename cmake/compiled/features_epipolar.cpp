// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/features/detail/compiled/epipolar_functions.hpp>

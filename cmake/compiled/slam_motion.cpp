// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/detail/compiled/alignment_functions.hpp>
#include <orbis/slam/detail/compiled/motion_refinement_functions.hpp>
#include <orbis/slam/detail/compiled/shutter_estimation_functions.hpp>

// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/optimize/detail/compiled/triangulation_functions.hpp>
#include <orbis/optimize/detail/compiled/two_view_functions.hpp>
#include <orbis/optimize/detail/compiled/two_view_reconstruction_functions.hpp>

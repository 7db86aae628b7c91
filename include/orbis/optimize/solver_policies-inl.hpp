// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of solver_policies.hpp.
#pragma once

#include <orbis/optimize/detail/sparse/reduced_solvers.hpp>
#include <orbis/optimize/solver_policies.hpp>

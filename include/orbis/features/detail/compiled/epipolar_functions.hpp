// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of epipolar_geometry.hpp: inline, or, with ORBIS_COMPILED, compiled once, by
/// cmake/compiled/features_epipolar.cpp.
#pragma once

#include <Eigen/LU>

#include <orbis/core/compiled_once.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/epipolar_geometry.hpp>

namespace orbis::features {

ORBIS_COMPILED_ONCE fundamental_geometry::fundamental_geometry(const mat3& K_query, const mat3& K_train,
                                                               const se3& T_train_query)
    : fundamental_geometry{transposed(inverse(K_train)) * essential(T_train_query) * inverse(K_query)} {}

}  // namespace orbis::features

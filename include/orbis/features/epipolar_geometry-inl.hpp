// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of epipolar_geometry.hpp.
#pragma once

#include <orbis/core/inline.hpp>
#include <orbis/features/epipolar_geometry.hpp>

namespace orbis::features {

ORBIS_INLINE fundamental_geometry::fundamental_geometry(const mat3& K_query, const mat3& K_train,
                                                        const se3& T_train_query)
    : fundamental_geometry{transposed(inverse(K_train)) * essential(T_train_query) * inverse(K_query)} {}

}  // namespace orbis::features

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Short names for fixed-size vectors and matrices whose layout does not depend on compiler flags.
///
/// `alignof(Eigen::Vector4d)` is 16 or 32 depending on `-mavx2`, so a struct that stores one may have two layouts in
/// one program. Every size that Eigen would align is therefore declared unaligned (`orbis::matrix`).
#pragma once

#include <type_traits>

#include <Eigen/Core>

#include <orbis/core/small_matrix.hpp>

namespace orbis {

using vec2 = matrix<2>;
using vec3 = matrix<3>;
using vec4 = matrix<4>;
using vec6 = matrix<6>;
using vec7 = matrix<7>;
using vec2f = matrix<2, 1, float>;
using vec3f = matrix<3, 1, float>;
using mat2 = matrix<2, 2>;
using mat3 = matrix<3, 3>;
using mat4 = matrix<4, 4>;
using mat6 = matrix<6, 6>;

static_assert(std::is_same_v<vec3, Eigen::Vector3d>);
static_assert(alignof(vec4) == alignof(double) && alignof(vec2f) == alignof(float));

}  // namespace orbis

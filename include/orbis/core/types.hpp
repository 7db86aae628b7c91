// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Fixed-size vectors and matrices whose layout does not depend on compiler flags.
///
/// `alignof(Eigen::Vector4d)` is 16 or 32 depending on `-mavx2`; a struct that stores one has two
/// layouts in one program. Every size Eigen would align is therefore declared unaligned here.
#pragma once

#include <Eigen/Core>

namespace orbis {

/// An `R x C` matrix of `S`; the same layout under every `-m` flag. Sizes that Eigen never aligns
/// stay the plain Eigen type, so `vec3` *is* `Eigen::Vector3d`.
template <int R, int C = 1, class S = double>
using matrix =
    Eigen::Matrix<S, R, C,
                  ((R == 1 && C != 1) ? Eigen::RowMajor : Eigen::ColMajor) |
                      ((static_cast<unsigned>(R * C) * sizeof(S)) % 16 == 0 ? Eigen::DontAlign : Eigen::AutoAlign)>;

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

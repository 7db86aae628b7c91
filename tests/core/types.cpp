// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/types.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("vectors and matrices are laid out as arrays of numbers under every instruction set") {
  static_assert(alignof(vec2) == 8 && sizeof(vec2) == 16);
  static_assert(alignof(vec4) == 8 && sizeof(vec4) == 32);
  static_assert(alignof(mat2) == 8 && alignof(mat4) == 8 && alignof(mat6) == 8);
  static_assert(alignof(matrix<4, 1, float>) == 4 && alignof(matrix<2, 1, float>) == 4);
  static_assert(alignof(matrix<8, 1, float>) == 4 && alignof(matrix<1, 4>) == 8 && alignof(matrix<2, 3>) == 8);
  static_assert(alignof(se3) == 8 && sizeof(se3) == 7 * 8 && alignof(sim3) == 8 && sizeof(sim3) == 8 * 8);
  static_assert(alignof(basic_se3<float>) == 4 && sizeof(basic_se3<float>) == 7 * 4);
  CHECK((vec2{1, 2} + vec2{3, 4}) == vec2{4, 6});
}

TEST_CASE("rows and columns multiply to numbers") {
  const matrix<1, 4> row = vec4{1, 2, 3, 4}.transpose();
  CHECK((row * vec4{1, 1, 1, 1}).value() == 10.0);
}

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What all components share.
///
/// | header | what it is for |
/// | --- | --- |
/// | `types.hpp` | short names for vectors and matrices |
/// | `so3.hpp, se3.hpp, sim3.hpp` | rotations, poses, similarities: Lie groups with exp and log |
/// | `small_matrix.hpp` | arithmetic of fixed-size matrices that compiles fast |
/// | `small_cholesky.hpp` | normal equations of a few unknowns |
/// | `jacobi.hpp` | eigenvalues and singular values of small matrices, the rotation nearest to a matrix |
/// | `thread_pool.hpp` | threads that wait for the loops of a policy |
/// | `trajectory.hpp` | poses with times, poses between them, pairs of time stamps |
/// | `point.hpp, point_cloud.hpp` | how algorithms read any point type in place; points with colours |
/// | `inline.hpp` | for authors of components: marks the functions of -inl files |
/// | `image.hpp` | images and views of images |
/// | `execution.hpp` | policies for threads (`seq`, `par`), progress, cancellation |
/// | `result.hpp, file.hpp` | values or errors; whole files |
/// | `random.hpp` | random numbers, the same on every machine |
/// | `rounded.hpp` | products that no sum is fused with; sines that are the same bits everywhere |
/// | `simd.hpp` | vector kernels, written once for every instruction set |
/// | `hash_index.hpp, cow_pages.hpp` | hash tables from keys to positions; arrays whose copies share pages |
/// | `bits.hpp, bytes.hpp` | counts and strings of bits; byte orders, checksums, bytes as text |
/// | `utf8.hpp` | whether bytes are text in UTF-8 |
#pragma once

#include <orbis/core/bits.hpp>
#include <orbis/core/bytes.hpp>
#include <orbis/core/cow_pages.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/hash_index.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/small_matrix.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/thread_pool.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/core/types.hpp>
#include <orbis/core/utf8.hpp>

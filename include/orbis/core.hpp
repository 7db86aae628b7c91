// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Types and utilities shared by all components.
///
/// | header | contents |
/// | --- | --- |
/// | `types.hpp` | short names for vectors and matrices |
/// | `so3.hpp, se3.hpp, sim3.hpp` | rotations, poses, similarities: Lie groups with exp and log |
/// | `small_matrix.hpp` | arithmetic on fixed-size matrices that compiles fast |
/// | `small_cholesky.hpp` | Cholesky solver for normal equations with few unknowns |
/// | `jacobi.hpp` | eigenvalues and singular values of small matrices, nearest rotation to a matrix |
/// | `thread_pool.hpp` | persistent worker threads for parallel loops |
/// | `trajectory.hpp` | stamped poses, pose interpolation, association of time stamps |
/// | `point.hpp, point_cloud.hpp` | in-place access to any point type; a point cloud with colours |
/// | `inline.hpp` | marks functions that are defined in -inl files; for authors of components |
/// | `image.hpp` | images and image views |
/// | `execution.hpp` | execution policies (`seq`, `par`), progress, cancellation |
/// | `result.hpp, file.hpp` | values or errors; reading and writing whole files |
/// | `random.hpp` | random numbers that are the same on every machine |
/// | `rounded.hpp` | products that are never fused with a sum; bitwise reproducible sines and cosines |
/// | `simd.hpp` | SIMD kernels, written once for all instruction sets |
/// | `hash_index.hpp, cow_pages.hpp` | hash tables from keys to positions; copy-on-write arrays |
/// | `bits.hpp, bytes.hpp` | bit counts and bit strings; byte orders, checksums, base-85 text |
/// | `quote.hpp` | short quotations for messages |
/// | `utf8.hpp` | validation of UTF-8 |
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
#include <orbis/core/quote.hpp>
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

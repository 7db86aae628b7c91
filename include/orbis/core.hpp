// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What all components share.
///
/// | header | what it is for |
/// | --- | --- |
/// | `types.hpp` | short names for vectors and matrices |
/// | `so3.hpp, se3.hpp, sim3.hpp` | rotations, poses, similarities: Lie groups with exp and log |
/// | `rotation.hpp` | the rotation nearest to a matrix |
/// | `trajectory.hpp` | poses with times, poses between them, pairs of time stamps |
/// | `point.hpp` | how algorithms read any point type in place |
/// | `point_cloud.hpp, strided_points.hpp` | points with colours; points in a buffer at regular distances |
/// | `image.hpp` | images and views of images |
/// | `execution.hpp` | policies for threads: `seq`, `par` |
/// | `progress.hpp` | callbacks for progress and cancellation |
/// | `result.hpp, file.hpp` | values or errors; whole files |
/// | `random.hpp, portable_sine.hpp` | random numbers and sines that are the same bits everywhere |
/// | `jacobi.hpp` | eigenvalues and singular values of small matrices |
/// | `simd.hpp` | vector kernels, written once for every instruction set; `lanes.hpp`: eight doubles |
/// | `rounded.hpp` | products that no sum is fused with |
/// | `hash_index.hpp` | hash tables from keys to positions |
/// | `bits.hpp, bit_string.hpp, base85.hpp, crc32c.hpp` | counts of bits and byte orders; strings of bits; text for binary data; checksums |
#pragma once

#include <orbis/core/base85.hpp>
#include <orbis/core/bit_string.hpp>
#include <orbis/core/bits.hpp>
#include <orbis/core/crc32c.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/hash_index.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/lanes.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/portable_sine.hpp>
#include <orbis/core/progress.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/rotation.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/strided_points.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/core/types.hpp>

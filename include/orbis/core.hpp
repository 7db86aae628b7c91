// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The vocabulary of all components.
#pragma once

#include <orbis/core/base85.hpp>
#include <orbis/core/bit_string.hpp>
#include <orbis/core/bits.hpp>
#include <orbis/core/crc32c.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/file.hpp>
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

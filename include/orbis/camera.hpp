// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Camera models, depth images and rays.
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/camera/cloud.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/parameters.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/presets.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/camera/undistort.hpp>
#include <orbis/camera/world_point.hpp>

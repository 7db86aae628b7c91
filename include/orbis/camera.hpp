// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Camera models, depth images and rays.
///
/// | header | contents |
/// | --- | --- |
/// | `model.hpp` | the concept `camera_model` |
/// | `intrinsics.hpp` | image size and camera matrix |
/// | `pinhole.hpp, radial_tangential.hpp, kannala_brandt.hpp` | the camera models |
/// | `plausible.hpp` | plausibility bounds of camera parameters read from files |
/// | `any.hpp` | a camera whose model is only known at run time |
/// | `parameters.hpp` | camera parameters and derivatives with respect to them, for calibration |
/// | `presets.hpp, settings.hpp` | cameras of common public recordings; the contents of `camera.toml` |
/// | `depth.hpp, rgbd_frame.hpp` | depth images; a colour image with its depth image |
/// | `rays.hpp, world_point.hpp, cloud.hpp` | rays through pixels; conversion of pixels and of depth images to points |
/// | `shutter.hpp, shutter_correction.hpp` | rolling-shutter timing; conversion to global-shutter images |
/// | `depth_clock.hpp` | times of depth images relative to colour images, from their time stamps |
/// | `undistort.hpp` | removal of lens distortion from images |
/// | `stereo.hpp, stereo_frame.hpp` | stereo rigs and their rectification; a pair of stereo images |
/// | `mono_frame.hpp` | the image of a monocular camera |
/// | `project_lanes.hpp` | projection of eight points at a time, for inner loops; include it separately |
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/camera/cloud.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/depth_clock.hpp>
#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/mono_frame.hpp>
#include <orbis/camera/parameters.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/plausible.hpp>
#include <orbis/camera/presets.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/camera/shutter_correction.hpp>
#include <orbis/camera/stereo.hpp>
#include <orbis/camera/stereo_frame.hpp>
#include <orbis/camera/undistort.hpp>
#include <orbis/camera/world_point.hpp>

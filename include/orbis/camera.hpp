// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Camera models, depth images and rays.
///
/// | header | what it is for |
/// | --- | --- |
/// | `model.hpp` | the concept `camera_model` |
/// | `intrinsics.hpp` | image size and camera matrix |
/// | `pinhole.hpp, radial_tangential.hpp, kannala_brandt.hpp` | the camera models |
/// | `any.hpp` | a camera whose model is known at run time only |
/// | `parameters.hpp` | parameters of a camera and derivatives by them, for calibration |
/// | `presets.hpp, settings.hpp` | the cameras of the usual recordings; what `camera.toml` says |
/// | `depth.hpp, rgbd_frame.hpp` | depth images; a colour image with its depth image |
/// | `rays.hpp, world_point.hpp, cloud.hpp` | rays of pixels; points of pixels in the world; points of a depth image |
/// | `shutter.hpp, shutter_correction.hpp` | when the rows of the images are taken; images as if that were at once |
/// | `undistort.hpp` | images without distortion |
/// | `stereo.hpp, stereo_frame.hpp` | two cameras side by side and their rectification; their two images |
/// | `mono_frame.hpp` | the image of a single camera |
/// | `project_lanes.hpp` | eight points at a time, for adjustments; to be included by itself |
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/camera/cloud.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/mono_frame.hpp>
#include <orbis/camera/parameters.hpp>
#include <orbis/camera/pinhole.hpp>
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

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Synthetic recordings: a furnished room, a hand-held camera, and the truth about both.
///
/// @code
///   orbis::io::synthetic_recording room{{.frames = 300, .seed = 7}};
///   for (const orbis::camera::rgbd_frame& frame : room) slam.track(frame);
///   double error = room.scene().distance(point_of_the_map);
/// @endcode
#pragma once

#include <orbis/io/synthetic/arithmetic.hpp>
#include <orbis/io/synthetic/building.hpp>
#include <orbis/io/synthetic/bundle.hpp>
#include <orbis/io/synthetic/canvas.hpp>
#include <orbis/io/synthetic/effects.hpp>
#include <orbis/io/synthetic/path.hpp>
#include <orbis/io/synthetic/pose_graph.hpp>
#include <orbis/io/synthetic/read_ahead.hpp>
#include <orbis/io/synthetic/recording.hpp>
#include <orbis/io/synthetic/renderer.hpp>
#include <orbis/io/synthetic/scene.hpp>
#include <orbis/io/synthetic/sensor.hpp>
#include <orbis/io/synthetic/sequence.hpp>
#include <orbis/io/synthetic/solid.hpp>
#include <orbis/io/synthetic/studio.hpp>
#include <orbis/io/synthetic/texture.hpp>
#include <orbis/io/synthetic/walk.hpp>
#include <orbis/io/synthetic/world.hpp>

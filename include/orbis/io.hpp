// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reading and writing: images, cameras, recordings, trajectories, clouds.
#pragma once

#include <orbis/io/bal.hpp>
#include <orbis/io/camera_file.hpp>
#include <orbis/io/cloud_file.hpp>
#include <orbis/io/g2o.hpp>
#include <orbis/io/icl_nuim.hpp>
#include <orbis/io/image.hpp>
#include <orbis/io/jpeg.hpp>
#include <orbis/io/pcd.hpp>
#include <orbis/io/ply.hpp>
#include <orbis/io/png.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/seven_scenes.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/io/trajectory_file.hpp>
#include <orbis/io/tum.hpp>

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reading and writing: images, cameras, recordings, trajectories, clouds, optimisation problems.
///
/// | header                | what it is for                                                                   |
/// | --------------------- | -------------------------------------------------------------------------------- |
/// | `recording.hpp`       | RGB-D recordings in the layouts of TUM RGB-D, 7-Scenes, ICL-NUIM and ScanNet     |
/// | `stereo_recording.hpp` | stereo recordings in the layouts of KITTI odometry and ASL (EuRoC), or of two folders |
/// | `mono_recording.hpp`  | recordings of one camera: in the layouts above, or plain folders of images       |
/// | `synthetic.hpp`       | a recording rendered on the fly, whose poses and surfaces are known exactly      |
/// | `synthetic_options.hpp` | its room, its camera's path and its sensor's errors                            |
/// | `camera_file.hpp`     | `camera.toml`: model, size, intrinsics, distortion, depth scale                  |
/// | `toml.hpp`            | settings in TOML from bytes that nobody has looked at; not included here, as it brings
/// toml++ | | `trajectory_file.hpp` | trajectories in TUM format | | `image.hpp`           | colour and depth images,
/// whatever their format                                   | | `png.hpp`, `jpeg.hpp` | images of one format, read and
/// written                                           | | `cloud_file.hpp`      | point clouds, whatever their format |
/// | `ply.hpp`, `pcd.hpp`  | point clouds of one format, read and written                                     |
/// | `bal_problem.hpp`, `bal.hpp` | bundle adjustment problems ("bundle adjustment in the large"); their files |
/// | `g2o_graph.hpp`, `g2o.hpp` | pose graphs; their files                                                    |
#pragma once

#include <orbis/io/bal.hpp>
#include <orbis/io/bal_problem.hpp>
#include <orbis/io/camera_file.hpp>
#include <orbis/io/cloud_file.hpp>
#include <orbis/io/g2o.hpp>
#include <orbis/io/g2o_graph.hpp>
#include <orbis/io/image.hpp>
#include <orbis/io/jpeg.hpp>
#include <orbis/io/mono_recording.hpp>
#include <orbis/io/pcd.hpp>
#include <orbis/io/ply.hpp>
#include <orbis/io/png.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/stereo_recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/io/synthetic_options.hpp>
#include <orbis/io/trajectory_file.hpp>

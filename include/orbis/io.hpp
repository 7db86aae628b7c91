// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reading and writing: images, cameras, recordings, trajectories, clouds, optimisation problems.
///
/// | header | contents |
/// | --- | --- |
/// | `recording.hpp` | RGB-D recordings in the layouts of TUM RGB-D, 7-Scenes, ICL-NUIM and ScanNet |
/// | `stereo_recording.hpp` | stereo recordings in the layouts of KITTI odometry and ASL (EuRoC), or in two folders |
/// | `mono_recording.hpp` | recordings of one camera, in the layouts above or in plain folders of images |
/// | `synthetic.hpp` | a recording rendered on the fly, with exactly known poses and surfaces |
/// | `synthetic_options.hpp` | the room, camera path and sensor errors of that recording |
/// | `camera_file.hpp` | `camera.toml`: model, size, intrinsics, distortion, depth scale |
/// | `toml.hpp` | settings in TOML from untrusted bytes; not included here, because it includes toml++ |
/// | `trajectory_file.hpp` | trajectories in TUM format, and readers for the EuRoC and KITTI formats |
/// | `trajectory_reading.hpp` | a trajectory from a file, with notes about lost poses, repeated times and units |
/// | `image.hpp` | colour and depth images in any supported format |
/// | `png.hpp`, `jpeg.hpp` | reading and writing images of one format |
/// | `cloud_file.hpp` | point clouds in any supported format |
/// | `cloud_fields.hpp` | a cloud with all fields of its file: intensity, normals, time |
/// | `ply.hpp`, `pcd.hpp` | reading and writing point clouds of one format |
/// | `bal_problem.hpp`, `bal.hpp` | bundle adjustment problems ("bundle adjustment in the large") and their files |
/// | `g2o_graph.hpp`, `g2o.hpp` | pose graphs and their files |
#pragma once

#include <orbis/io/bal.hpp>
#include <orbis/io/bal_problem.hpp>
#include <orbis/io/camera_file.hpp>
#include <orbis/io/cloud_fields.hpp>
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
#include <orbis/io/trajectory_reading.hpp>

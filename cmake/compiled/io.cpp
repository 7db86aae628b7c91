// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/io/bal-inl.hpp>
#include <orbis/io/cloud_file-inl.hpp>
#include <orbis/io/g2o-inl.hpp>
#include <orbis/io/image-inl.hpp>
#include <orbis/io/jpeg-inl.hpp>
#include <orbis/io/pcd-inl.hpp>
#include <orbis/io/ply-inl.hpp>
#include <orbis/io/png-inl.hpp>
#include <orbis/io/trajectory_file-inl.hpp>

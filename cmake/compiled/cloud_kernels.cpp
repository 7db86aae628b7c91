// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_INSTANTIATE_KERNELS
#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/rank_sort.hpp>
#include <orbis/cloud/detail/rays/depth_rows.hpp>
#include <orbis/cloud/detail/rays/ray_kernels.hpp>
#include <orbis/cloud/detail/select/local_shape.hpp>
#include <orbis/cloud/flying_pixels.hpp>

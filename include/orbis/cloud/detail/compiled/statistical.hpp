// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of statistical.hpp, see select.hpp beside this file.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/types.hpp>

#ifndef ORBIS_INSTANTIATE_CLOUD
#define ORBIS_INSTANTIATE_CLOUD extern template
#endif

namespace orbis::cloud {

#define ORBIS_INSTANTIATE_STATISTICAL(policy, ...)                                                                 \
  ORBIS_INSTANTIATE_CLOUD neighbor_table all_knn(const policy&, const std::vector<__VA_ARGS__>&, std::size_t);     \
  ORBIS_INSTANTIATE_CLOUD std::vector<float> all_mean_knn_distance(const policy&, const std::vector<__VA_ARGS__>&, \
                                                                   std::size_t);                                   \
  ORBIS_INSTANTIATE_CLOUD statistical_result statistical_filter(const policy&, const std::vector<__VA_ARGS__>&,    \
                                                                const statistical_options&);
ORBIS_INSTANTIATE_STATISTICAL(sequential_policy, std::array<float, 3>)
ORBIS_INSTANTIATE_STATISTICAL(sequential_policy, vec3f)
ORBIS_INSTANTIATE_STATISTICAL(parallel_policy, std::array<float, 3>)
ORBIS_INSTANTIATE_STATISTICAL(parallel_policy, vec3f)
#undef ORBIS_INSTANTIATE_STATISTICAL

}  // namespace orbis::cloud

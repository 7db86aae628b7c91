// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of select.hpp. Its users declare it only; cmake/compiled/cloud.cpp defines
/// ORBIS_INSTANTIATE_CLOUD as `template` and makes it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <orbis/cloud/cluster.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/select/density_judge.hpp>
#include <orbis/cloud/detail/select/surroundings.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/filter_choice.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/types.hpp>

#ifndef ORBIS_INSTANTIATE_CLOUD
#define ORBIS_INSTANTIATE_CLOUD extern template
#endif

namespace orbis::cloud {

#define ORBIS_INSTANTIATE_JUDGE(policy)                                                                          \
  ORBIS_INSTANTIATE_CLOUD void detail::surroundings::measure(const policy&, detail::leaf_hierarchy, std::size_t, \
                                                             std::size_t);                                       \
  ORBIS_INSTANTIATE_CLOUD void detail::surroundings::apply(const policy&, const density_step&);                  \
  ORBIS_INSTANTIATE_CLOUD void detail::surroundings::apply(const policy&, const isolation_step&);                \
  ORBIS_INSTANTIATE_CLOUD void detail::surroundings::apply(const policy&, const cluster_options&);               \
  ORBIS_INSTANTIATE_CLOUD void detail::judge_points(const policy&, detail::surroundings&, const select_options&, \
                                                    filter_choice&, std::vector<std::string>&);
ORBIS_INSTANTIATE_JUDGE(sequential_policy)
ORBIS_INSTANTIATE_JUDGE(parallel_policy)
#undef ORBIS_INSTANTIATE_JUDGE

#define ORBIS_INSTANTIATE_SELECT(policy, ...)                                                                     \
  ORBIS_INSTANTIATE_CLOUD automatic_result filter_automatically(const policy&, const std::vector<__VA_ARGS__>&,   \
                                                                const select_options&);                           \
  ORBIS_INSTANTIATE_CLOUD std::vector<std::uint32_t> apply_filter(const policy&, const std::vector<__VA_ARGS__>&, \
                                                                  const filter_chain&, const select_options&);
ORBIS_INSTANTIATE_SELECT(sequential_policy, std::array<float, 3>)
ORBIS_INSTANTIATE_SELECT(sequential_policy, vec3f)
ORBIS_INSTANTIATE_SELECT(parallel_policy, std::array<float, 3>)
ORBIS_INSTANTIATE_SELECT(parallel_policy, vec3f)
#undef ORBIS_INSTANTIATE_SELECT

}  // namespace orbis::cloud

// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/cloud/voxel_grid-inl.hpp>

namespace orbis::cloud::detail {

using policy = parallel_policy;  // the policy that all others convert to
template <class S>
using view = basic_point_view<S>;

template point_cloud find_centroids(const policy&, const view<float>&, std::span<const rgb8>, double);
template point_cloud find_centroids(const policy&, const view<double>&, std::span<const rgb8>, double);
template std::vector<std::uint32_t> choose_in_voxels(const policy&, const view<float>&, double, const voxel_first&);
template std::vector<std::uint32_t> choose_in_voxels(const policy&, const view<double>&, double, const voxel_first&);
template std::vector<std::uint32_t> choose_in_voxels(const policy&, const view<float>&, double, const voxel_random&);
template std::vector<std::uint32_t> choose_in_voxels(const policy&, const view<double>&, double, const voxel_random&);
template std::vector<std::uint32_t> choose_in_voxels(const policy&, const view<float>&, double, const any_choice&);
template std::vector<std::uint32_t> choose_in_voxels(const policy&, const view<double>&, double, const any_choice&);

}  // namespace orbis::cloud::detail

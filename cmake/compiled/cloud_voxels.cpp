// SPDX-License-Identifier: BSD-3-Clause
#include <span>

#include <orbis/cloud/voxel_grid-inl.hpp>

namespace orbis::cloud::detail {

using policy = parallel_policy;  // the policy to which all others are converted
template <class S>
using view = basic_point_view<S>;

template point_cloud find_centroids(const policy&, const view<float>&, std::span<const rgb8>, double);
template point_cloud find_centroids(const policy&, const view<double>&, std::span<const rgb8>, double);

}  // namespace orbis::cloud::detail

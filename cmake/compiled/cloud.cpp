// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/cloud/all_knn-inl.hpp>
#include <orbis/cloud/cluster-inl.hpp>
#include <orbis/cloud/depth_smoothing-inl.hpp>
#include <orbis/cloud/flying_pixels-inl.hpp>
#include <orbis/cloud/log_statistical-inl.hpp>
#include <orbis/cloud/radius-inl.hpp>
#include <orbis/cloud/ray_evidence-inl.hpp>
#include <orbis/cloud/select-inl.hpp>
#include <orbis/cloud/smeared_edges-inl.hpp>
#include <orbis/cloud/statistical-inl.hpp>

namespace orbis::cloud::detail {

using policy = parallel_policy;  // the policy to which all others are converted

template neighbor_table find_all_knn(const policy&, const point_view&, std::size_t);
template std::vector<float> find_mean_distances(const policy&, const point_view&, std::size_t);
template statistical_result filter_statistically(const policy&, const point_view&, const statistical_options&);
template range_statistical_result filter_by_range(const policy&, const point_view&, std::span<const float>,
                                                  const range_statistical_options&);
template log_statistical_result filter_by_logarithm(const policy&, const point_view&, const log_statistical_options&);
template std::vector<std::uint32_t> find_radius_inliers(const policy&, const point_view&, const radius_options&);
template cluster_result filter_clusters(const policy&, const point_view&, const cluster_options&);
template automatic_result choose_and_filter(const policy&, const point_view&, std::span<const float>,
                                            const select_options&, const view_judge&);
template flying_pixel_count read_without_flying_pixels(const policy&, const depth_row_reader&, image_view<float>,
                                                       const flying_pixel_options&, flying_pixel_workspace&);
template std::size_t read_without_smeared_edges(const policy&, const depth_row_reader&, image_view<float>,
                                                const smeared_edge_options&, smeared_edge_workspace&);
template void write_smoothed_depth(const policy&, const depth_row_reader&, image_view<float>,
                                   const depth_smoothing_options&, image<float>&);

}  // namespace orbis::cloud::detail

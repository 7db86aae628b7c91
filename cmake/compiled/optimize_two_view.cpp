// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <span>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/alignment-inl.hpp>
#include <orbis/optimize/triangulation-inl.hpp>
#include <orbis/optimize/two_view-inl.hpp>

namespace orbis::optimize {

template result<alignment_estimate<se3>> detail::align_vectors(std::span<const vec3>, std::span<const vec3>,
                                                               const alignment_options&);
template result<alignment_estimate<sim3>> detail::align_vectors(std::span<const vec3>, std::span<const vec3>,
                                                                const alignment_options&);
template triangulation detail::triangulate_all(std::span<const se3>, std::span<const vec3>,
                                               const triangulation_options&);
template result<homography_estimate> estimate_homography(std::span<const vec2>, std::span<const vec2>,
                                                         const homography_options&);
template result<relative_pose_estimate> detail::essential_of_matches(const std::vector<detail::image_match>&,
                                                                     std::size_t, const essential_options&);
template result<two_view_reconstruction> detail::reconstruction_of_matches(const std::vector<detail::image_match>&,
                                                                           std::size_t, const two_view_options&);

}  // namespace orbis::optimize

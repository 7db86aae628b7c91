// SPDX-License-Identifier: BSD-3-Clause
#include <optional>

#include <orbis/nav/floor_cost-inl.hpp>
#include <orbis/nav/floor_file-inl.hpp>
#include <orbis/nav/floor_map-inl.hpp>
#include <orbis/nav/robot_trajectory-inl.hpp>
#include <orbis/nav/squared_distances-inl.hpp>
#include <orbis/octree/occupancy_octree.hpp>

namespace orbis::nav {

template std::optional<double> find_floor(const octree::occupancy_octree<>&);
template result<floor_map> make_floor_map(const octree::occupancy_octree<>&, const ground_robot&,
                                          const floor_map_options&);

}  // namespace orbis::nav

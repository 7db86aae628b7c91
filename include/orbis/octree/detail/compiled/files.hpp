// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of files.hpp, see occupancy_octree.hpp beside this file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include <orbis/core/result.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#ifndef ORBIS_INSTANTIATE_OCTREE
#define ORBIS_INSTANTIATE_OCTREE extern template
#endif

namespace orbis::octree {

ORBIS_INSTANTIATE_OCTREE result<void> write_bt(const occupancy_octree<>&, const std::filesystem::path&);
ORBIS_INSTANTIATE_OCTREE result<void> write_ot(const occupancy_octree<>&, const std::filesystem::path&);
ORBIS_INSTANTIATE_OCTREE std::string bt_bytes(const occupancy_octree<>&);
ORBIS_INSTANTIATE_OCTREE std::string ot_bytes(const occupancy_octree<>&);
ORBIS_INSTANTIATE_OCTREE result<occupancy_octree<>> read_bt<log_odds<>>(std::span<const std::byte>, const std::string&);
ORBIS_INSTANTIATE_OCTREE result<occupancy_octree<>> read_ot<log_odds<>>(std::span<const std::byte>, const std::string&);
ORBIS_INSTANTIATE_OCTREE result<occupancy_octree<>> read_bt<log_odds<>>(const std::filesystem::path&);
ORBIS_INSTANTIATE_OCTREE result<occupancy_octree<>> read_ot<log_odds<>>(const std::filesystem::path&);

}  // namespace orbis::octree

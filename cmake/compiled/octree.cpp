// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/octree/files-inl.hpp>
#include <orbis/octree/occupancy_octree-inl.hpp>

namespace orbis::octree {

using options = integration_options;

template class detail::brick_store<float>;
template void detail::find_palette(const detail::block<float>&, detail::palette<float>&) noexcept;
template void detail::expand_palette(const float*, const std::uint64_t*, unsigned, detail::block<float>&) noexcept;

template class occupancy_octree<>;
#define ORBIS_INSTANTIATE_DEPTH(stored, model)                      \
  template integration_summary occupancy_octree<>::integrate_depth( \
      const parallel_policy&, const camera::depth_view<stored>&, const camera::model&, const se3&, const options&)
ORBIS_INSTANTIATE_DEPTH(std::uint16_t, pinhole);
ORBIS_INSTANTIATE_DEPTH(std::uint16_t, any_camera);
ORBIS_INSTANTIATE_DEPTH(float, pinhole);
ORBIS_INSTANTIATE_DEPTH(float, any_camera);

template std::string bt_bytes(const occupancy_octree<>&);
template std::string ot_bytes(const occupancy_octree<>&);
template result<void> write_bt(const occupancy_octree<>&, const std::filesystem::path&);
template result<void> write_ot(const occupancy_octree<>&, const std::filesystem::path&);
template result<occupancy_octree<>> read_bt<log_odds<>>(std::span<const std::byte>, const std::string&);
template result<occupancy_octree<>> read_bt<log_odds<>>(const std::filesystem::path&);
template result<occupancy_octree<>> read_ot<log_odds<>>(std::span<const std::byte>, const std::string&);
template result<occupancy_octree<>> read_ot<log_odds<>>(const std::filesystem::path&);

}  // namespace orbis::octree

// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include <orbis/octree/files-inl.hpp>
#include <orbis/octree/occupancy_octree-inl.hpp>

namespace orbis::octree {

template class detail::brick_store<float>;
template void detail::find_palette(const detail::block<float>&, detail::palette<float>&) noexcept;
template void detail::expand_palette(const float*, const std::uint64_t*, unsigned, detail::block<float>&) noexcept;

template class occupancy_octree<>;

template std::string bt_bytes(const occupancy_octree<>&);
template std::string ot_bytes(const occupancy_octree<>&);
template result<void> write_bt(const occupancy_octree<>&, const std::filesystem::path&);
template result<void> write_ot(const occupancy_octree<>&, const std::filesystem::path&);
template result<occupancy_octree<>> read_bt<log_odds<>>(std::span<const std::byte>, const std::string&);
template result<occupancy_octree<>> read_bt<log_odds<>>(const std::filesystem::path&);
template result<occupancy_octree<>> read_ot<log_odds<>>(std::span<const std::byte>, const std::string&);
template result<occupancy_octree<>> read_ot<log_odds<>>(const std::filesystem::path&);

}  // namespace orbis::octree

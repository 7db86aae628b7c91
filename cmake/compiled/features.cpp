// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <span>

#include <orbis/features/brute_force-inl.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/epipolar-inl.hpp>
#include <orbis/features/grey-inl.hpp>
#include <orbis/features/orb-inl.hpp>
#include <orbis/features/pyramid-inl.hpp>
#include <orbis/features/stereo-inl.hpp>
#include <orbis/features/windowed-inl.hpp>

namespace orbis::features {

template class basic_orb_extractor<>;

using bits = binary_descriptor<256>;
template void detail::hamming_nearest(std::span<const bits>, std::span<const bits>, std::span<detail::nearest_two>,
                                      std::span<std::uint32_t>, detail::hamming_workspace&);
template void detail::hamming_listed(const bits&, std::span<const bits>, std::span<const std::uint32_t>,
                                     std::span<std::uint32_t>);

}  // namespace orbis::features

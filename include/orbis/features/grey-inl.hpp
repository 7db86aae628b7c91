// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of grey.hpp.
#pragma once

#include <cassert>
#include <cstdint>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/features/detail/extract/luma_row.hpp>
#include <orbis/features/grey.hpp>

namespace orbis::features {

ORBIS_INLINE void luma(image_view<const rgb8> from, image_view<std::uint8_t> to) {
  assert(from.width() == to.width() && from.height() == to.height());
  const auto row = simd::kernel<detail::luma_kernel, detail::luma_kernel::signature, simd::avx2>();
  for (int y = 0; y < from.height(); ++y) row(from.row(y).data(), from.width(), to.row(y).data());
}

}  // namespace orbis::features

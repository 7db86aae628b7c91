// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Loops over rows of depths for `depth_windows.hpp`, auto-vectorised and compiled for several targets. Division is the
/// only operation that rounds, so that all targets give bit-identical results.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/camera/depth.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

/// Calls `f(i)` for i = 0 ... n - 1, in groups of sixteen as far as possible: compilers vectorise loops of known length
/// at -O2.
template <class F>
[[gnu::always_inline]] inline void for_each_by_16(std::size_t n, F&& f) {
  std::size_t i = 0;
  for (; i + 16 <= n; i += 16) {
    for (std::size_t lane = 0; lane != 16; ++lane) f(i + lane);
  }
  for (; i != n; ++i) f(i);
}

/// `low[i] = min(low[i], other_low[i])`, `high[i] = max(high[i], other_high[i])`
struct widen_range {
  template <simd::target>
  static ORBIS_ALWAYS_INLINE void run(float* __restrict low, float* __restrict high, const float* other_low,
                                      const float* other_high, std::size_t n) {
    for_each_by_16(n, [&](std::size_t i) ORBIS_INLINE_LAMBDA {
      low[i] = other_low[i] < low[i] ? other_low[i] : low[i];
      high[i] = other_high[i] > high[i] ? other_high[i] : high[i];
    });
  }
};
/// Sets `x[i] = value` if it is not positive.
struct replace_zeros {
  template <simd::target>
  static ORBIS_ALWAYS_INLINE void run(float* __restrict x, float value, std::size_t n) {
    for_each_by_16(n, [&](std::size_t i) ORBIS_INLINE_LAMBDA { x[i] = x[i] > 0.0F ? x[i] : value; });
  }
};
/// Converts a row of stored depths to metres, 0 where depth is missing, as `camera::depth_view` does.
struct stored_to_metres {
  template <simd::target>
  static ORBIS_ALWAYS_INLINE void run(const std::uint16_t* stored, double scale, float least, float most,
                                      float* __restrict out, std::size_t n) {
    for_each_by_16(n, [&](std::size_t i) ORBIS_INLINE_LAMBDA {
      const auto metres = static_cast<float>(static_cast<double>(stored[i]) / scale);
      const bool valid = (stored[i] != 0) & (stored[i] != std::numeric_limits<std::uint16_t>::max()) & (metres > 0.0F) &
                         (metres >= least) & (metres <= most);
      out[i] = valid ? metres : 0.0F;
    });
  }
};

/// The loops, compiled for the best available instruction set. AVX-512 brings no gain: memory is the bottleneck.
template <class = void>
struct basic_depth_row_kernels {
  void (*widen_range)(float*, float*, const float*, const float*, std::size_t) =
      simd::kernel<detail::widen_range, void(float*, float*, const float*, const float*, std::size_t), simd::avx2>();
  void (*replace_zeros)(float*, float, std::size_t) =
      simd::kernel<detail::replace_zeros, void(float*, float, std::size_t), simd::avx2>();
  void (*to_metres)(const std::uint16_t*, double, float, float, float*, std::size_t) = simd::kernel<
      stored_to_metres, void(const std::uint16_t*, double, float, float, float*, std::size_t), simd::avx2>();
};
using depth_row_kernels = basic_depth_row_kernels<>;

/// Reads a row of any depth image in metres; 0 where depth is missing.
template <camera::depth_source Depth>
void read_depth_row(const depth_row_kernels& kernels, const Depth& depth, int y, float* out) {
  const auto width = static_cast<std::size_t>(depth.width());
  if constexpr (std::same_as<Depth, camera::depth_view<std::uint16_t>>) {
    kernels.to_metres(depth.pixels().row(y).data(), depth.scale(), depth.min_depth(), depth.max_depth(), out, width);
  } else {
    static_cast<void>(kernels);
    for (std::size_t x = 0; x != width; ++x) {
      const float z = depth(static_cast<int>(x), y);
      out[x] = z > 0.0F && z <= std::numeric_limits<float>::max() ? z : 0.0F;
    }
  }
}

}  // namespace orbis::cloud::detail

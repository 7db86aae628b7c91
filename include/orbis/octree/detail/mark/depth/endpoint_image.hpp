// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Ends of the rays of a depth image: their depth along the optical axis and their voxel.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/detail/mark/depth/depth_scan.hpp>
#include <orbis/octree/detail/mark/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/storage/node_name.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

namespace orbis::octree::detail {

/// End depths of the rays of one depth image, and the voxels that contain ends. Reuses its memory between images.
template <class = void>
class basic_endpoint_image {
 public:
  /// Reads an image: stores the depths at which rays end, and marks the voxels of used ends in `masks` as occupied.
  /// O(pixels). @pre depth and camera have the same size
  template <execution_policy Policy>
  end_counts find_ends(const Policy& policy, const depth_sensor& sensor, const depth_scan& scan, scan_masks& masks) {
    find_ = simd::kernel<find_ends_kernel, find_kernel>();
    fresh_ = simd::kernel<fresh_keys_kernel, fresh_kernel>();
    scan.fit(rays_);
    resize(rays_.width(), rays_.height());
    assert(scan.visit([&](const auto& d) { return d.width() == rays_.width() && d.height() == rays_.height(); }));
    const auto rows = static_cast<std::size_t>(rays_.height());
    const std::size_t chunks = (rows + rows_per_chunk - 1) / rows_per_chunk;
    workers_.resize(std::clamp<std::size_t>(policy.threads(), 1, std::max<std::size_t>(chunks, 1)));
    std::atomic<std::size_t> next{0};
    for_each_index(policy, workers_.size(), 1, [&](std::size_t i) {
      worker& w = workers_[i];
      w.start(stride_);
      scan_masks& marks = i == 0 ? masks : w.masks;
      for (std::size_t chunk; (chunk = next.fetch_add(1, std::memory_order_relaxed)) < chunks;) {
        w.forget_row();
        const std::size_t last = std::min(rows, (chunk + 1) * rows_per_chunk);
        for (std::size_t v = chunk * rows_per_chunk; v != last; ++v)
          add_row(w, marks, sensor, scan, static_cast<int>(v));
      }
    });
    end_counts counts;
    for (std::size_t i = 0; i != workers_.size(); ++i) {
      if (i != 0) masks.merge(workers_[i].masks);
      counts.add(workers_[i].counts);
    }
    return counts;
  }
  /// Starts an image of this size. Returns the depths of its rows, including padding, for the caller to fill in.
  [[nodiscard]] std::span<float> lay_out(int width, int height) {
    resize(width, height);
    return z_;
  }
  /// Reduces the image to the part that starts at pixel index `first`, which is the image of `camera`.
  /// @pre there are no ends outside this part; at least 16 columns remain on the right
  void crop(const camera::pinhole& camera, std::uint32_t first) {
    rays_.fit(camera);
    first_ = first;
  }

  [[nodiscard]] const pixel_rays& rays() const noexcept { return rays_; }
  /// Removes the end of a pixel's ray.
  void clear(int u, int v) noexcept { z_[first_ + number(u, v)] = 0.0F; }
  /// Depths (metres) at which the rays of row `v` end, 0 where a ray has no end; padded with zeros.
  [[nodiscard]] const float* z(int v) const noexcept {
    return z_.data() + first_ + static_cast<std::size_t>(v) * stride_;
  }
  /// Offset between rows of `z`.
  [[nodiscard]] std::size_t stride() const noexcept { return stride_; }
  /// Index of a pixel. See `pixel` for the inverse.
  [[nodiscard]] std::uint32_t number(int u, int v) const noexcept {
    return static_cast<std::uint32_t>(static_cast<std::size_t>(v) * stride_ + static_cast<std::size_t>(u));
  }
  [[nodiscard]] std::array<int, 2> pixel(std::uint32_t number) const noexcept {
    return {static_cast<int>(number % stride_), static_cast<int>(number / stride_)};
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = rays_.memory_bytes() + z_.capacity() * sizeof(float) + workers_.capacity() * sizeof(worker);
    for (const worker& w : workers_) bytes += w.masks.memory_bytes() + w.keys.capacity() * sizeof(std::int32_t);
    return bytes;
  }

 private:
  using find_kernel = void(const depth_sensor&, const end_row&, end_counts&);
  using fresh_kernel = unsigned(const std::array<const std::int32_t*, 3>&, const std::array<const std::int32_t*, 3>&,
                                int);
  static constexpr std::size_t rows_per_chunk = 32;
  static constexpr std::size_t margin = 16;  // space before and after a row of keys

  struct worker {
    scan_masks masks;
    end_counts counts;
    std::vector<std::int32_t> keys;  ///< keys of this row and of the previous row, each as x, y and z
    std::size_t row_size = 0;
    std::uint64_t name = 0;
    scan_brick* brick = nullptr;

    void start(std::size_t stride) {
      masks.clear();
      counts = {};
      brick = nullptr;
      row_size = stride + 2 * margin;
      keys.assign(6 * row_size, -1);
    }
    void forget_row() { std::fill(keys.begin(), keys.end(), -1); }
    [[nodiscard]] std::int32_t* key(std::size_t row, std::size_t axis) noexcept {
      return keys.data() + (3 * row + axis) * row_size + margin;
    }
    void mark(scan_masks& in, const voxel_key& k) {
      const std::uint64_t n = node_name(k, brick_level);
      if (brick == nullptr || n != name) {
        brick = &in.at(k);  // valid until the next call
        name = n;
      }
      const std::uint32_t place = place_in_brick(k);
      brick->occupied[place >> 6U] |= std::uint64_t{1} << (place & 63U);
    }
  };

  void resize(int width, int height) {
    stride_ = static_cast<std::size_t>(width + 2 * pixel_rays::padding - 1) & ~std::size_t{15};
    z_.resize(stride_ * static_cast<std::size_t>(height) + pixel_rays::padding);
    first_ = 0;
  }
  void add_row(worker& w, scan_masks& masks, const depth_sensor& sensor, const depth_scan& scan, int v) {
    float* const z = z_.data() + static_cast<std::size_t>(v) * stride_;
    scan.visit([&](const auto& depth) { metres(depth, v, z); });
    std::fill(z + rays_.width(), z + stride_ + (v + 1 == rays_.height() ? pixel_rays::padding : 0), 0.0F);
    const auto row = static_cast<std::size_t>(v & 1);
    const end_row ends{rays_.width(),     rays_.x(v), rays_.y(v),
                       rays_.separable(), z,          {w.key(row, 0), w.key(row, 1), w.key(row, 2)}};
    find_(sensor, ends, w.counts);
    const std::array<const std::int32_t*, 3> key{ends.key[0], ends.key[1], ends.key[2]};
    const std::array<const std::int32_t*, 3> above{w.key(1 - row, 0), w.key(1 - row, 1), w.key(1 - row, 2)};
    for (int u = 0; u < rays_.width(); u += 16)
      for (unsigned bits = fresh_(key, above, u); bits != 0; bits &= bits - 1) {
        const int i = u + std::countr_zero(bits);
        w.mark(masks, {static_cast<std::uint32_t>(key[0][i]), static_cast<std::uint32_t>(key[1][i]),
                       static_cast<std::uint32_t>(key[2][i])});
      }
  }

  /// Reads the depths of row `v` in metres, 0 where there is no measurement.
  template <class Depth>
  void metres(const Depth& depth, int v, float* z) const {
    if constexpr (requires { stored_type(depth); }) {
      using stored = decltype(stored_type(depth));
      const auto scale = static_cast<float>(depth.scale());
      // Rounding a quotient of two floats first to double and then to float gives the same result as rounding it once.
      if (static_cast<double>(scale) == depth.scale()) {
        simd::kernel<to_metres_kernel<stored>, void(const metres_row<stored>&), simd::avx2>()(
            {depth.pixels().row(v).data(), z, rays_.width(), scale, depth.min_depth(), depth.max_depth()});
        return;
      }
    }
    for (int u = 0; u != rays_.width(); ++u) {
      const float d = depth(u, v);
      z[u] = d > 0.0F ? d : 0.0F;
    }
  }

  find_kernel* find_ = nullptr;
  fresh_kernel* fresh_ = nullptr;
  pixel_rays rays_;
  std::vector<float> z_;
  std::size_t stride_ = 0, first_ = 0;
  std::vector<worker> workers_;
};
using endpoint_image = basic_endpoint_image<>;

}  // namespace orbis::octree::detail

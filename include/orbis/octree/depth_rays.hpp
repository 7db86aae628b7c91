// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the rays of a depth image end: how far along the optical axis, and in which voxel.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/node_name.hpp>
#include <orbis/octree/scan.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree {

/// The end of one ray.
struct depth_end {
  enum class fate { none, used, truncated, rejected };
  fate what = fate::none;
  float3 point{};   ///< where it ends, metres
  voxel_key key{};  ///< the voxel it ends in
  float z = 0.0F;   ///< its depth along the optical axis there, up to a few roundings
};

/// The sensor of one depth image.
struct depth_sensor {
  voxel_grid grid;
  float_pose pose;
  std::optional<voxel_key> key;  ///< the voxel of the camera's centre
  double max_range;
  float max_square;  ///< the largest squared distance that is within range

  depth_sensor(const voxel_grid& g, const se3& T_world_camera, double range)
      : grid{g}, pose{T_world_camera}, max_range{range}, max_square{largest_square(range)} {
    if (is_finite(pose.centre)) key = grid.key(pose.centre);
  }

  /// What becomes of the ray through (x, y, 1) that was measured to be `z` deep: the rules of scan_marker.
  [[nodiscard]] depth_end end(float x, float y, float z) const noexcept {
    if (!(z > 0.0F) || std::isnan(x)) return {};
    depth_end e{.what = depth_end::fate::used, .point = world_point(pose, x, y, z), .key = {}, .z = z};
    const float3 ray = difference(e.point, pose.centre);
    const double distance = length(ray);
    if (!(distance <= max_range)) {
      const auto scale = static_cast<float>(distance);
      const auto range = static_cast<float>(max_range);
      for (std::size_t i = 0; i != 3; ++i) e.point[i] = pose.centre[i] + rounded_product(ray[i] / scale, range);
      e.z = z * (range / scale);
      e.what = std::isfinite(scale) ? depth_end::fate::truncated : depth_end::fate::rejected;
    }
    if (const auto k = grid.key(e.point))
      e.key = *k;
    else
      e.what = depth_end::fate::rejected;
    return e;
  }

 private:
  /// The largest float whose root (in double) is at most `range`.
  [[nodiscard]] static float largest_square(double range) noexcept {
    constexpr float most = std::numeric_limits<float>::infinity();
    if (std::isinf(range)) return most;
    auto square = static_cast<float>(range * range);
    while (square > 0.0F && std::sqrt(static_cast<double>(square)) > range) square = std::nextafter(square, 0.0F);
    for (float next; std::sqrt(static_cast<double>(next = std::nextafter(square, most))) <= range;) square = next;
    return square;
  }
};

namespace detail {

/// One row of pixels on its way from depths to ends. Every array holds `width` values and is padded.
struct end_row {
  int width = 0;
  const float* x = nullptr;
  const float* y = nullptr;
  bool one_y = false;  ///< y is a single value
  float* z = nullptr;  ///< in: metres, 0 where there is nothing; out: where the ray ends, 0 if it is not walked
  std::array<std::int32_t*, 3> key{};  ///< out: the voxels of the ends that are used, -1 for the others
};

/// What a row or an image came to.
struct end_counts {
  std::size_t used = 0, truncated = 0, rejected = 0;
  bool leaves = false;  ///< a ray ends outside the voxel of the camera's centre
  float max_z = 0.0F;
  double sum_z = 0.0;  ///< of the rays that are walked; up to rounding

  void add(const end_counts& o) noexcept {
    used += o.used;
    truncated += o.truncated;
    rejected += o.rejected;
    leaves = leaves || o.leaves;
    max_z = std::max(max_z, o.max_z);
    sum_z += o.sum_z;
  }
};

/// Fills in where the rays of a row end. All variants give the same ends and counts.
inline void find_ends_portable(const depth_sensor& s, const end_row& row, end_counts& counts) noexcept {
  for (int u = 0; u != row.width; ++u) {
    const depth_end e = s.end(row.x[u], row.y[row.one_y ? 0 : u], row.z[u]);
    const bool used = e.what == depth_end::fate::used, walked = used || e.what == depth_end::fate::truncated;
    counts.used += used ? 1 : 0;
    counts.truncated += walked && !used ? 1 : 0;
    counts.rejected += e.what == depth_end::fate::rejected ? 1 : 0;
    counts.leaves = counts.leaves || (walked && s.key && e.key != *s.key);
    row.z[u] = walked ? e.z : 0.0F;
    counts.max_z = std::max(counts.max_z, row.z[u]);
    counts.sum_z += static_cast<double>(row.z[u]);
    row.key[0][u] = used ? static_cast<std::int32_t>(e.key.x) : -1;
    row.key[1][u] = used ? static_cast<std::int32_t>(e.key.y) : -1;
    row.key[2][u] = used ? static_cast<std::int32_t>(e.key.z) : -1;
  }
}

/// Bit i: the voxel of pixel `u + i` is neither that of the pixel before it nor that of the pixel
/// above it. `key[i][-1]` and `above[i]` must be readable; pixels without a voxel have -1.
inline unsigned fresh_portable(const std::array<const std::int32_t*, 3>& key,
                               const std::array<const std::int32_t*, 3>& above, int u) noexcept {
  unsigned fresh = 0;
  for (int i = u; i != u + 16; ++i) {
    const bool left = key[0][i] == key[0][i - 1] && key[1][i] == key[1][i - 1] && key[2][i] == key[2][i - 1];
    const bool up = key[0][i] == above[0][i] && key[1][i] == above[1][i] && key[2][i] == above[2][i];
    if (key[0][i] != -1 && !left && !up) fresh |= 1U << static_cast<unsigned>(i - u);
  }
  return fresh;
}

#if ORBIS_X86
/// A product that is not fused with the sum it is part of, see rounded_product.
ORBIS_TARGET("avx2")
inline __m256 rounded_mul(__m256 a, __m256 b) noexcept {
  __m256 product = _mm256_mul_ps(a, b);
#if !defined(__clang__)
  asm("" : "+x"(product));
#endif
  return product;
}

/// The voxels along one axis as far as float arithmetic can tell; where it cannot, `unsure` is set.
/// The product errs by two roundings, so that a voxel is certain four of them away from its faces.
ORBIS_TARGET("avx2")
inline __m256i likely_keys_avx2(__m256 p, float per_metre, float half, __m256& unsure) noexcept {
  const __m256 sign = _mm256_set1_ps(-0.0F);
  const __m256 cells = _mm256_mul_ps(p, _mm256_set1_ps(per_metre)), floor = _mm256_floor_ps(cells);
  const __m256 above = _mm256_sub_ps(cells, floor), size = _mm256_andnot_ps(sign, cells);
  const __m256 room = _mm256_min_ps(above, _mm256_sub_ps(_mm256_set1_ps(1.0F), above));
  const __m256 sure = _mm256_and_ps(_mm256_cmp_ps(room, _mm256_mul_ps(size, _mm256_set1_ps(0x1p-22F)), _CMP_GT_OQ),
                                    _mm256_cmp_ps(size, _mm256_set1_ps(half - 2.0F), _CMP_LT_OQ));
  unsure = _mm256_or_ps(unsure, _mm256_xor_ps(sure, _mm256_castsi256_ps(_mm256_set1_epi32(-1))));
  return _mm256_add_epi32(_mm256_cvttps_epi32(floor), _mm256_set1_epi32(static_cast<int>(half)));
}
/// The voxels along one axis, and whether they are in the grid; see voxel_grid::key.
ORBIS_TARGET("avx2")
inline __m256i keys_avx2(__m256 p, double per_metre, double half, __m256& inside) noexcept {
  const __m256d scale = _mm256_set1_pd(per_metre), least = _mm256_set1_pd(-half), most = _mm256_set1_pd(half);
  const __m256d a = _mm256_mul_pd(_mm256_cvtps_pd(_mm256_castps256_ps128(p)), scale);
  const __m256d b = _mm256_mul_pd(_mm256_cvtps_pd(_mm256_extractf128_ps(p, 1)), scale);
  const __m256d in_a = _mm256_and_pd(_mm256_cmp_pd(a, least, _CMP_GE_OQ), _mm256_cmp_pd(a, most, _CMP_LT_OQ));
  const __m256d in_b = _mm256_and_pd(_mm256_cmp_pd(b, least, _CMP_GE_OQ), _mm256_cmp_pd(b, most, _CMP_LT_OQ));
  const __m256i narrow = _mm256_castps_si256(_mm256_shuffle_ps(_mm256_castpd_ps(in_a), _mm256_castpd_ps(in_b), 0x88));
  inside = _mm256_and_ps(inside, _mm256_castsi256_ps(_mm256_permute4x64_epi64(narrow, 0xd8)));
  const __m256d shift = _mm256_set1_pd(half);
  const __m128i ka = _mm256_cvttpd_epi32(_mm256_add_pd(_mm256_floor_pd(a), shift));
  const __m128i kb = _mm256_cvttpd_epi32(_mm256_add_pd(_mm256_floor_pd(b), shift));
  return _mm256_inserti128_si256(_mm256_castsi128_si256(ka), kb, 1);
}

ORBIS_TARGET("avx2,popcnt")
inline void find_ends_avx2(const depth_sensor& s, const end_row& row, end_counts& counts) noexcept {
  const double per_metre = 1.0 / s.grid.resolution(), half = 0.5 * s.grid.cells();
  const auto per_metre_f = static_cast<float>(per_metre), half_f = static_cast<float>(half);
  const __m256 zero = _mm256_setzero_ps(), max_square = _mm256_set1_ps(s.max_square);
  const __m256 range = _mm256_set1_ps(static_cast<float>(s.max_range));
  const __m256 infinite = _mm256_set1_ps(std::numeric_limits<float>::infinity());
  const voxel_key from = s.key.value_or(voxel_key{});
  const __m256i from_x = _mm256_set1_epi32(static_cast<int>(from.x)), none = _mm256_set1_epi32(-1);
  const __m256i from_y = _mm256_set1_epi32(static_cast<int>(from.y));
  const __m256i from_z = _mm256_set1_epi32(static_cast<int>(from.z));
  __m256 stays = _mm256_castsi256_ps(none), max_z = zero, sum_z = zero;
  std::size_t used_count = 0, truncated_count = 0, rejected_count = 0;
  for (int u = 0; u < row.width; u += 8) {
    const __m256 z = _mm256_loadu_ps(row.z + u), x = _mm256_loadu_ps(row.x + u);
    const __m256 y = row.one_y ? _mm256_set1_ps(*row.y) : _mm256_loadu_ps(row.y + u);
    const __m256 valid = _mm256_and_ps(_mm256_cmp_ps(z, zero, _CMP_GT_OQ), _mm256_cmp_ps(x, x, _CMP_ORD_Q));
    const __m256 cx = rounded_mul(x, z), cy = rounded_mul(y, z);
    const auto along = [&](std::size_t i) ORBIS_TARGET("avx2") {
      const float3& r = s.pose.rows[i];
      const __m256 xy = _mm256_add_ps(rounded_mul(_mm256_set1_ps(r[0]), cx), rounded_mul(_mm256_set1_ps(r[1]), cy));
      return _mm256_add_ps(_mm256_add_ps(xy, rounded_mul(_mm256_set1_ps(r[2]), z)), _mm256_set1_ps(s.pose.centre[i]));
    };
    __m256 px = along(0), py = along(1), pz = along(2), end_z = z;
    const __m256 ox = _mm256_set1_ps(s.pose.centre[0]), oy = _mm256_set1_ps(s.pose.centre[1]);
    const __m256 oz = _mm256_set1_ps(s.pose.centre[2]);
    const __m256 dx = _mm256_sub_ps(px, ox), dy = _mm256_sub_ps(py, oy), dz = _mm256_sub_ps(pz, oz);
    const __m256 square = _mm256_add_ps(_mm256_add_ps(rounded_mul(dx, dx), rounded_mul(dy, dy)), rounded_mul(dz, dz));
    const __m256 within = _mm256_cmp_ps(square, max_square, _CMP_LE_OQ);
    __m256 good = valid;
    if (_mm256_movemask_ps(_mm256_andnot_ps(within, valid)) != 0) {
      // The root of a float, taken in double and rounded, is the root taken in float.
      const __m256 scale = _mm256_sqrt_ps(square);
      const auto cut = [&](__m256 d, __m256 o) ORBIS_TARGET("avx2") {
        return _mm256_add_ps(o, rounded_mul(_mm256_div_ps(d, scale), range));
      };
      px = _mm256_blendv_ps(cut(dx, ox), px, within);
      py = _mm256_blendv_ps(cut(dy, oy), py, within);
      pz = _mm256_blendv_ps(cut(dz, oz), pz, within);
      end_z = _mm256_blendv_ps(_mm256_mul_ps(z, _mm256_div_ps(range, scale)), z, within);
      good = _mm256_and_ps(good, _mm256_or_ps(within, _mm256_cmp_ps(scale, infinite, _CMP_LT_OQ)));
    }
    __m256 unsure = zero;
    __m256i kx = likely_keys_avx2(px, per_metre_f, half_f, unsure),
            ky = likely_keys_avx2(py, per_metre_f, half_f, unsure);
    __m256i kz = likely_keys_avx2(pz, per_metre_f, half_f, unsure);
    if (_mm256_movemask_ps(_mm256_and_ps(unsure, good)) != 0) {
      kx = keys_avx2(px, per_metre, half, good);
      ky = keys_avx2(py, per_metre, half, good);
      kz = keys_avx2(pz, per_metre, half, good);
    }
    const __m256 used = _mm256_and_ps(good, within);
    const auto count = [&](__m256 m) ORBIS_TARGET("avx2,popcnt") {
      return static_cast<std::size_t>(_mm_popcnt_u32(static_cast<unsigned>(_mm256_movemask_ps(m))));
    };
    const std::size_t good_count = count(good), used_here = count(used);
    used_count += used_here;
    truncated_count += good_count - used_here;
    rejected_count += count(valid) - good_count;
    const __m256i same =
        _mm256_and_si256(_mm256_and_si256(_mm256_cmpeq_epi32(kx, from_x), _mm256_cmpeq_epi32(ky, from_y)),
                         _mm256_cmpeq_epi32(kz, from_z));
    stays =
        _mm256_and_ps(stays, _mm256_or_ps(_mm256_castsi256_ps(same), _mm256_xor_ps(good, _mm256_castsi256_ps(none))));
    end_z = _mm256_and_ps(end_z, good);
    max_z = _mm256_max_ps(max_z, end_z);
    sum_z = _mm256_add_ps(sum_z, end_z);
    _mm256_storeu_ps(row.z + u, end_z);
    const __m256i keep = _mm256_castps_si256(used);
    const auto store = [&](std::size_t i, __m256i k) ORBIS_TARGET("avx2") {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(row.key[i] + u), _mm256_blendv_epi8(none, k, keep));
    };
    store(0, kx);
    store(1, ky);
    store(2, kz);
  }
  alignas(32) std::array<float, 8> lanes;
  _mm256_store_ps(lanes.data(), max_z);
  for (const float v : lanes) counts.max_z = std::max(counts.max_z, v);
  _mm256_store_ps(lanes.data(), sum_z);
  for (const float v : lanes) counts.sum_z += static_cast<double>(v);
  counts.used += used_count;
  counts.truncated += truncated_count;
  counts.rejected += rejected_count;
  counts.leaves = counts.leaves || (s.key && _mm256_movemask_ps(stays) != 0xff);
}

ORBIS_TARGET("avx2")
inline unsigned fresh_avx2(const std::array<const std::int32_t*, 3>& key,
                           const std::array<const std::int32_t*, 3>& above, int u) noexcept {
  const auto eight = [&](int i) ORBIS_TARGET("avx2") {
    const auto load = [&](const std::int32_t* p)
                          ORBIS_TARGET("avx2") { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)); };
    const __m256i x = load(key[0] + i), y = load(key[1] + i), z = load(key[2] + i);
    const auto same = [&](const __m256i a, const __m256i b, const __m256i c) ORBIS_TARGET("avx2") {
      return _mm256_and_si256(_mm256_and_si256(_mm256_cmpeq_epi32(x, a), _mm256_cmpeq_epi32(y, b)),
                              _mm256_cmpeq_epi32(z, c));
    };
    const __m256i left = same(load(key[0] + i - 1), load(key[1] + i - 1), load(key[2] + i - 1));
    const __m256i up = same(load(above[0] + i), load(above[1] + i), load(above[2] + i));
    const __m256i known = _mm256_or_si256(_mm256_or_si256(left, up), _mm256_cmpeq_epi32(x, _mm256_set1_epi32(-1)));
    return static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(known)));
  };
  return ~(eight(u) | eight(u + 8) << 8U) & 0xffffU;
}
#endif

/// What a depth_view stores.
template <class T>
T stored_type(const camera::depth_view<T>&);

/// Metres of a row of stored depths; see depth_view::operator().
template <class T>
struct metres_row {
  const T* stored;
  float* metres;
  int width;
  float scale, min, max;
};

template <class T>
void to_metres_portable(const metres_row<T>& row) noexcept {
  for (int u = 0; u != row.width; ++u) {
    const T stored = row.stored[u];
    const float z = static_cast<float>(stored) / row.scale;
    bool valid = stored > T{0} && z >= row.min && z <= row.max;
    if constexpr (std::same_as<T, float>)
      valid = valid && stored < std::numeric_limits<float>::infinity();
    else
      valid = valid && stored != std::numeric_limits<T>::max();
    row.metres[u] = valid ? z : 0.0F;
  }
}

#if ORBIS_X86
template <class T>
ORBIS_TARGET("avx2")
void to_metres_avx2(const metres_row<T>& row) noexcept {
  const __m256 scale = _mm256_set1_ps(row.scale), min = _mm256_set1_ps(row.min), max = _mm256_set1_ps(row.max);
  int u = 0;
  for (; u + 8 <= row.width; u += 8) {
    __m256 stored, most;
    if constexpr (std::same_as<T, float>) {
      stored = _mm256_loadu_ps(row.stored + u);
      most = _mm256_set1_ps(std::numeric_limits<float>::infinity());
    } else {
      stored =
          _mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(row.stored + u))));
      most = _mm256_set1_ps(65535.0F);
    }
    const __m256 z = _mm256_div_ps(stored, scale);
    const __m256 measured =
        _mm256_and_ps(_mm256_cmp_ps(stored, _mm256_setzero_ps(), _CMP_GT_OQ), _mm256_cmp_ps(stored, most, _CMP_LT_OQ));
    const __m256 inside = _mm256_and_ps(_mm256_cmp_ps(z, min, _CMP_GE_OQ), _mm256_cmp_ps(z, max, _CMP_LE_OQ));
    _mm256_storeu_ps(row.metres + u, _mm256_and_ps(z, _mm256_and_ps(measured, inside)));
  }
  to_metres_portable<T>({row.stored + u, row.metres + u, row.width - u, row.scale, row.min, row.max});
}
#endif

}  // namespace detail

/// The rays of one depth image: how deep each of them ends, and which voxels hold ends. Keeps its
/// memory from image to image.
class depth_rays {
 public:
  explicit depth_rays(simd::level level = simd::detected()) noexcept
      : level_{level},
        find_{simd::select<find_kernel>(level,
                                        {
                                          .portable = detail::find_ends_portable,
#if ORBIS_X86
                                          .popcnt = nullptr, .avx2 = detail::find_ends_avx2
#endif
                                        })},
        fresh_{simd::select<fresh_kernel>(level, {
          .portable = detail::fresh_portable,
#if ORBIS_X86
          .popcnt = nullptr, .avx2 = detail::fresh_avx2
#endif
        })} {
  }

  /// Takes in an image: the depths at which rays end, and in `masks` the voxels of the ends that are
  /// used, as occupied. O(pixels). @pre depth and camera have the same size
  template <execution_policy Policy, camera::depth_source Depth, camera::camera_model Camera>
  detail::end_counts find_ends(const Policy& policy, const depth_sensor& sensor, const Depth& depth,
                               const Camera& camera, scan_masks& masks) {
    rays_.fit(camera);
    assert(static_cast<int>(depth.width()) == rays_.width() && static_cast<int>(depth.height()) == rays_.height());
    const auto rows = static_cast<std::size_t>(rays_.height());
    stride_ = static_cast<std::size_t>(rays_.width() + 2 * pixel_rays::padding - 1) & ~std::size_t{15};
    z_.resize(stride_ * rows + pixel_rays::padding);
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
          add_row(w, marks, sensor, depth, static_cast<int>(v));
      }
    });
    detail::end_counts counts;
    for (std::size_t i = 0; i != workers_.size(); ++i) {
      if (i != 0) masks.merge(workers_[i].masks);
      counts.add(workers_[i].counts);
    }
    return counts;
  }

  [[nodiscard]] const pixel_rays& rays() const noexcept { return rays_; }
  /// Forgets the end of a pixel's ray.
  void clear(int u, int v) noexcept { z_[static_cast<std::size_t>(v) * stride_ + static_cast<std::size_t>(u)] = 0.0F; }
  /// The depths (metres) at which the rays of row `v` end, 0 where there is none; padded with zeros.
  [[nodiscard]] const float* z(int v) const noexcept { return z_.data() + static_cast<std::size_t>(v) * stride_; }
  /// From row to row of `z`.
  [[nodiscard]] std::size_t stride() const noexcept { return stride_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = rays_.memory_bytes() + z_.capacity() * sizeof(float) + workers_.capacity() * sizeof(worker);
    for (const worker& w : workers_) bytes += w.masks.memory_bytes() + w.keys.capacity() * sizeof(std::int32_t);
    return bytes;
  }

 private:
  using find_kernel = void(const depth_sensor&, const detail::end_row&, detail::end_counts&);
  using fresh_kernel = unsigned(const std::array<const std::int32_t*, 3>&, const std::array<const std::int32_t*, 3>&,
                                int);
  static constexpr std::size_t rows_per_chunk = 32;
  static constexpr std::size_t margin = 16;  // before and after a row of keys

  struct worker {
    scan_masks masks;
    detail::end_counts counts;
    std::vector<std::int32_t> keys;  ///< this row's and the last one's, x, y and z each
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
        brick = &in.at(k);  // good until another one is asked for
        name = n;
      }
      const std::uint32_t place = place_in_brick(k);
      brick->occupied[place >> 6U] |= std::uint64_t{1} << (place & 63U);
    }
  };

  template <class Depth>
  void add_row(worker& w, scan_masks& masks, const depth_sensor& sensor, const Depth& depth, int v) {
    float* const z = z_.data() + static_cast<std::size_t>(v) * stride_;
    metres(depth, v, z);
    std::fill(z + rays_.width(), z + stride_ + (v + 1 == rays_.height() ? pixel_rays::padding : 0), 0.0F);
    const auto row = static_cast<std::size_t>(v & 1);
    const detail::end_row ends{rays_.width(),     rays_.x(v), rays_.y(v),
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

  /// The depths of row `v` in metres, 0 where there is no measurement.
  template <class Depth>
  void metres(const Depth& depth, int v, float* z) const {
    if constexpr (requires { detail::stored_type(depth); }) {
      using stored = decltype(detail::stored_type(depth));
      const auto scale = static_cast<float>(depth.scale());
      // Rounding a quotient of floats to double first does not change it.
      if (static_cast<double>(scale) == depth.scale()) {
        const auto convert = simd::select<void(const detail::metres_row<stored>&)>(level_, {
          .portable = detail::to_metres_portable<stored>,
#if ORBIS_X86
          .popcnt = nullptr, .avx2 = detail::to_metres_avx2<stored>
#endif
        });
        convert({depth.pixels().row(v).data(), z, rays_.width(), scale, depth.min_depth(), depth.max_depth()});
        return;
      }
    }
    for (int u = 0; u != rays_.width(); ++u) {
      const float d = depth(u, v);
      z[u] = d > 0.0F ? d : 0.0F;
    }
  }

  simd::level level_;
  find_kernel* find_;
  fresh_kernel* fresh_;
  pixel_rays rays_;
  std::vector<float> z_;
  std::size_t stride_ = 0;
  std::vector<worker> workers_;
};

}  // namespace orbis::octree

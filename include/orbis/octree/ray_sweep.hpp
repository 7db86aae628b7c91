// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Many rays from one point as sets of voxels: exactly those of walk_ray, many times as fast.
///
/// A walk compares the distances at which a ray leaves its voxel along x, y and z. All that matters is
/// the outcome of the comparisons, so a ray is not walked: its crossings with the planes of voxel
/// faces across its main axis are computed with known error, slab by slab for all rays, in maps small
/// enough for the cache. Where the error could change an outcome, the ray is walked.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/ray_grid.hpp>
#include <orbis/octree/ray_walk.hpp>
#include <orbis/octree/scan.hpp>
#include <orbis/octree/sweep_planes.hpp>
#include <orbis/octree/swept_ray.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree {

/// The rays of one scan. Keeps its memory from scan to scan, some megabytes however far the rays go.
class ray_sweep {
 public:
  /// Begins a scan from `origin` in voxel `from`. `level`: of the instructions used, for tests.
  void start(const voxel_grid& grid, const float3& origin, const voxel_key& from,
             simd::level level = simd::detected()) {
    grid_ = &grid;
    origin_ = origin;
    from_ = {static_cast<std::int32_t>(from.x), static_cast<std::int32_t>(from.y), static_cast<std::int32_t>(from.z)};
    left_origin_ = false;
    for (face& f : faces_) f.rays.clear();
    walked_.clear();
    batched_ = 0;
    source_ = {grid, origin, from};
#if ORBIS_X86
    by_eights_ = std::min(level, simd::detected()) >= simd::level::avx512;
#endif
    sweep_ = simd::select<kernel>(level, {
      .portable = detail::sweep_portable,
#if ORBIS_X86
      .popcnt = nullptr, .avx2 = nullptr, .avx512 = detail::sweep_avx512
#endif
    });
  }

  /// Marks in `masks` what walk_ray visits, now or when `flush` is called, and perhaps `to` if it is a
  /// `hit`: a voxel that counts as occupied whatever crosses it. @pre `to` is the key of `end`
  void add(const float3& end, const voxel_key& to, bool hit, scan_masks& masks) {
    const std::array<std::int32_t, 3> way{static_cast<std::int32_t>(to.x) - from_[0],
                                          static_cast<std::int32_t>(to.y) - from_[1],
                                          static_cast<std::int32_t>(to.z) - from_[2]};
    if ((way[0] | way[1] | way[2]) == 0) return;
    left_origin_ = true;
#if ORBIS_X86
    if (hit && by_eights_) {
      for (std::size_t i = 0; i != 3; ++i) {
        batch_.end[i][batched_] = end[i];
        batch_.way[i][batched_] = way[i];
      }
      if (++batched_ == detail::ray_batch::lanes) prepare(masks);
      return;
    }
#endif
    add_one(end, to, way, hit, masks);
  }

  /// Sweeps and walks the rays that are waiting.
  void flush(scan_masks& masks) {
    if (left_origin_) masks.mark_free(key(0, 0, 0));
    left_origin_ = false;  // the next scan may have no rays, and not start one
    for (std::size_t i = 0; i != batched_; ++i) add_batched(i, masks);
    batched_ = 0;
    for (face& f : faces_) sweep(f, masks);
    walk_all(masks);
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = rays_.memory_bytes() + bytes_.capacity() + counts_.capacity() * sizeof(std::uint32_t) +
                        bounds_.capacity() * sizeof(bounds) + doubtful_.capacity() * sizeof(std::uint32_t) +
                        walked_.capacity() * sizeof(target) + window_.memory_bytes();
    for (const face& f : faces_) bytes += f.rays.capacity() * sizeof(waiting_ray);
    return bytes;
  }

 private:
  using kernel = void(const detail::sweep_window&, detail::swept_rays&, std::size_t, std::size_t,
                      std::vector<std::uint32_t>&);
  static constexpr std::int32_t max_planes = 4096;       ///< rays further than this are walked
  static constexpr std::size_t max_waiting = 1U << 14U;  ///< rays that are swept at once
  static constexpr double max_width = 448.0;             ///< of a map, in cells, when it is planned
  static constexpr double doubt = 1e-8;                  ///< of a walk of max_planes steps in double, in voxels
  static constexpr std::size_t many = 256;               ///< rays that are walked together
  static constexpr std::int32_t slab = 16;               ///< layers that are swept at once: two bricks

  struct target {
    float3 end;
    voxel_key to;
  };
  struct waiting_ray {
    double u, du, v, dv;
    std::int32_t planes;
    target aim;
  };
  /// Rays with the same main axis and the same direction along it.
  struct face {
    std::vector<waiting_ray> rays;
  };
  /// Of the slopes of some rays.
  struct bounds {
    float low_u = std::numeric_limits<float>::infinity(), high_u = -low_u;
    float low_v = low_u, high_v = high_u;
    void add(const bounds& b) noexcept {
      low_u = std::min(low_u, b.low_u);
      high_u = std::max(high_u, b.high_u);
      low_v = std::min(low_v, b.low_v);
      high_v = std::max(high_v, b.high_v);
    }
  };
  /// A coordinate, in cells from the first, as a function of the number of planes passed.
  struct line {
    double at, slope;
  };

  [[nodiscard]] voxel_key key(std::int32_t x, std::int32_t y, std::int32_t z) const noexcept {
    return {static_cast<std::uint32_t>(from_[0] + x), static_cast<std::uint32_t>(from_[1] + y),
            static_cast<std::uint32_t>(from_[2] + z)};
  }
  [[nodiscard]] static std::size_t main_axis(const ray_cursor& c) noexcept {
    const std::size_t xy = c.delta[1] < c.delta[0] ? 1 : 0;
    return c.delta[2] < c.delta[xy] ? 2 : xy;
  }
  /// Whether the walk reaches the end's voxel before the ray's length stops it.
  [[nodiscard]] static bool ends_for_certain(const ray_cursor& c, const std::array<std::int32_t, 3>& way) noexcept {
    bool certain = true;
    for (std::size_t i = 0; i != 3; ++i) {
      if (c.step[i] == 0) {
        certain = certain && way[i] == 0;
        continue;
      }
      const double crossed = (c.reach - c.next[i]) / c.delta[i] + 1.0;
      const double expected = way[i] * c.step[i];
      certain = certain && crossed > expected + doubt && crossed < expected + 1.0 - doubt;
    }
    return certain;
  }
  [[nodiscard]] static line across(const ray_cursor& c, std::size_t axis, double at, double delta) noexcept {
    if (c.step[axis] == 0) return {0.5, 0.0};
    const double crossed = (at - c.next[axis]) / c.delta[axis] + 1.0, slope = delta / c.delta[axis];
    return c.step[axis] > 0 ? line{crossed, slope} : line{1.0 - crossed, -slope};
  }
  /// Marks what lies between the last plane that is swept and the end. False if it cannot be told.
  bool finish(ray_cursor c, std::size_t axis, std::int32_t swept, const line& u, const line& v,
              const std::array<std::int32_t, 3>& way, bool hit, scan_masks& masks) const {
    const std::size_t iu = axis == 0 ? 1 : 0, iv = axis == 2 ? 1 : 2;
    std::array<std::int32_t, 3> at{};
    at[axis] = swept * c.step[axis];
    if (swept != 0) {
      const auto cell = [&](const line& l, std::int32_t& whole) {
        const double there = l.at + swept * l.slope, below = std::floor(there);
        whole = static_cast<std::int32_t>(below);
        return there - below > doubt && there - below < 1.0 - doubt;
      };
      if (!cell(u, at[iu]) || !cell(v, at[iv])) return false;
    }
    const auto left = [&](std::size_t i) { return std::abs(way[i] - at[i]); };
    if (hit && left(0) + left(1) + left(2) <= 1) return true;
    for (std::size_t i = 0; i != 3; ++i)
      if (at[i] != 0) c.next[i] += std::abs(at[i]) * c.delta[i];
    std::array<voxel_key, 8> crossed;
    std::size_t count = 0;
    for (; count != crossed.size(); ++count) {
      const std::size_t first = c.axis();
      for (std::size_t i = 0; i != 3; ++i)
        if (i != first && !(c.next[i] - c.next[first] > doubt * c.delta[axis])) return false;
      at[first] += c.step[first];
      c.next[first] += c.delta[first];
      if (at == way) break;
      crossed[count] = key(at[0], at[1], at[2]);
    }
    if (count == crossed.size()) return false;
    for (std::size_t i = 0; i != count; ++i) masks.mark_free(crossed[i]);
    return true;
  }
  /// A ray on its own.
  void add_one(const float3& end, const voxel_key& to, const std::array<std::int32_t, 3>& way, bool hit,
               scan_masks& masks) {
    const auto cursor = ray_cursor::between(*grid_, key(0, 0, 0), origin_, end);
    if (!cursor) return;
    const std::size_t axis = main_axis(*cursor);
    const std::int32_t planes = std::abs(way[axis]);
    if (planes > max_planes || !ends_for_certain(*cursor, way)) return walk(end, to);

    const std::size_t iu = axis == 0 ? 1 : 0, iv = axis == 2 ? 1 : 2;
    const double at = cursor->next[axis] - cursor->delta[axis];
    const line u = across(*cursor, iu, at, cursor->delta[axis]), v = across(*cursor, iv, at, cursor->delta[axis]);
    // Of a ray that hits nothing the end must stay unmarked; a plane marks the voxels on both sides.
    const std::int32_t swept = hit || planes == 0 ? planes : planes - 1;
    if (!finish(*cursor, axis, swept, u, v, way, hit, masks)) return walk(end, to);
    if (swept == 0) return;
    face& f = faces_[2 * axis + (cursor->step[axis] < 0 ? 1 : 0)];
    f.rays.push_back({u.at, u.slope, v.at, v.slope, swept, {end, to}});
    if (f.rays.size() == max_waiting) sweep(f, masks);
  }
#if ORBIS_X86
  /// Rays that hit, as many as there are lanes.
  void prepare(scan_masks& masks) {
    detail::prepared_rays rays;
    const std::uint32_t done = detail::prepare_avx512(source_, batch_, doubt, rays);
    batched_ = 0;
    for (std::size_t i = 0; i != detail::ray_batch::lanes; ++i) {
      if ((done >> i & 1U) == 0) {
        add_batched(i, masks);
        continue;
      }
      face& f = faces_[static_cast<std::size_t>(rays.face[i])];
      f.rays.push_back({rays.u[i], rays.du[i], rays.v[i], rays.dv[i], rays.planes[i], batched(i)});
      if (f.rays.size() == max_waiting) sweep(f, masks);
    }
  }
#endif
  [[nodiscard]] target batched(std::size_t i) const noexcept {
    return {{batch_.end[0][i], batch_.end[1][i], batch_.end[2][i]},
            key(batch_.way[0][i], batch_.way[1][i], batch_.way[2][i])};
  }
  void add_batched(std::size_t i, scan_masks& masks) {
    const target t = batched(i);
    add_one(t.end, t.to, {batch_.way[0][i], batch_.way[1][i], batch_.way[2][i]}, true, masks);
  }
  void walk(const float3& end, const voxel_key& to) { walked_.push_back({end, to}); }

  /// The slab of the last voxels that a ray with this many planes marks.
  [[nodiscard]] std::int32_t last_slab(std::int32_t origin, std::int32_t step, std::int32_t planes) const noexcept {
    return std::abs((origin + step * planes) / slab - origin / slab);
  }

  void sweep(face& f, scan_masks& masks) {
    if (f.rays.empty()) return;
    const auto number = static_cast<std::size_t>(&f - faces_.data());
    const std::size_t axis = number / 2;
    const std::int32_t step = number % 2 == 0 ? 1 : -1;
    const std::int32_t origin = from_[axis];

    std::int32_t planes = 0;
    bounds all;
    for (const waiting_ray& r : f.rays) {
      planes = std::max(planes, r.planes);
      all.add(slopes(r));
    }
    // Rays that would need a wider map go into tiles of neighbouring directions.
    const auto tiles = [&](float low, float high) {
      return 1 + static_cast<std::size_t>((high - low) * static_cast<float>(planes) / max_width);
    };
    const std::size_t tiles_u = tiles(all.low_u, all.high_u), tiles_v = tiles(all.low_v, all.high_v);
    const auto tile = [](float x, float low, float high, std::size_t count) {
      return count == 1
                 ? 0
                 : std::min(count - 1, static_cast<std::size_t>((x - low) / (high - low) * static_cast<float>(count)));
    };
    const auto slabs = static_cast<std::size_t>(last_slab(origin, step, planes)) + 1;
    // Within a tile the rays that go furthest come first: those in a slab are then the first ones.
    const auto bucket = [&](const waiting_ray& r) {
      const std::size_t u = tile(static_cast<float>(r.du), all.low_u, all.high_u, tiles_u);
      const std::size_t v = tile(static_cast<float>(r.dv), all.low_v, all.high_v, tiles_v);
      return (v * tiles_u + u + 1) * slabs - 1 - static_cast<std::size_t>(last_slab(origin, step, r.planes));
    };
    counts_.assign(tiles_u * tiles_v * slabs + 1, 0);
    bounds_.assign(tiles_u * tiles_v * slabs, {});
    for (const waiting_ray& r : f.rays) {
      const std::size_t b = bucket(r);
      ++counts_[b + 1];
      bounds_[b].add(slopes(r));
    }
    for (std::size_t i = 1; i != counts_.size(); ++i) counts_[i] += counts_[i - 1];
    rays_.fit(f.rays.size());
    for (std::size_t i = 0; i != f.rays.size(); ++i) {
      const waiting_ray& r = f.rays[i];
      const std::size_t to = counts_[bucket(r)]++;
      rays_.u[to] = r.u;
      rays_.du[to] = r.du;
      rays_.v[to] = r.v;
      rays_.dv[to] = r.dv;
      rays_.planes[to] = r.planes;
      rays_.id[to] = static_cast<std::uint32_t>(i);
    }
    // counts_[b] is now where bucket b ends.
    doubtful_.clear();
    for (std::size_t t = 0; t != tiles_u * tiles_v; ++t) {
      const std::size_t first_bucket = t * slabs;
      const std::size_t begin = t == 0 ? 0 : counts_[first_bucket - 1];
      for (std::size_t b = first_bucket + 1; b != first_bucket + slabs; ++b) bounds_[b].add(bounds_[b - 1]);
      for (std::size_t s = 0; s != slabs; ++s) {
        const std::size_t b = first_bucket + slabs - 1 - s;
        if (counts_[b] == begin) break;
        sweep_slab(axis, step, static_cast<std::int32_t>(s), planes, bounds_[b], begin, counts_[b], masks);
      }
    }
    for (const std::uint32_t i : doubtful_) walked_.push_back(f.rays[i].aim);
    f.rays.clear();
    if (walked_.size() >= max_waiting) walk_all(masks);
  }
  [[nodiscard]] static bounds slopes(const waiting_ray& r) noexcept {
    const auto u = static_cast<float>(r.du), v = static_cast<float>(r.dv);
    return {u, u, v, v};
  }

  void sweep_slab(std::size_t axis, std::int32_t step, std::int32_t number, std::int32_t planes, const bounds& b,
                  std::size_t begin, std::size_t end, scan_masks& masks) {
    const std::size_t iu = axis == 0 ? 1 : 0, iv = axis == 2 ? 1 : 2;
    const std::int32_t origin = from_[axis];
    // The slab's layers, counted from the origin's along the rays.
    const std::int32_t low = (origin / slab + step * number) * slab;
    const std::int32_t first = number == 0 ? 0 : step > 0 ? low - origin : origin - (low + slab - 1);
    const std::int32_t last = std::min(step > 0 ? low + slab - 1 - origin : origin - low, planes);

    detail::sweep_window w;
    w.first = first;
    w.count = last - first + 2;
    const auto range = [&](float low_slope, float high_slope, std::int32_t from, std::int32_t& lowest) {
      const auto a = static_cast<float>(first), z = static_cast<float>(last + 1);
      const float l = std::min(low_slope * a, low_slope * z) - 2.0F,
                  h = std::max(high_slope * a, high_slope * z) + 3.0F;
      lowest = ((from + static_cast<std::int32_t>(std::floor(l))) & ~7) - from;
      const std::int32_t highest = ((from + static_cast<std::int32_t>(std::floor(h))) | 7) - from;
      return static_cast<std::uint32_t>(highest - lowest + 1);
    };
    const std::uint32_t width = range(b.low_u, b.high_u, from_[iu], w.low_u);
    const std::uint32_t rows = range(b.low_v, b.high_v, from_[iv], w.low_v);
    w.log2_width = static_cast<unsigned>(std::bit_width((width >> 3U) - 1));
    w.size = std::size_t{rows} * 8 << w.log2_width;
    w.stride = w.size + 64;
    const auto maps = static_cast<std::size_t>(w.count);
    if (bytes_.size() < 2 * maps * w.stride) bytes_.resize(2 * maps * w.stride);
    w.planes = bytes_.data();
    w.layers = w.planes + maps * w.stride;
    if (first == 0) w.planes[w.cell(0, 0)] = detail::sweep_window::marked;
    sweep_(w, rays_, begin, end, doubtful_);
    collect(w, axis, step, last, width, rows, masks);
    std::memset(w.planes, 0, 2 * maps * w.stride);
  }

  /// Moves the marks of a window to `masks`.
  void collect(const detail::sweep_window& w, std::size_t axis, std::int32_t step, std::int32_t last,
               std::uint32_t width, std::uint32_t rows, scan_masks& masks) const {
    const std::size_t iu = axis == 0 ? 1 : 0, iv = axis == 2 ? 1 : 2;
    const std::int32_t end_a = from_[axis] + step * w.first, end_b = from_[axis] + step * last;
    const std::int32_t lowest = std::min(end_a, end_b), highest = std::max(end_a, end_b);
    std::array<std::uint64_t, 8> layers;
    for (std::int32_t brick = lowest & ~7; brick <= highest; brick += 8) {
      for (std::uint32_t v = 0; v != rows; v += 8) {
        for (std::uint32_t u = 0; u != width; u += 8) {
          std::uint64_t any = 0;
          for (std::int32_t i = 0; i != 8; ++i) {
            std::uint64_t& layer = layers[static_cast<std::size_t>(i)];
            layer = 0;
            if (brick + i < lowest || brick + i > highest) continue;
            const std::size_t at =
                static_cast<std::size_t>((brick + i - from_[axis]) * step - w.first) * w.stride + w.at(u, v);
            layer = marks(w.planes + at, w.planes + at + w.stride, w.layers + at);
            any |= layer;
          }
          if (any == 0) continue;
          std::array<std::uint32_t, 3> at;
          at[axis] = static_cast<std::uint32_t>(brick);
          at[iu] = static_cast<std::uint32_t>(from_[iu] + w.low_u) + u;
          at[iv] = static_cast<std::uint32_t>(from_[iv] + w.low_v) + v;
          add_brick(layers, axis, iu, iv, masks.at({at[0], at[1], at[2]}));
        }
      }
    }
  }
  /// Bit i: whether any of the i-th bytes is set.
  [[nodiscard]] static std::uint64_t marks(const std::uint8_t* a, const std::uint8_t* b,
                                           const std::uint8_t* c) noexcept {
    std::uint64_t bits = 0;
    for (unsigned i = 0; i != 64; i += ORBIS_X86 ? 16 : 8) {
#if ORBIS_X86
      const auto load = [&](const std::uint8_t* p) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(p + i)); };
      const __m128i any = _mm_or_si128(_mm_or_si128(load(a), load(b)), load(c));
      bits |= std::uint64_t{static_cast<std::uint32_t>(_mm_movemask_epi8(any))} << i;
#else
      for (unsigned k = 0; k != 8; ++k) bits |= std::uint64_t{(a[i + k] | b[i + k] | c[i + k]) & 1U} << (i + k);
#endif
    }
    return bits;
  }
  /// Eight layers of eight rows of eight voxels.
  static void add_brick(const std::array<std::uint64_t, 8>& layers, std::size_t axis, std::size_t iu, std::size_t iv,
                        scan_brick& to) noexcept {
    std::array<std::uint64_t, 16> spread;  // four voxels along u
    for (std::uint32_t four = 0; four != 16; ++four) {
      spread[four] = 0;
      for (std::uint32_t i = 0; i != 4; ++i) spread[four] |= std::uint64_t{four >> i & 1U} << (spread3(i) << iu);
    }
    for (std::uint32_t i = 0; i != 8; ++i)
      for (std::uint32_t k = 0; k != 8; ++k) {
        const auto row = static_cast<std::uint32_t>(layers[i] >> (8 * k) & 0xffU);
        if (row == 0) continue;
        const std::uint32_t place = spread3(i) << axis | spread3(k) << iv;
        to.free[place >> 6U] |= spread[row & 15U] << (place & 63U);
        to.free[place >> 6U | 1U << iu] |= spread[row >> 4U] << (place & 63U);
      }
  }

  /// Walks the rays for which there is no other way: many together, those that are few or long alone.
  void walk_all(scan_masks& masks) {
    const voxel_key from = key(0, 0, 0);
    auto near = static_cast<std::uint32_t>(max_planes);
    bool together = false;
    for (;; near /= 2) {  // all of them, if they fit in a window
      voxel_key low = from, high = from;
      std::size_t count = 0;
      for (const target& t : walked_) {
        if (!is_within(t.to, from, near)) continue;
        ++count;
        low = {std::min(low.x, t.to.x), std::min(low.y, t.to.y), std::min(low.z, t.to.z)};
        high = {std::max(high.x, t.to.x), std::max(high.y, t.to.y), std::max(high.z, t.to.z)};
      }
      together = count >= many && window_.fit(*grid_, from, low, high);
      if (together || count < many || near == 0) break;
    }
    for (const target& t : walked_) {
      if (together && is_within(t.to, from, near))
        window_.add(*grid_, origin_, t.end, t.to);
      else
        masks.mark_ray(*grid_, origin_, from, t.end, t.to);
    }
    if (together) window_.flush(masks);
    walked_.clear();
  }
  [[nodiscard]] static bool is_within(const voxel_key& a, const voxel_key& b, std::uint32_t distance) noexcept {
    const auto near = [&](std::uint32_t c, std::uint32_t d) { return (c < d ? d - c : c - d) <= distance; };
    return near(a.x, b.x) && near(a.y, b.y) && near(a.z, b.z);
  }

  const voxel_grid* grid_ = nullptr;
  float3 origin_{};
  std::array<std::int32_t, 3> from_{};
  bool left_origin_ = false;
  std::array<face, 6> faces_;
  detail::swept_rays rays_;
  std::vector<std::uint8_t> bytes_;  ///< all zero between slabs
  std::vector<std::uint32_t> counts_;
  std::vector<bounds> bounds_;
  std::vector<std::uint32_t> doubtful_;
  std::vector<target> walked_;
  detail::ray_source source_;
  detail::ray_batch batch_;
  std::size_t batched_ = 0;
  bool by_eights_ = false;
  ray_grid window_;
  kernel* sweep_ = nullptr;
};

}  // namespace orbis::octree

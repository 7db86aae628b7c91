// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Preparation of rays as straight lines through planes of voxel faces, eight rays at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/rays/limit_rays.hpp>
#include <orbis/octree/detail/mark/rays/scan_origin.hpp>

namespace orbis::octree::detail {

/// Eight rays as linear functions of the position along their main axis, see queued_rays. The kind of a ray is eight
/// times its main axis, plus four if the ray descends along it, plus one if it descends along axis u, plus two if it
/// descends along axis v. Cells and planes are counted in steps from the start of the ray.
struct ray_setup {
  static constexpr std::size_t lanes = ray_batch::lanes;
  static constexpr std::int32_t kinds = 24;

  alignas(64) std::array<double, lanes> u, du, v, dv;
  alignas(64) std::array<std::int32_t, lanes> kind;
  alignas(64) std::array<std::int32_t, lanes> planes;          ///< number of planes that the ray crosses
  alignas(64) std::array<std::int32_t, lanes> cell_u, cell_v;  ///< cell after the last plane
  // Bit i refers to ray i.
  std::uint32_t done = 0;    ///< rays with a certain result; the others must be traversed step by step
  std::uint32_t step_u = 0;  ///< the ray crosses a face perpendicular to u between the last two planes
  std::uint32_t step_v = 0;
  std::uint32_t step_u_first = 0;  ///< the ray crosses the face perpendicular to u before the one perpendicular to v
  std::uint32_t end_u = 0;         ///< the ray crosses a face perpendicular to u between the last plane and its end
  std::uint32_t end_v = 0;
  std::uint32_t end_u_first = 0;

  [[nodiscard]] static constexpr std::size_t axis(std::int32_t kind) noexcept {
    return static_cast<std::size_t>(kind >> 3);
  }
  [[nodiscard]] static constexpr std::size_t axis_u(std::size_t axis) noexcept { return axis == 0 ? 1 : 0; }
  [[nodiscard]] static constexpr std::size_t axis_v(std::size_t axis) noexcept { return axis == 2 ? 1 : 2; }
  /// Returns for each axis 1 if rays of this kind descend along it, otherwise 0.
  [[nodiscard]] static constexpr std::array<std::size_t, 3> down(std::int32_t kind) noexcept {
    std::array<std::size_t, 3> is{};
    const auto bit = [&](int i) { return static_cast<std::size_t>(kind >> i & 1); };
    is[axis(kind)] = bit(2);
    is[axis_u(axis(kind))] = bit(0);
    is[axis_v(axis(kind))] = bit(1);
    return is;
  }
};

/// Upper bound, in voxels, on the difference between the results of a traversal and those of this header.
inline constexpr double ray_doubt = 1e-8;
/// Maximum number of planes that a ray crosses; rays that cross more are traversed step by step.
inline constexpr std::int32_t max_ray_planes = 4096;

struct set_up_rays_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const scan_origin& source, const ray_batch& rays, std::size_t i,
                                      ray_setup& out) noexcept {
    constexpr std::size_t n = Target::bytes == 64 ? 8 : 4;
    out.done = out.step_u = out.step_v = out.step_u_first = out.end_u = out.end_v = out.end_u_first = 0;
    for (std::size_t lane = 0; lane != ray_batch::lanes; lane += n)
      set_up<n, Target>(source, rays, i + lane, lane, out);
    out.done &= ray_batch::eight(rays.hit, i) | ray_batch::eight(rays.cut, i);
  }

 private:
  template <std::size_t N, simd::target Target>
  static ORBIS_ALWAYS_INLINE void set_up(const scan_origin& source, const ray_batch& rays, std::size_t i,
                                         std::size_t lane, ray_setup& out) noexcept {
    using floats = simd::vec<float, N, Target>;
    using doubles = simd::vec<double, N, Target>;
    using integers = simd::vec<std::int32_t, N, Target>;
    using mask = typename doubles::mask_type;
    const auto within = [](const doubles& x) ORBIS_INLINE_LAMBDA { return (x > ray_doubt) & (x < 1.0 - ray_doubt); };
    const auto ray_along = [&](std::size_t axis) ORBIS_INLINE_LAMBDA {
      return floats::load(rays.end[axis].data() + i) - floats(source.origin[axis]);
    };
    const std::array<floats, 3> ray{ray_along(0), ray_along(1), ray_along(2)};
    const floats squares = ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2];
    const floats reach = simd::convert<float>(sqrt(simd::convert<double>(squares)));
    const doubles length = simd::convert<double>(reach), metres = length * source.per_metre;
    mask good = (length > 0.0) & (length < 1e30);
    std::array<doubles, 3> speed, first, expected;
    std::array<mask, 3> down;
    for (std::size_t axis = 0; axis != 3; ++axis) {
      const doubles d = simd::convert<double>(ray[axis] / reach);
      down[axis] = d < 0.0;
      speed[axis] = abs(d);
      first[axis] = select(d == 0.0, doubles(0.5),
                           select(down[axis], doubles(source.first[1][axis]), doubles(source.first[0][axis])));
      const doubles way = simd::convert<double>(integers::load(rays.way[axis].data() + i));
      expected[axis] = select(down[axis], -way, way) -
                       select(down[axis], doubles(source.skipped[1][axis]), doubles(source.skipped[0][axis]));
      // True if the traversal reaches the end's voxel before it stops at the length of the ray.
      good = good & within(metres * speed[axis] - first[axis] + 1.0 - expected[axis]);
    }
    const mask y_main = speed[0] < speed[1];
    const mask z_main = select(y_main, speed[1], speed[0]) < speed[2], x_main = !(y_main | z_main);
    const auto along_main = [&](const std::array<doubles, 3>& a)
                                ORBIS_INLINE_LAMBDA { return select(z_main, a[2], select(y_main, a[1], a[0])); };
    const auto across_u = [&](const std::array<doubles, 3>& a)
                              ORBIS_INLINE_LAMBDA { return select(x_main, a[1], a[0]); };
    const auto across_v = [&](const std::array<doubles, 3>& a)
                              ORBIS_INLINE_LAMBDA { return select(z_main, a[1], a[2]); };
    const auto chosen = [](const mask& which, const mask& a, const mask& b)
                            ORBIS_INLINE_LAMBDA { return (which & a) | and_not(b, which); };
    const doubles per_plane = doubles(1.0) / along_main(speed), planes = along_main(expected);
    const doubles first_plane = along_main(first) - 1.0;
    good = good & (planes >= 0.0) & (planes <= double{max_ray_planes});

    struct line {
      doubles slope, cell, part, end, step;
    };
    const auto along = [&](const doubles& l_speed, const doubles& l_first, const doubles& l_expected,
                           const mask& l_down, double* at, double* slope, std::int32_t* cells) ORBIS_INLINE_LAMBDA {
      line l;
      l.slope = l_speed * per_plane;
      const doubles a = first_plane * l.slope - l_first + 1.0;
      const auto cell = [&](const doubles& planes_crossed, doubles& part) ORBIS_INLINE_LAMBDA {
        const mask none = planes_crossed < 0.5;
        const doubles last = a + planes_crossed * l.slope, whole = select(none, doubles(0.0), floor(last));
        part = last - whole;
        good = good & (none | within(part));
        return whole;
      };
      doubles part;
      const doubles before = cell(planes - 1.0, part);
      l.cell = cell(planes, l.part);
      l.step = l.cell - before;
      l.end = l_expected - l.cell;
      good = good & (l.end >= 0.0) & (l.end <= 1.0);
      select(l_down, 1.0 - a, a).store(at + lane);
      select(l_down, -l.slope, l.slope).store(slope + lane);
      simd::convert<std::int32_t>(l.cell).store(cells + lane);
      return l;
    };
    const mask down_u = chosen(x_main, down[1], down[0]), down_v = chosen(z_main, down[1], down[2]);
    const line u = along(across_u(speed), across_u(first), across_u(expected), down_u, out.u.data(), out.du.data(),
                         out.cell_u.data());
    const line v = along(across_v(speed), across_v(first), across_v(expected), down_v, out.v.data(), out.dv.data(),
                         out.cell_v.data());
    const doubles sure = ray_doubt * (u.slope + v.slope);
    const doubles end_order = (1.0 - v.part) * u.slope - (1.0 - u.part) * v.slope;
    const doubles step_order = u.part * v.slope - v.part * u.slope;
    const mask end_u = u.end > 0.5, end_v = v.end > 0.5, step_u = u.step > 0.5, step_v = v.step > 0.5;
    good = and_not(good, and_not(end_u & end_v, abs(end_order) > sure));
    good = and_not(good, and_not(step_u & step_v, abs(step_order) > sure));

    const auto flag = [](const mask& m, std::int32_t bit)
                          ORBIS_INLINE_LAMBDA { return select(simd::mask_as<4>(m), integers(bit), integers(0)); };
    const mask main_down = chosen(z_main, down[2], chosen(y_main, down[1], down[0]));
    (flag(and_not(y_main, z_main), 8) + flag(z_main, 16) + flag(main_down, 4) + flag(down_v, 2) + flag(down_u, 1))
        .store(out.kind.data() + lane);
    simd::convert<std::int32_t>(planes).store(out.planes.data() + lane);
    const auto put = [&](std::uint32_t& to, const mask& m) ORBIS_INLINE_LAMBDA { to |= simd::bits(m) << lane; };
    put(out.done, good);
    put(out.step_u, step_u);
    put(out.step_v, step_v);
    put(out.step_u_first, step_order > 0.0);
    put(out.end_u, end_u);
    put(out.end_v, end_v);
    put(out.end_u_first, end_order > 0.0);
  }
};

using setup_kernel = void(const scan_origin&, const ray_batch&, std::size_t, ray_setup&);

/// Sets up eight rays of a batch, starting with the i-th.
template <class = void>
[[nodiscard]] inline setup_kernel* set_up_rays() noexcept {
  return simd::kernel<set_up_rays_kernel, setup_kernel>();
}

}  // namespace orbis::octree::detail

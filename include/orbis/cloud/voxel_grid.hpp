// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One point for each occupied voxel.
#pragma once

#include <array>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ranges>
#include <span>
#include <type_traits>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/detail/threads_of.hpp>
#include <orbis/cloud/detail/voxels/voxel_hash.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/random.hpp>

namespace orbis::cloud {

/// Gathers points into voxels as they come: memory follows the surface, not the number of points.
class voxel_accumulator {
 public:
  /// @pre size > 0, metres
  explicit voxel_accumulator(double size) : voxels_{size} {}

  /// Adds a point and returns the number of its voxel; empty for points that have none (see
  /// `voxel_hash::key_of`).
  template <point_like P>
  std::optional<std::uint32_t> add(const P& point, const rgb8& color = {}) {
    const auto key = voxels_.key_of(point);
    if (!key) return std::nullopt;
    const std::uint32_t number = voxels_.insert(*key);
    if (number == sums_.size()) sums_.emplace_back();
    sum& s = sums_[number];
    const auto p = coordinates<double>(point);
    for (std::size_t a = 0; a != 3; ++a) s.position[a] += p[a];
    s.color[0] += color.r;
    s.color[1] += color.g;
    s.color[2] += color.b;
    ++s.count;
    return number;
  }
  /// The number of the voxel a point lies in, if something was added there.
  template <point_like P>
  [[nodiscard]] std::optional<std::uint32_t> find(const P& point) const {
    const auto key = voxels_.key_of(point);
    return key ? voxels_.find(*key) : std::nullopt;
  }
  [[nodiscard]] std::size_t size() const noexcept { return sums_.size(); }
  /// How many points were added to a voxel. @pre number < size()
  [[nodiscard]] std::uint32_t count(std::uint32_t number) const { return sums_[number].count; }

  /// The centroids with their mean colours, by voxel number: in the order in which the voxels were
  /// first seen.
  [[nodiscard]] point_cloud centroids(bool with_colors = true) const {
    point_cloud out;
    out.points.reserve(sums_.size());
    if (with_colors) out.colors.reserve(sums_.size());
    for (const sum& s : sums_) {
      const double n = s.count;
      out.points.emplace_back(static_cast<float>(s.position[0] / n), static_cast<float>(s.position[1] / n),
                              static_cast<float>(s.position[2] / n));
      const auto channel = [&](std::size_t c) {
        return static_cast<std::uint8_t>((s.color[c] + s.count / 2) / s.count);  // rounded
      };
      if (with_colors) out.colors.push_back({channel(0), channel(1), channel(2)});
    }
    return out;
  }

 private:
  struct sum {
    std::array<double, 3> position{};
    std::array<std::uint64_t, 3> color{};
    std::uint32_t count = 0;
  };
  detail::voxel_hash voxels_;
  std::vector<sum> sums_;
};

struct voxel_grid_options {
  double size = 0.01;  ///< edge of a voxel, metres; > 0
};

/// What stands for the points of a voxel: their centroid, with the mean of their colours.
struct voxel_centroid {};
/// The first of them.
struct voxel_first {
  [[nodiscard]] static constexpr bool replaces(std::uint32_t /*kept*/, std::uint32_t /*candidate*/) noexcept {
    return false;
  }
};
/// Any of them with the same probability; which one depends on the seed and the indices alone.
struct voxel_random {
  std::uint64_t seed = 1;
  [[nodiscard]] constexpr bool replaces(std::uint32_t kept, std::uint32_t candidate) const noexcept {
    return rank(candidate) < rank(kept);
  }

 private:
  [[nodiscard]] constexpr std::uint64_t rank(std::uint32_t i) const noexcept { return mix64(seed ^ mix64(i)); }
};

/// Chooses one of a voxel's points: `replaces(kept, candidate)`, indices into the cloud, says whether a point
/// that comes later takes the place of the one chosen so far.
template <class C>
concept voxel_choice = requires(const C& choice, std::uint32_t i) {
  { choice.replaces(i, i) } -> std::convertible_to<bool>;
};

namespace detail {

/// The number type in which cells are found: double holds all that a cloud can have.
template <point_range Points>
using voxel_scalar =
    std::conditional_t<std::is_same_v<point_scalar_t<std::ranges::range_value_t<Points>>, float>, float, double>;

/// A choice of a type that is the user's own.
struct any_choice {
  const void* choice = nullptr;
  bool (*ask)(const void* choice, std::uint32_t kept, std::uint32_t candidate) = nullptr;
  [[nodiscard]] bool replaces(std::uint32_t kept, std::uint32_t candidate) const {
    return ask(choice, kept, candidate);
  }
};
template <voxel_choice Choice>
[[nodiscard]] auto known_choice(const Choice& choice) noexcept {
  if constexpr (std::same_as<Choice, voxel_first> || std::same_as<Choice, voxel_random>)
    return choice;
  else
    return any_choice{&choice, [](const void* own, std::uint32_t kept, std::uint32_t candidate) -> bool {
                        return static_cast<const Choice*>(own)->replaces(kept, candidate);
                      }};
}

/// `voxel_grid_indices` and `voxel_grid` for any points.
template <execution_policy Policy, std::floating_point S, voxel_choice Choice>
[[nodiscard]] std::vector<std::uint32_t> choose_in_voxels(const Policy& policy, const basic_point_view<S>& points,
                                                          double size, const Choice& choice);
template <execution_policy Policy, std::floating_point S>
[[nodiscard]] point_cloud find_centroids(const Policy& policy, const basic_point_view<S>& points,
                                         std::span<const rgb8> colors, double size);

}  // namespace detail

/// The index of one point for each occupied voxel, in the order in which the voxels are first seen; with
/// `voxel_first` that is ascending; the same for every policy. Whatever belongs to the points rides along by index.
/// Points that are not finite are left out, as are those more than 2^31 voxels from the origin. O(n). Memory
/// meanwhile: about 20 bytes per point and 10 MB, on one thread the latter alone for at most 2^17 points.
/// @pre size > 0, fewer than 2^32 - 1 points; `choice` may be asked by several threads at a time
template <execution_policy Policy, point_range Points, voxel_choice Choice = voxel_first>
[[nodiscard]] std::vector<std::uint32_t> voxel_grid_indices(const Policy& policy, const Points& points,
                                                            const voxel_grid_options& options = {},
                                                            const Choice& choice = {}) {
  return detail::choose_in_voxels(detail::threads_of(policy),
                                  detail::basic_viewed_points<detail::voxel_scalar<Points>>{points}.view(),
                                  options.size, detail::known_choice(choice));
}

/// One point for each occupied voxel, in the order in which the voxels are first seen, with its colour where
/// `colors` is not empty: by default the centroid, with `voxel_first`, `voxel_random` or another
/// `voxel_choice` one of the points; the same for every policy. Points that are not finite are left out, as are those
/// more than 2^31 voxels from the origin. O(n). Memory meanwhile: about 20 bytes
/// per point, 25 with colours, and 25 MB, on one thread the latter alone for at most 2^17 points.
///
/// Coordinates are summed in double in the order of the points. Where many voxels are occupied, the points are first
/// brought into parts whose voxels fit into the cache.
/// @pre size > 0, fewer than 2^32 - 1 points; colors is empty or as long as points
template <execution_policy Policy, point_range Points>
[[nodiscard]] point_cloud voxel_grid(const Policy& policy, const Points& points, std::span<const rgb8> colors,
                                     const voxel_grid_options& options = {}, voxel_centroid /*tag*/ = {}) {
  assert(colors.empty() || colors.size() == std::ranges::size(points));
  return detail::find_centroids(detail::threads_of(policy),
                                detail::basic_viewed_points<detail::voxel_scalar<Points>>{points}.view(), colors,
                                options.size);
}
template <execution_policy Policy, point_range Points, voxel_choice Choice>
[[nodiscard]] point_cloud voxel_grid(const Policy& policy, const Points& points, std::span<const rgb8> colors,
                                     const voxel_grid_options& options, const Choice& choice) {
  assert(colors.empty() || colors.size() == std::ranges::size(points));
  const std::vector<std::uint32_t> chosen = voxel_grid_indices(policy, points, options, choice);
  point_cloud out;
  out.points.reserve(chosen.size());
  if (!colors.empty()) out.colors.reserve(chosen.size());
  for (const std::uint32_t i : chosen) {
    const auto p = coordinates<float>(detail::point_at(points, i));
    out.points.emplace_back(p[0], p[1], p[2]);
    if (!colors.empty()) out.colors.push_back(colors[i]);
  }
  return out;
}

/// One point for each occupied voxel of a cloud without colours.
template <execution_policy Policy, point_range Points, class Choice = voxel_centroid>
requires(voxel_choice<Choice> || std::same_as<Choice, voxel_centroid>) [[nodiscard]] point_cloud
    voxel_grid(const Policy& policy, const Points& points, const voxel_grid_options& options = {},
               const Choice& choice = {}) {
  return voxel_grid(policy, points, std::span<const rgb8>{}, options, choice);
}

/// One point, with its colour, for each occupied voxel of a `point_cloud`.
template <execution_policy Policy, class Choice = voxel_centroid>
requires(voxel_choice<Choice> || std::same_as<Choice, voxel_centroid>) [[nodiscard]] point_cloud
    voxel_grid(const Policy& policy, const point_cloud& cloud, const voxel_grid_options& options = {},
               const Choice& choice = {}) {
  return voxel_grid(policy, cloud.points, cloud.colors, options, choice);
}

// The same on the calling thread.

template <point_range Points, voxel_choice Choice = voxel_first>
[[nodiscard]] std::vector<std::uint32_t> voxel_grid_indices(const Points& points,
                                                            const voxel_grid_options& options = {},
                                                            const Choice& choice = {}) {
  return voxel_grid_indices(seq, points, options, choice);
}
template <point_range Points, class Choice = voxel_centroid>
requires(voxel_choice<Choice> || std::same_as<Choice, voxel_centroid>) [[nodiscard]] point_cloud
    voxel_grid(const Points& points, std::span<const rgb8> colors, const voxel_grid_options& options = {},
               const Choice& choice = {}) {
  return voxel_grid(seq, points, colors, options, choice);
}
template <point_range Points, class Choice = voxel_centroid>
requires(voxel_choice<Choice> || std::same_as<Choice, voxel_centroid>) [[nodiscard]] point_cloud
    voxel_grid(const Points& points, const voxel_grid_options& options = {}, const Choice& choice = {}) {
  return voxel_grid(seq, points, std::span<const rgb8>{}, options, choice);
}
template <class Choice = voxel_centroid>
requires(voxel_choice<Choice> || std::same_as<Choice, voxel_centroid>) [[nodiscard]] point_cloud
    voxel_grid(const point_cloud& cloud, const voxel_grid_options& options = {}, const Choice& choice = {}) {
  return voxel_grid(seq, cloud, options, choice);
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/voxel_grid-inl.hpp>
#endif

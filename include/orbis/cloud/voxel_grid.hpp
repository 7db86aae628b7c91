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
#include <vector>

#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/detail/voxels/voxel_hash.hpp>
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

/// The index of one point for each occupied voxel, in the order in which the voxels are first seen; with
/// `voxel_first` that is ascending. Whatever belongs to the points rides along by index. Points that are not
/// finite are left out, as are those more than 2^31 voxels from the origin. O(n).
/// @pre size > 0, fewer than 2^32 points
template <point_range Points, voxel_choice Choice = voxel_first>
[[nodiscard]] std::vector<std::uint32_t> voxel_grid_indices(const Points& points,
                                                            const voxel_grid_options& options = {},
                                                            const Choice& choice = {}) {
  detail::voxel_hash voxels{options.size};
  std::vector<std::uint32_t> chosen;
  std::uint32_t i = 0;
  for (const auto& p : points) {
    if (const auto key = voxels.key_of(p)) {
      const std::uint32_t number = voxels.insert(*key);
      if (number == chosen.size()) {
        chosen.push_back(i);
      } else if (choice.replaces(chosen[number], i)) {
        chosen[number] = i;
      }
    }
    ++i;
  }
  return chosen;
}

/// One point for each occupied voxel, in the order in which the voxels are first seen, with its colour where
/// `colors` is not empty: by default the centroid, with `voxel_first`, `voxel_random` or another
/// `voxel_choice` one of the points. Points that are not finite are left out, as are those more than 2^31
/// voxels from the origin. O(n).
/// @pre size > 0; colors is empty or as long as points
template <point_range Points>
[[nodiscard]] point_cloud voxel_grid(const Points& points, std::span<const rgb8> colors,
                                     const voxel_grid_options& options = {}, voxel_centroid /*tag*/ = {}) {
  assert(colors.empty() || colors.size() == std::ranges::size(points));
  voxel_accumulator voxels{options.size};
  std::size_t i = 0;
  for (const auto& p : points) {
    voxels.add(p, colors.empty() ? rgb8{} : colors[i]);
    ++i;
  }
  return voxels.centroids(!colors.empty());
}
template <point_range Points, voxel_choice Choice>
[[nodiscard]] point_cloud voxel_grid(const Points& points, std::span<const rgb8> colors,
                                     const voxel_grid_options& options, const Choice& choice) {
  assert(colors.empty() || colors.size() == std::ranges::size(points));
  point_cloud out;
  for (const std::uint32_t i : voxel_grid_indices(points, options, choice)) {
    const auto p = coordinates<float>(detail::point_at(points, i));
    out.points.emplace_back(p[0], p[1], p[2]);
    if (!colors.empty()) out.colors.push_back(colors[i]);
  }
  return out;
}

/// One point for each occupied voxel of a cloud without colours.
template <point_range Points, class Choice = voxel_centroid>
requires(voxel_choice<Choice> || std::same_as<Choice, voxel_centroid>) [[nodiscard]] point_cloud
    voxel_grid(const Points& points, const voxel_grid_options& options = {}, const Choice& choice = {}) {
  return voxel_grid(points, std::span<const rgb8>{}, options, choice);
}

/// One point, with its colour, for each occupied voxel of a `point_cloud`.
template <class Choice = voxel_centroid>
requires(voxel_choice<Choice> || std::same_as<Choice, voxel_centroid>) [[nodiscard]] point_cloud
    voxel_grid(const point_cloud& cloud, const voxel_grid_options& options = {}, const Choice& choice = {}) {
  return voxel_grid(cloud.points, cloud.colors, options, choice);
}

}  // namespace orbis::cloud

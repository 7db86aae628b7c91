// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One point for each occupied voxel.
#pragma once

#include <array>
#include <bit>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <ranges>
#include <span>
#include <type_traits>
#include <vector>

#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/detail/voxels/fold_voxels.hpp>
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

/// Sums the points of a voxel, and their colours.
template <bool Colored>
struct centroid_fold {
  static constexpr bool has_colors = Colored;
  struct plain_record {
    std::array<double, 3> position;
    std::uint32_t count;
  };
  struct colored_record : plain_record {
    std::array<std::uint64_t, 3> color;
  };
  using record = std::conditional_t<Colored, colored_record, plain_record>;
  static constexpr record empty{};

  std::span<const rgb8> colors;
  point_cloud& out;

  void add(record& r, std::uint32_t i, const std::array<double, 3>& p) const {
    for (std::size_t a = 0; a != 3; ++a) r.position[a] += p[a];
    if constexpr (Colored) {
      r.color[0] += colors[i].r;
      r.color[1] += colors[i].g;
      r.color[2] += colors[i].b;
    }
    ++r.count;
  }
  [[nodiscard]] voxel_summary summary(const record& r) const {
    voxel_summary out;
    const auto mean = [&](double sum) { return r.count == 1 ? sum : sum / r.count; };  // many voxels have one point
    for (std::size_t a = 0; a != 3; ++a)
      out.words[a] = std::bit_cast<std::uint32_t>(static_cast<float>(mean(r.position[a])));
    if constexpr (Colored) {
      const auto channel = [&](std::size_t c) {
        return static_cast<std::uint8_t>((r.color[c] + r.count / 2) / r.count);  // rounded
      };
      out.color = {channel(0), channel(1), channel(2)};
    }
    return out;
  }
  void resize(std::size_t count) {
    out.points.resize(count);
    if constexpr (Colored) out.colors.resize(count);
  }
  void put(std::uint32_t number, const voxel_summary& s) {
    for (std::size_t a = 0; a != 3; ++a)
      out.points[number][static_cast<Eigen::Index>(a)] = std::bit_cast<float>(s.words[a]);
    if constexpr (Colored) out.colors[number] = s.color;
  }
};

/// Keeps one point of a voxel.
template <class Choice>
struct choice_fold {
  static constexpr bool has_colors = false;
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  struct record {
    std::uint32_t chosen;
  };
  static constexpr record empty{none};

  const Choice& choice;
  std::vector<std::uint32_t>& out;

  void add(record& r, std::uint32_t i, const std::array<double, 3>& /*p*/) const {
    if (r.chosen == none || choice.replaces(r.chosen, i)) r.chosen = i;
  }
  [[nodiscard]] voxel_summary summary(const record& r) const { return {{r.chosen}, {}}; }
  void resize(std::size_t count) { out.resize(count); }
  void put(std::uint32_t number, const voxel_summary& s) { out[number] = s.words[0]; }
};

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
  std::vector<std::uint32_t> chosen;
  detail::fold_voxels(policy, points, options.size, detail::choice_fold<Choice>{choice, chosen});
  return chosen;
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
  point_cloud out;
  if (colors.empty())
    detail::fold_voxels(policy, points, options.size, detail::centroid_fold<false>{colors, out});
  else
    detail::fold_voxels(policy, points, options.size, detail::centroid_fold<true>{colors, out});
  return out;
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

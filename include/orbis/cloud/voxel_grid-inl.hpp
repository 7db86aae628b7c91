// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of voxel_grid.hpp.
#pragma once

#include <bit>
#include <limits>

#include <orbis/cloud/detail/voxels/fold_voxels.hpp>
#include <orbis/cloud/voxel_grid.hpp>

namespace orbis::cloud {

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

template <execution_policy Policy, std::floating_point S, voxel_choice Choice>
std::vector<std::uint32_t> choose_in_voxels(const Policy& policy, const basic_point_view<S>& points, double size,
                                            const Choice& choice) {
  std::vector<std::uint32_t> chosen;
  fold_voxels(policy, points, size, choice_fold<Choice>{choice, chosen});
  return chosen;
}

template <execution_policy Policy, std::floating_point S>
point_cloud find_centroids(const Policy& policy, const basic_point_view<S>& points, std::span<const rgb8> colors,
                           double size) {
  point_cloud out;
  if (colors.empty())
    fold_voxels(policy, points, size, centroid_fold<false>{colors, out});
  else
    fold_voxels(policy, points, size, centroid_fold<true>{colors, out});
  return out;
}

}  // namespace detail

}  // namespace orbis::cloud

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// From posed keyframes to a map, all at once: dense cloud, filtered cloud, octrees.
#pragma once

#include <chrono>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ranges>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/mapping/dense_cloud.hpp>
#include <orbis/mapping/detail/moving/find_moving.hpp>
#include <orbis/mapping/filter.hpp>
#include <orbis/mapping/keyframe.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/mapping/masked_depth.hpp>
#include <orbis/mapping/moving_options.hpp>
#include <orbis/octree/occupancy_octree.hpp>

namespace orbis::mapping {

struct map_options {
  dense_options dense{};
  /// Takes what has moved away out of the depth images before they become points: cells that the rays of the keyframes
  /// just before and after pass through, see moving_filter. (Rays that a filter asks are those of the images as they
  /// came.) Of depth images that are no depth_view<std::uint16_t>, what is farther away than 16 m says nothing. Empty:
  /// the filter judges it as it judges anything else.
  std::optional<moving_filter_options> moving{};
  filter_options filter{};
  double resolution = 0.05;                   ///< of the octrees, metres; > 0
  octree::integration_options integration{};  ///< of every keyframe's depth image into the octrees
  bool unfiltered_octree = true;              ///< build the octree of the cloud before the filter as well
};

/// A map that depth images of this camera can be integrated into, made of its resolution in metres; what
/// `octree::occupancy_octree` is.
template <class M, class Camera>
concept depth_map = std::constructible_from<M, double> && std::movable<M> &&
    requires(M& map, const camera::depth_view<float>& depth, const Camera& camera, const se3& T_world_camera,
             const octree::integration_options& options) {
  map.integrate(seq, depth, camera, T_world_camera, options);
};

/// What was taken out of the depth images, for it had moved away.
struct moving_count {
  std::size_t keyframes = 0;  ///< that have lost any pixel
  std::size_t pixels = 0;     ///< of the whole images, whatever the stride
};

/// The map, and how it came to be.
template <class Octree>
struct built_map {
  point_cloud cloud{};                        ///< all keyframes' points, in the world
  cloud::flying_pixel_count flying_pixels{};  ///< left out before they became points, if that was asked for
  moving_count moving{};                      ///< left out before that, if it was asked for
  std::vector<std::uint32_t> inliers{};       ///< indices into `cloud` of the points that the filter kept, ascending
  filter_report filter{};
  std::optional<Octree> unfiltered_octree{};
  Octree octree;                               ///< of the points that the filter kept, each seen from its own keyframe
  std::vector<double> insert_ms{};             ///< into `octree`, for each keyframe
  std::vector<double> insert_ms_unfiltered{};  ///< into `unfiltered_octree`, for each keyframe, if it is built
  std::size_t skipped = 0;                     ///< keyframes without a finite pose

  /// The points that the filter kept, copied.
  [[nodiscard]] point_cloud filtered_cloud() const { return cloud::extract(cloud, inliers); }
};

namespace detail {

[[nodiscard]] inline std::string reason_of(const moving_count& moving) {
  return std::to_string(moving.pixels) + " pixels of " + std::to_string(moving.keyframes) +
         (moving.keyframes == 1 ? " keyframe show" : " keyframes show") +
         " what has moved away, as the rays of other keyframes pass through it, and were left out";
}

/// A keyframe's depth image without what has moved away.
template <camera::depth_source Depth>
class standing_depth {
 public:
  /// Calls `use` with the image. Returns how many pixels were taken out.
  template <class Use>
  std::size_t with(const Depth& depth, const std::vector<removed_cell>* cells, const moving_filter_options& options,
                   const Use& use) {
    if (cells == nullptr || cells->empty()) {
      use(depth);
      return 0;
    }
    if (copy_.width() != depth.width() || copy_.height() != depth.height())
      copy_ = image<mapping::depth_pixel<Depth>>(depth.width(), depth.height());
    for (int y = 0; y != depth.height(); ++y)
      for (int x = 0; x != depth.width(); ++x) copy_(x, y) = stored_depth(depth, x, y);
    const std::size_t removed = remove_cells(depth, *cells, options, copy_.view());
    use(view_like(depth, std::as_const(copy_).view()));
    return removed;
  }

 private:
  image<mapping::depth_pixel<Depth>> copy_;
};

/// The steps of `build_map`. `into.wants(filtered, keyframe, whole)` says whether it lacks this keyframe's depth image,
/// of which, unless it is `whole`, something has moved away;
/// `into.scan(filtered, keyframe, depth)` takes one depth image, before and after the filter;
/// `into.complete(filtered)` gives the map of all of them.
template <class Octree, execution_policy Policy, keyframe_range Keyframes, camera::camera_model Camera, class Into>
[[nodiscard]] result<built_map<Octree>> build_map_into(const Policy& policy, const Keyframes& keyframes,
                                                       const Camera& camera, const map_options& options,
                                                       const progress& on_progress, Into& into) {
  if (std::ranges::size(keyframes) == 0) return fail(errc::no_data, "keyframes", "there are none");
  if (!(options.resolution > 0) || !std::isfinite(options.resolution))
    return fail(errc::invalid_argument, "resolution", "must be positive");
  if (options.dense.stride <= 0) return fail(errc::invalid_argument, "stride", "must be positive");
  if (const auto& flying = options.dense.flying_pixels; flying && (flying->reach < 1 || flying->reach > 8))
    return fail(errc::invalid_argument, "flying_pixels.reach", "must be from 1 to 8");
  if (!(options.dense.voxel_size >= 0) || !std::isfinite(options.dense.voxel_size))
    return fail(errc::invalid_argument, "voxel_size", "must be finite and not negative");
  if (!(options.integration.max_range >= 0)) return fail(errc::invalid_argument, "max_range", "must not be negative");
  const filter_options& filter = options.filter;
  if (filter.automatic.neighbors == 0 || filter.statistical.neighbors == 0 || filter.log_statistical.neighbors == 0 ||
      filter.cluster.neighbors == 0)
    return fail(errc::invalid_argument, "neighbors", "must be positive");
  if (!(filter.radius.radius >= 0)) return fail(errc::invalid_argument, "radius", "must not be negative");
  if (!(filter.cluster.reach >= 0 && filter.cluster.min_gap >= 0))
    return fail(errc::invalid_argument, "cluster", "reach and min_gap must not be negative");
  if (const auto& rays = filter.ray_evidence;
      !(rays.window >= 0 && rays.margin >= 0 && rays.margin_growth >= 0 && rays.slant >= 0))
    return fail(errc::invalid_argument, "ray_evidence", "window, margins and slant must not be negative");
  const moving_filter_options moving = options.moving.value_or(moving_filter_options{});
  if (moving.keyframes == 0 || moving.min_through <= 0)
    return fail(errc::invalid_argument, "moving", "keyframes and min_through must be positive");
  if (moving.grow < 0) return fail(errc::invalid_argument, "moving", "grow must not be negative");
  if (!(moving.margin >= 0 && moving.margin_growth >= 0 && moving.slant >= 0 && moving.ratio >= 0))
    return fail(errc::invalid_argument, "moving", "margins, slant and ratio must not be negative");
  const auto fits = [&](const auto& image) {
    return image.width() == camera.width() && image.height() == camera.height();
  };
  const auto finite_pose = [](const auto& k) { return se3(k.T_world_camera).to_matrix().allFinite(); };
  const std::size_t looks = view_passes(options.filter);
  const std::size_t passes = (options.unfiltered_octree ? 3U : 2U) + (options.moving ? 1U : 0U) + looks;
  const std::size_t total = passes * std::ranges::size(keyframes);
  std::size_t done = 0;

  built_map<Octree> map{.octree = Octree{options.resolution}};
  bool cancelled = false;
  std::vector<std::vector<removed_cell>> moved;
  if (options.moving) {
    moved = find_moving(policy, keyframes, camera, moving, [&] {
      cancelled = !on_progress(++done, total);
      return !cancelled;
    });
    if (cancelled) return fail(errc::cancelled, {}, "cancelled");
  }
  standing_depth<std::remove_cvref_t<decltype(std::declval<const std::ranges::range_value_t<Keyframes>&>().depth)>>
      standing;
  const auto moved_of = [&](std::size_t index) { return moved.empty() ? nullptr : &moved[index]; };

  dense_cloud dense{camera::ray_table{camera}, options.dense};
  std::size_t index = 0;
  for (const auto& k : keyframes) {
    const image_view<const rgb8> color = k.color;
    if (!fits(k.depth) || (!color.empty() && !fits(color))) {
      return fail(errc::invalid_argument, "keyframes", "an image is not of the camera's size");
    }
    if (finite_pose(k)) {
      const se3 T_world_camera{k.T_world_camera};
      const std::size_t removed = standing.with(k.depth, moved_of(index), moving, [&](const auto& depth) {
        dense.add_keyframe(policy, keyframe<std::remove_cvref_t<decltype(depth)>>{depth, color, T_world_camera});
      });
      map.moving.keyframes += removed != 0 ? 1 : 0;
      map.moving.pixels += removed;
    } else {
      ++map.skipped;
    }
    ++index;
    if (!on_progress(++done, total)) return fail(errc::cancelled, {}, "cancelled");
  }

  map.cloud = dense.cloud(policy);
  std::vector<float> ranges = dense.ranges(policy);
  dense.finish();
  map.flying_pixels = dense.flying_pixels();
  const auto while_filtering = [&](std::size_t views_done, std::size_t) {
    cancelled = cancelled || !on_progress(done + views_done, total);
    return !cancelled;
  };
  filtered_indices filtered =
      filter_points(policy, map.cloud.points, ranges, keyframes, camera, options.filter, while_filtering);
  if (cancelled) return fail(errc::cancelled, {}, "cancelled");
  std::vector<float>{}.swap(ranges);
  done += looks * std::ranges::size(keyframes);
  map.filter = std::move(filtered.report);
  if (map.moving.pixels != 0) map.filter.reason = reason_of(map.moving) + "; " + map.filter.reason;
  map.inliers = std::move(filtered.inliers);
  std::vector<char> kept(map.cloud.size(), 0);
  for (const std::uint32_t i : map.inliers) kept[i] = 1;

  const auto scan_all = [&](bool filtered, const dense_cloud::selection& kept_points,
                            std::vector<double>& milliseconds) -> result<void> {
    std::size_t number = 0, at = 0;
    for (const auto& k : keyframes) {
      const std::vector<removed_cell>* const cells = moved_of(at++);
      if (finite_pose(k)) {
        const result<bool> wanted = into.wants(filtered, k, cells == nullptr || cells->empty());
        if (!wanted) return fail(wanted.error());
        std::chrono::steady_clock::duration time{};
        if (*wanted) {
          image<mapping::depth_pixel<std::remove_cvref_t<decltype(k.depth)>>> depth;
          standing.with(k.depth, cells, moving, [&](const auto& whole) {
            depth = dense.masked_depth(policy, keyframe<std::remove_cvref_t<decltype(whole)>>{whole, {}, {}}, number,
                                       kept_points);
          });
          const auto start = std::chrono::steady_clock::now();
          if (auto scanned = into.scan(filtered, k, view_like(k.depth, std::as_const(depth).view())); !scanned)
            return scanned;
          time = std::chrono::steady_clock::now() - start;
        }
        ++number;
        milliseconds.push_back(std::chrono::duration<double, std::milli>(time).count());
      }
      if (!on_progress(++done, total)) return fail(errc::cancelled, {}, "cancelled");
    }
    return {};
  };
  if (options.unfiltered_octree) {
    if (auto scanned = scan_all(false, {}, map.insert_ms_unfiltered); !scanned) return fail(std::move(scanned.error()));
    auto octree = into.complete(false);
    if (!octree) return fail(std::move(octree.error()));
    map.unfiltered_octree.emplace(*std::move(octree));
  }
  if (auto scanned = scan_all(true, dense.select(std::move(kept)), map.insert_ms); !scanned)
    return fail(std::move(scanned.error()));
  auto octree = into.complete(true);
  if (!octree) return fail(std::move(octree.error()));
  map.octree = *std::move(octree);
  return map;
}

/// Into octrees of their own.
template <class Octree, class Policy, class Camera>
struct fresh_octrees {
  const Policy& policy;
  const Camera& camera;
  const map_options& options;
  std::optional<Octree> octree{};  // options are checked before the first scan

  template <class Keyframe>
  result<bool> wants(bool, const Keyframe&, bool) const {
    return true;
  }
  template <class Keyframe, class Depth>
  result<void> scan(bool, const Keyframe& k, const Depth& depth) {
    if (!octree) octree.emplace(options.resolution);
    octree->integrate(policy, depth, camera, se3(k.T_world_camera), options.integration);
    return {};
  }
  result<Octree> complete(bool) {
    std::optional<Octree> whole = std::exchange(octree, std::nullopt);
    return whole ? *std::move(whole) : Octree{options.resolution};
  }
};

/// Into a live map, which has most of the keyframes already.
template <class Live, class Policy>
struct live_octree {
  const Policy& policy;
  Live& live;
  std::vector<keyframe_position> poses{};

  template <class Keyframe>
  result<bool> wants(bool filtered, const Keyframe& k, bool whole) {
    if (filtered) return true;
    if (!poses.empty() && !(poses.back().frame < k.frame))
      return fail(errc::invalid_argument, "keyframes", "their frame numbers do not ascend");
    poses.push_back({k.frame, se3(k.T_world_camera)});
    return !whole || !live.contains(k.frame) || live.is_filtered(k.frame);
  }
  template <class Keyframe, class Depth>
  result<void> scan(bool filtered, const Keyframe& k, const Depth& depth) {
    // Where the images' file cannot be written to, they stay in memory: nothing is lost.
    const auto unless_kept = [](error e) -> result<void> {
      if (e.code == errc::write_failed) return {};
      return fail(std::move(e));
    };
    if (filtered) {
      auto set = live.set_depth(policy, k.frame, depth);
      return set ? result<void>{} : unless_kept(std::move(set.error()));
    }
    // Not complete even before the filter: pixels of what moved away may be missing, and an end may come before the
    // filter's verdict.
    auto added = live.add_keyframe(policy, k.frame, depth, poses.back().T_world_camera, completeness::filtered);
    return added ? result<void>{} : unless_kept(std::move(added.error()));
  }
  result<typename Live::octree_type> complete(bool filtered) {
    if (!filtered) live.set_poses(poses, unlisted::hide);
    if (auto finished = live.finish(policy); !finished) return fail(std::move(finished.error()));
    return live.snapshot();
  }
};

}  // namespace detail

/// Takes what has moved away out of the depth images, if that is asked for, adds the keyframes to a cloud, filters it,
/// and integrates each keyframe's depth image without the pixels whose point of the cloud the filter removed
/// (`dense_cloud::masked_depth`), with rays from where that keyframe was. Filtering the whole cloud lets one keyframe's
/// points judge another's; the automatic filter asks the keyframes' depth images as well which points their rays pass
/// through. The octrees are those that a `live_map` makes of the same depth images and poses, bit for bit.
///
/// Keyframes whose pose is not finite are skipped and counted. Errors: `no_data` if there is no
/// keyframe; `invalid_argument` if an image's size is not the camera's, or an option is out of range;
/// `cancelled`. The same result for every policy. `on_progress` counts the keyframes of all passes.
template <class Octree = octree::occupancy_octree<>, execution_policy Policy, keyframe_range Keyframes,
          camera::camera_model Camera>
requires depth_map<Octree, Camera>
[[nodiscard]] result<built_map<Octree>> build_map(const Policy& policy, const Keyframes& keyframes,
                                                  const Camera& camera, const map_options& options = {},
                                                  progress on_progress = {}) {
  detail::fresh_octrees<Octree, Policy, Camera> into{policy, camera, options};
  return detail::build_map_into<Octree>(policy, keyframes, camera, options, on_progress, into);
}

/// As above, by a live map that grew while these keyframes were made: they are moved to the poses that they have now,
/// those that it does not have are added, others are hidden, and then the filter's verdict is taken over. The octrees
/// are bit for bit those of the function above. Keyframes have a member `frame`, the index by which the live map knows
/// them, and come in the order of these. The times in the result are those of handing over images, without replaying.
/// `options.resolution` and `options.integration` are those of the live map, and the unfiltered octree is always made.
/// Errors, in addition: `invalid_argument` if the frame numbers do not ascend; those of the live map, but for images
/// that stay in memory because they cannot be written to their file. @pre what the live map has was added with the
/// depth that `keyframe_points::masked` leaves under `point_options(options.dense)`, but for keyframes that are
/// `live_map::is_filtered`, which get it again
template <execution_policy Policy, keyframe_range Keyframes, octree::replayable_octree Octree,
          camera::camera_model Camera, depth_history Depths>
requires requires(const std::ranges::range_value_t<Keyframes>& k) {
  { k.frame } -> std::convertible_to<std::uint64_t>;
  { k.depth } -> std::convertible_to<camera::depth_view<std::uint16_t>>;
}
[[nodiscard]] result<built_map<Octree>> build_map(const Policy& policy, const Keyframes& keyframes,
                                                  live_map<Octree, Camera, Depths>& live, map_options options = {},
                                                  progress on_progress = {}) {
  options.resolution = live.options().resolution;
  options.integration = live.options().integration;
  options.unfiltered_octree = true;
  detail::live_octree<live_map<Octree, Camera, Depths>, Policy> into{policy, live};
  return detail::build_map_into<Octree>(policy, keyframes, live.camera(), options, on_progress, into);
}

}  // namespace orbis::mapping

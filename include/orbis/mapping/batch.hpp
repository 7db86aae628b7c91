// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Builds a map from posed keyframes in one batch: dense cloud, filtered cloud, octrees.
#pragma once

#include <chrono>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ranges>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/cloud/view_samples.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/mapping/dense_cloud.hpp>
#include <orbis/mapping/detail/moving/moving_window.hpp>
#include <orbis/mapping/filter.hpp>
#include <orbis/mapping/keyframe.hpp>
#include <orbis/mapping/keyframe_points.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/mapping/masked_depth.hpp>
#include <orbis/mapping/moving_options.hpp>
#include <orbis/octree/occupancy_octree.hpp>

namespace orbis::mapping {

struct map_options {
  dense_options dense{};
  /// Removal of moved objects from the depth images before they are converted to points, see moving_filter: removes
  /// cells through which rays of the preceding and following keyframes pass. (The ray-evidence filter uses the rays of
  /// the original images.) For depth images that are not a depth_view<std::uint16_t>, depths beyond 16 m are ignored.
  /// Empty: only the filter removes moved objects.
  std::optional<moving_filter_options> moving{};
  filter_options filter{};
  double resolution = 0.05;                   ///< voxel size of the octrees, metres; > 0
  octree::integration_options integration{};  ///< options for integrating each keyframe's depth image
  bool unfiltered_octree = true;              ///< also build the octree of the unfiltered cloud
};

/// A map such as `octree::occupancy_octree`: constructible from a resolution in metres, and able to integrate depth
/// images of this camera.
template <class M, class Camera>
concept depth_map = std::constructible_from<M, double> && std::movable<M> &&
    requires(M& map, const camera::depth_view<float>& depth, const Camera& camera, const se3& T_world_camera,
             const octree::integration_options& options) {
  map.integrate(seq, depth, camera, T_world_camera, options);
};

/// Pixels removed from the depth images because they show moved objects.
struct moving_count {
  std::size_t keyframes = 0;  ///< number of keyframes with removed pixels
  std::size_t pixels = 0;     ///< number of removed pixels in the full images, regardless of the stride
};

/// The map and a report of how it was built.
template <class Octree>
struct built_map {
  point_cloud cloud{};                        ///< points of all keyframes, in the world frame
  cloud::flying_pixel_count flying_pixels{};  ///< flying pixels removed before points were computed, if requested
  moving_count moving{};                      ///< moved objects removed before the flying pixels, if requested
  std::vector<std::uint32_t> inliers{};       ///< indices into `cloud` of the points that the filter kept, ascending
  filter_report filter{};
  std::optional<Octree> unfiltered_octree{};
  Octree octree;                    ///< built from the points that the filter kept, each seen from its keyframe's pose
  std::vector<double> insert_ms{};  ///< time taken to insert each keyframe into `octree`
  std::vector<double> insert_ms_unfiltered{};  ///< time taken to insert each keyframe into `unfiltered_octree`
  std::size_t skipped = 0;                     ///< number of keyframes without a finite pose

  /// Returns a copy of the points that the filter kept.
  [[nodiscard]] point_cloud filtered_cloud() const { return cloud::extract(cloud, inliers); }
};

namespace detail {

/// A keyframe's depth image without moved objects.
template <camera::depth_source Depth>
class static_depth {
 public:
  /// Calls `use` with the image. Returns the number of removed pixels.
  template <class Use>
  std::size_t with(const Depth& depth, const std::vector<removed_cell>& cells, const moving_filter_options& options,
                   const Use& use) {
    if (cells.empty()) {
      use(depth);
      return 0;
    }
    if (copy_.width() != depth.width() || copy_.height() != depth.height())
      copy_ = image<camera::depth_pixel<Depth>>(depth.width(), depth.height());
    for (int y = 0; y != depth.height(); ++y)
      for (int x = 0; x != depth.width(); ++x) copy_(x, y) = stored_depth(depth, x, y);
    const std::size_t removed = remove_cells(depth, cells, options, copy_.view());
    use(view_like(depth, std::as_const(copy_).view()));
    return removed;
  }

 private:
  image<camera::depth_pixel<Depth>> copy_;
};

/// The steps of `build_map`. `into.wants(k, whole)` returns true if `into` needs this keyframe's depth image; `whole`
/// is false if moved objects were removed from the image. `into.scan(k, depth)` integrates one depth image before the
/// cloud is filtered; `into.unfiltered()` returns the map of these images. `into.filtered(cloud, kept, depths, ms,
/// progress)` returns the map after filtering: `depths(use)` calls `use(k, depth)` with the remaining pixels of each
/// depth image.
template <class Octree, execution_policy Policy, keyframe_range Keyframes, camera::camera_model Camera, class Into>
[[nodiscard]] result<built_map<Octree>> build_map_into(const Policy& policy, const Keyframes& keyframes,
                                                       const Camera& camera, const map_options& options,
                                                       const progress& on_progress, Into& into) {
  if (std::ranges::size(keyframes) == 0) return fail(errc::no_data, "keyframes", "the range is empty");
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
  const auto wrong_size = [] {
    return fail(errc::invalid_argument, "keyframes", "the size of an image differs from the camera's");
  };
  const auto finite_pose = [](const auto& k) { return all_finite(se3(k.T_world_camera).to_matrix()); };
  const std::size_t looks = view_passes(options.filter);
  const std::size_t total = (2U + looks) * std::ranges::size(keyframes);
  std::size_t done = 0;

  // Everything that depends on one keyframe is computed in a single pass, because depth images are expensive to obtain.
  using keyframe_type = std::ranges::range_value_t<Keyframes>;
  using depth_type = std::remove_cvref_t<decltype(std::declval<const keyframe_type&>().depth)>;
  using pixel = camera::depth_pixel<depth_type>;
  built_map<Octree> map{.octree = Octree{options.resolution}};
  const camera::ray_table rays{camera};
  dense_options of_masked = options.dense;
  of_masked.flying_pixels.reset();  // already removed
  dense_cloud dense{rays, of_masked};
  keyframe_points points;
  static_depth<depth_type> standing;
  cloud::view_samples samples;
  // One entry per keyframe that is not skipped; `place` is the keyframe's position in the range.
  std::vector<std::vector<removed_cell>> moved;
  std::vector<std::size_t> place;
  image<pixel> masked(camera.width(), camera.height());
  const auto mask = [&](const auto& depth) {
    return points.mask(policy, depth, rays, point_options(options.dense), masked.view());
  };
  const auto add = [&](auto& judged) -> result<void> {
    const keyframe_type& k = judged.keyframe;
    if (options.filter.kind == filter_kind::automatic) {
      while (samples.views() != place[judged.number]) samples.skip();
      samples.add(camera, k);
    }
    const image_view<const rgb8> color = k.color;
    if (!color.empty() && !fits(color)) return wrong_size();
    const std::size_t removed = standing.with(k.depth, judged.removed, moving, [&](const auto& depth) {
      const cloud::flying_pixel_count flying = mask(depth);
      map.flying_pixels.valid += flying.valid;
      map.flying_pixels.removed += flying.removed;
    });
    map.moving.keyframes += removed != 0 ? 1 : 0;
    map.moving.pixels += removed;
    const auto depth = view_like(k.depth, std::as_const(masked).view());
    dense.add_keyframe(policy, keyframe<std::remove_cv_t<decltype(depth)>>{depth, color, se3(k.T_world_camera)});
    if (options.unfiltered_octree) {
      const result<bool> wanted = into.wants(k, judged.removed.empty());
      if (!wanted) return fail(wanted.error());
      const auto start = std::chrono::steady_clock::now();
      if (*wanted)
        if (auto scanned = into.scan(k, depth); !scanned) return scanned;
      map.insert_ms_unfiltered.push_back(*wanted ? milliseconds_since(start) : 0.0);
    }
    moved.push_back(std::move(judged.removed));
    return {};
  };
  {
    moving_window<Camera, keyframe_type> window{camera, options.moving};
    const auto add_judged = [&]() -> result<void> {
      while (auto judged = window.pop())
        if (auto added = add(*judged); !added) return added;
      return {};
    };
    std::size_t at = 0;
    for (auto&& k : keyframes) {
      if (!fits(k.depth)) return wrong_size();
      if (finite_pose(k)) {
        place.push_back(at);
        window.push(policy, keyframe_type(std::forward<decltype(k)>(k)));
        if (auto added = add_judged(); !added) return fail(std::move(added.error()));
      } else {
        const image_view<const rgb8> color = k.color;
        if (!color.empty() && !fits(color)) return wrong_size();
        ++map.skipped;
      }
      ++at;
      if (++done != std::ranges::size(keyframes) && !on_progress(done, total))
        return fail(errc::cancelled, {}, "cancelled");
    }
    window.finish();
    if (auto added = add_judged(); !added) return fail(std::move(added.error()));
    while (samples.views() != at) samples.skip();
  }  // frees the keyframes in the window
  if (options.unfiltered_octree) {
    auto octree = into.unfiltered();
    if (!octree) return fail(std::move(octree.error()));
    map.unfiltered_octree.emplace(*std::move(octree));
  }

  map.cloud = dense.cloud(policy);
  std::vector<float> ranges = dense.ranges(policy);
  dense.finish();
  // Reported only after the memory of the pass has been freed, so that callers can return it to the system.
  if (!on_progress(done, total)) return fail(errc::cancelled, {}, "cancelled");
  bool cancelled = false;
  const auto while_filtering = [&](std::size_t views_done, std::size_t) {
    cancelled = cancelled || !on_progress(done + views_done, total);
    return !cancelled;
  };
  filter_options with_samples = options.filter;
  with_samples.automatic.samples = &samples;
  filtered_indices filtered =
      filter_points(policy, map.cloud.points, ranges, keyframes, camera, with_samples, while_filtering);
  if (cancelled) return fail(errc::cancelled, {}, "cancelled");
  std::vector<float>{}.swap(ranges);
  done += looks * std::ranges::size(keyframes);
  map.filter = std::move(filtered.report);
  map.inliers = std::move(filtered.inliers);
  const dense_cloud::selection kept_points = dense.select(map.inliers);

  if (map.skipped != 0 && !on_progress(done += map.skipped, total)) return fail(errc::cancelled, {}, "cancelled");
  const auto watched = [&](std::size_t passed, std::size_t) { return on_progress(done + passed, total); };
  const auto filtered_depths = [&](const auto& use) -> result<void> {
    std::size_t number = 0;
    for (const auto& k : keyframes) {
      if (!finite_pose(k)) continue;
      static_cast<void>(standing.with(k.depth, moved[number], moving, mask));
      image<pixel> left = masked;
      dense.remove_points(policy, view_like(k.depth, std::as_const(masked).view()), number++, kept_points, left.view());
      use(k, view_like(k.depth, std::as_const(left).view()));
      if (!watched(number, moved.size())) return fail(errc::cancelled, {}, "cancelled");
    }
    return {};
  };
  auto octree = into.filtered(dense, kept_points, filtered_depths, map.insert_ms, watched);
  if (!octree) return fail(std::move(octree.error()));
  map.octree = *std::move(octree);
  return map;
}

/// Builds separate octrees.
template <class Octree, class Policy, class Camera>
struct fresh_octrees {
  const Policy& policy;
  const Camera& camera;
  const map_options& options;
  std::optional<Octree> octree{};  // options are checked before the first scan

  template <class Keyframe>
  result<bool> wants(const Keyframe&, bool) const {
    return true;
  }
  template <class Keyframe, class Depth>
  result<void> scan(const Keyframe& k, const Depth& depth) {
    if (!octree) octree.emplace(options.resolution);
    octree->integrate(policy, depth, camera, se3(k.T_world_camera), options.integration);
    return {};
  }
  result<Octree> unfiltered() {
    std::optional<Octree> whole = std::exchange(octree, std::nullopt);
    return whole ? *std::move(whole) : Octree{options.resolution};
  }
  template <class Depths>
  result<Octree> filtered(const dense_cloud&, const dense_cloud::selection&, const Depths& depths,
                          std::vector<double>& milliseconds, const progress&) {
    auto scanned = depths([&](const auto& k, const auto& depth) {
      const auto start = std::chrono::steady_clock::now();
      static_cast<void>(scan(k, depth));
      milliseconds.push_back(milliseconds_since(start));
    });
    if (!scanned) return fail(std::move(scanned.error()));
    return unfiltered();
  }
};

/// Updates a live map that already contains most of the keyframes.
template <class Live, class Policy>
struct live_octree {
  const Policy& policy;
  Live& live;
  std::vector<keyframe_position> poses{};

  template <class Keyframe>
  result<bool> wants(const Keyframe& k, bool whole) {
    if (!poses.empty() && !(poses.back().frame < k.frame))
      return fail(errc::invalid_argument, "keyframes", "frame numbers are not ascending");
    poses.push_back({k.frame, se3(k.T_world_camera)});
    return !whole || !live.contains(k.frame) || live.is_filtered(k.frame);
  }
  template <class Keyframe, class Depth>
  result<void> scan(const Keyframe& k, const Depth& depth) {
    // Marked as filtered even before the cloud filter: pixels of moved objects may be missing, and processing may end
    // before the cloud filter's result.
    const camera::depth_view<std::uint16_t> whole = k.depth;
    return ignore_write_failure(
        live.add_keyframe(policy, k.frame, depth, poses.back().T_world_camera, completeness::filtered, whole.pixels()));
  }
  result<typename Live::octree_type> unfiltered() {
    live.set_poses(poses, unlisted::hide);
    return finished();
  }
  template <class Depths>
  result<typename Live::octree_type> filtered(const dense_cloud& cloud, const dense_cloud::selection& kept,
                                              const Depths&, std::vector<double>& milliseconds,
                                              const progress& on_progress) {
    std::vector<std::uint64_t> frames;
    for (const keyframe_position& p : poses) frames.push_back(p.frame);
    const auto start = std::chrono::steady_clock::now();
    // Flying pixels and moved objects are already removed from the images in the live map.
    auto edited = ignore_write_failure(live.edit_depths(
        policy, frames,
        [&](std::size_t number, const auto& depth, const image_view<std::uint16_t>& pixels) {
          cloud.remove_points(seq, depth, number, kept, pixels);
        },
        on_progress));
    if (!edited) return fail(std::move(edited.error()));
    milliseconds.assign(frames.size(), milliseconds_since(start) / static_cast<double>(frames.size()));
    return finished();
  }

 private:
  result<typename Live::octree_type> finished() {
    if (auto done = live.finish(policy); !done) return fail(std::move(done.error()));
    return live.snapshot();
  }
  /// Ignores a failure to write images to the spill file: they stay in memory, so nothing is lost.
  template <class Done>
  static result<void> ignore_write_failure(Done done) {
    if (done || done.error().code == errc::write_failed) return {};
    return fail(std::move(done.error()));
  }
};

}  // namespace detail

/// Removes moved objects from the depth images, if requested, adds the keyframes to a cloud, filters it, and integrates
/// each keyframe's depth image, with rays from the keyframe's pose and without the pixels whose points the filter
/// removed (`dense_cloud::masked_depth`). The filter compares points of different keyframes; the automatic filter
/// also takes into account through which points the rays of the keyframes' depth images pass. The octrees are
/// bit-identical to those that a `live_map` builds from the same depth images and poses.
///
/// The range is traversed twice and, depending on the filter, up to three times more. At most
/// `options.moving->keyframes` + 1 of its values are kept at a time if `options.moving` is set, otherwise one. Values
/// must therefore be copyable, or the range must return a new value for each access; they must remain valid while they
/// are kept.
///
/// Keyframes whose pose is not finite are skipped and counted. Errors: `no_data` if there is no keyframe;
/// `invalid_argument` if the size of an image differs from the camera's, or an option is out of range; `cancelled`. The
/// result is the same for every policy. `on_progress` counts the keyframes of all passes.
template <class Octree = octree::occupancy_octree<>, execution_policy Policy, keyframe_range Keyframes,
          camera::camera_model Camera>
requires depth_map<Octree, Camera>
[[nodiscard]] result<built_map<Octree>> build_map(const Policy& policy, const Keyframes& keyframes,
                                                  const Camera& camera, const map_options& options = {},
                                                  progress on_progress = {}) {
  detail::fresh_octrees<Octree, Policy, Camera> into{policy, camera, options};
  return detail::build_map_into<Octree>(policy, keyframes, camera, options, on_progress, into);
}

/// As above, but updates a live map that was built while these keyframes were recorded: moves its keyframes to their
/// current poses, adds missing ones, hides those that are not in the range or have no finite pose, and then applies the
/// result of the filter. The octrees are bit-identical to those of the function above. Each keyframe has a member
/// `frame`, its index in the live map; the range is in ascending order of `frame`. The insertion times in the result
/// are those for passing images to the map, excluding replay; after filtering, each is the mean over all keyframes.
/// `options.resolution` and `options.integration` are those of the live map, and the unfiltered octree is always built.
/// Additional errors: `invalid_argument` if the frame numbers are not ascending; those of the live map, except a
/// failure to write images to their file, because these images stay in memory. After an error the live map may contain
/// some of the new images and poses already; calling the function again corrects it. @pre the images in the live map
/// are those that `keyframe_points::masked` returns with `point_options(options.dense)`, except for keyframes for which
/// `live_map::is_filtered` returns true: these are added again
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

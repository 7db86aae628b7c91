// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of system.hpp.
#pragma once

#include <cassert>
#include <span>
#include <string>

#include <orbis/features/descriptor.hpp>
#include <orbis/features/stereo.hpp>
#include <orbis/slam/detail/system/back_end.hpp>
#include <orbis/slam/detail/system/stopwatch.hpp>
#include <orbis/slam/detail/tracking/front_end.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/map-inl.hpp>
#include <orbis/slam/map_file.hpp>
#include <orbis/slam/system.hpp>

namespace orbis::slam {

#define ORBIS_SLAM_SYSTEM_TEMPLATE                                    \
  template <camera::camera_model Camera, feature_extractor Extractor, \
            tracking_matchers<descriptor_of_t<Extractor>> Matchers,   \
            place_recognizer<descriptor_of_t<Extractor>> Places>
#define ORBIS_SLAM_SYSTEM system<Camera, Extractor, Matchers, Places>

ORBIS_SLAM_SYSTEM_TEMPLATE
ORBIS_SLAM_SYSTEM::system(Camera camera, const options& settings) requires
    std::constructible_from<Extractor, const features::orb_options&> && std::default_initializable<Places>
    : system(std::move(camera), settings, Extractor(settings.features), Places{}) {}

ORBIS_SLAM_SYSTEM_TEMPLATE
ORBIS_SLAM_SYSTEM::system(Camera camera, const options& settings, Extractor extractor, Places places)
    : options_{settings},
      extract_{std::move(extractor)},
      shared_{make_rig(std::move(camera), settings), options_, std::move(places)},
      front_end_{std::make_unique<front_end>(shared_.rig, options_)},
      localization_only_{settings.localization_only},
      back_end_{std::make_unique<back_end>(shared_, [this] { return front_end_->improve_frame(shared_.atlas); })} {}

ORBIS_SLAM_SYSTEM_TEMPLATE
ORBIS_SLAM_SYSTEM::~system() = default;

ORBIS_SLAM_SYSTEM_TEMPLATE
void ORBIS_SLAM_SYSTEM::listen(listeners callbacks) { shared_.callbacks = std::move(callbacks); }

ORBIS_SLAM_SYSTEM_TEMPLATE
template <camera::depth_source Depth>
track_result ORBIS_SLAM_SYSTEM::track(double timestamp, image_view<const rgb8> color, const Depth& depth,
                                      std::optional<double> depth_timestamp) {
  detail::stopwatch clock;
  front_end_->depth().clear_depth();
  front_end_->patches().set_image({});
  if (!are_usable(timestamp, color, depth)) return track_frame(timestamp, {}, {}, clock);
  frame_type f = measure_rgbd(shared_.rig, extract_, color, depth, image_);
  if (shared_.rig.scale_is_known) f.shutter.depth_delay = depth_clock_.update(timestamp, depth_timestamp);
  front_end_->depth().set_depth(depth);
  detail::frame_image pixels{&image_.pyramid};
  if (shared_.rig.scale_is_known)
    pixels.depth_at = [&](const vec2& pixel) {
      return detail::usable_depth(shared_.rig, depth, static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    };
  front_end_->patches().set_image(std::move(pixels));
  row_reader read = [&](std::span<keypoint_as_read> seen, const frame_motion& m) {
    follow_rows(shared_.rig, m, seen, depth);
  };
  if (options_.estimates_shutter) {
    // The image is read again when the next frame has been tracked.
    detail::depth_copy& copy = read_later_[front_end_->counters().frames % 2];
    copy.assign(depth);
    read = [this, &copy](std::span<keypoint_as_read> seen, const frame_motion& m) {  // small enough not to allocate
      copy.visit([&](const auto& kept) { follow_rows(shared_.rig, m, seen, kept); });
    };
  }
  return track_frame(timestamp, std::move(f), read, clock);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track_measured(double timestamp, const measure_function& measure) {
  assert(measure);
  detail::stopwatch clock;
  front_end_->depth().clear_depth();
  front_end_->patches().set_image({});
  frame_type f = std::isfinite(timestamp) ? measure(shared_.rig, extract_) : frame_type{};
  f.shutter.depth_delay = 0.0;  // depth was measured at the frame's time
  return track_frame(timestamp, std::move(f), {}, clock);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track(double timestamp, image_view<const rgb8> left, image_view<const rgb8> right) {
  return track_measured(timestamp, [&](const auto& rig, const Extractor& extract) {
    return are_usable(timestamp, left, right) ? measure_stereo(rig, extract, left, right, stereo_) : frame_type{};
  });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track(double timestamp, image_view<const std::uint8_t> left,
                                      image_view<const std::uint8_t> right) requires grey_extractor<Extractor> {
  return track_measured(timestamp, [&](const auto& rig, const Extractor& extract) {
    return are_usable(timestamp, left, right) ? measure_stereo(rig, extract, left, right, stereo_) : frame_type{};
  });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track(double timestamp, image_view<const rgb8> color) {
  return track_measured(timestamp, [&](const auto& rig, const Extractor& extract) {
    return are_usable(timestamp, color) ? measure_monocular(rig, extract, color) : frame_type{};
  });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track(double timestamp,
                                      image_view<const std::uint8_t> grey) requires grey_extractor<Extractor> {
  return track_measured(timestamp, [&](const auto& rig, const Extractor& extract) {
    return are_usable(timestamp, grey) ? measure_monocular(rig, extract, grey) : frame_type{};
  });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_result ORBIS_SLAM_SYSTEM::track_frame(double timestamp, frame_type f, const row_reader& follow,
                                            detail::stopwatch& clock) {
  track_result result;
  f.scale_is_known = shared_.rig.scale_is_known;
  if (!f.scale_is_known) std::fill(f.depth.begin(), f.depth.end(), 0.0F);
  front_end_->set_shutter(f);
  f.timestamp = std::isfinite(timestamp) ? timestamp : front_end_->last_timestamp();
  f.index = front_end_->counters().frames;
  clock.lap(result.timings.features_ms);
  if (options_.threads.wait) back_end_->wait_for_room();
  const auto outcome = shared_.locked([&] {
    return front_end_->track({
        .frame = f,
        .maps = shared_.atlas,
        .is_frozen = localization_only_,
        .has_room = [&] { return !back_end_->is_full(); },
        .read_rows = follow ? follow : [](std::span<keypoint_as_read>, const frame_motion&) {},
        .find_similar =
            [&](const auto& features, std::size_t count) {
              return shared_.similar(shared_.places.describe(features), count, [](map_keyframe) { return false; });
            },
        .drop_map =
            [&](map_id m) {  // a map in use by mapping is kept
              if (const auto edit = shared_.try_edit()) shared_.remove_map(m);
            },
        .localized = [&] { clock.lap(result.timings.tracking_ms); },
    });
  });
  result.inliers = outcome.inliers;
  if (outcome.made) {
    if (outcome.first) dispatch_keyframe(*outcome.first);
    dispatch_keyframe(*outcome.made);
  }
  report(result, outcome.made);
  clock.lap(result.timings.mapping_ms);
  return result;
}

ORBIS_SLAM_SYSTEM_TEMPLATE
void ORBIS_SLAM_SYSTEM::dispatch_keyframe(map_keyframe k) {
  // The map of the keyframe may have been merged into another one since then.
  if (const auto& callback = shared_.callbacks.keyframe_made)
    callback(shared_.locked([&] { return shared_.make_event(shared_.atlas.current(k)); }));
  back_end_->process(k);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
void ORBIS_SLAM_SYSTEM::report(track_result& result, const std::optional<map_keyframe>& made) {
  auto lock = shared_.lock();
  result.state = front_end_->state();
  result.map = shared_.atlas.active_id();
  if (made) result.keyframe = shared_.atlas.current(*made).keyframe;
  if (front_end_->is_tracking()) {
    result.T_world_camera = front_end_->last_pose(shared_.atlas);
    result.twist = front_end_->last_twist();
    result.shutter = front_end_->last_shutter();
  }
  const state_event changed{std::exchange(reported_state_, result.state), result.state,
                            front_end_->counters().frames - 1};
  lock.unlock();
  if (changed.from != changed.to && shared_.callbacks.state_changed) shared_.callbacks.state_changed(changed);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_state ORBIS_SLAM_SYSTEM::state() const {
  return shared_.locked([&] { return front_end_->state(); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
std::optional<tracked_frame> ORBIS_SLAM_SYSTEM::last_frame() const {
  if (reported_state_ != track_state::tracking && reported_state_ != track_state::relocalized) return std::nullopt;
  return front_end_->last_frame();
}

ORBIS_SLAM_SYSTEM_TEMPLATE
void ORBIS_SLAM_SYSTEM::wait() const { back_end_->wait(); }

ORBIS_SLAM_SYSTEM_TEMPLATE
void ORBIS_SLAM_SYSTEM::stop() noexcept { back_end_->stop(); }

ORBIS_SLAM_SYSTEM_TEMPLATE
orbis::trajectory ORBIS_SLAM_SYSTEM::trajectory() const {
  return shared_.locked([&] { return front_end_->log().trajectory(shared_.atlas, shared_.atlas.active_id()); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
orbis::trajectory ORBIS_SLAM_SYSTEM::trajectory(map_id map) const {
  return shared_.locked([&] { return front_end_->log().trajectory(shared_.atlas, map); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
std::vector<keyframe_pose> ORBIS_SLAM_SYSTEM::keyframes() const {
  pose_revision never;
  return *keyframes_since(never);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
std::optional<std::vector<keyframe_pose>> ORBIS_SLAM_SYSTEM::keyframes_since(pose_revision& seen) const {
  return shared_.locked([&]() -> std::optional<std::vector<keyframe_pose>> {
    const map_type& active = shared_.atlas.active();
    const pose_revision now{shared_.atlas.active_id(), active.pose_changes()};
    if (std::exchange(seen, now) == now) return std::nullopt;
    std::vector<keyframe_pose> all;
    for (const auto& k : active.keyframes()) all.push_back({k.timestamp, k.T_world_camera, k.index});
    return all;
  });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
orbis::trajectory ORBIS_SLAM_SYSTEM::keyframe_trajectory() const {
  orbis::trajectory all;
  for (const keyframe_pose& k : keyframes()) all.push_back({k.timestamp, k.T_world_camera});
  return all;
}

ORBIS_SLAM_SYSTEM_TEMPLATE
std::optional<shutter_estimate> ORBIS_SLAM_SYSTEM::estimated_shutter() const { return front_end_->estimated_shutter(); }

ORBIS_SLAM_SYSTEM_TEMPLATE
double ORBIS_SLAM_SYSTEM::exposure() const { return front_end_->patches().exposure(); }

ORBIS_SLAM_SYSTEM_TEMPLATE
std::size_t ORBIS_SLAM_SYSTEM::landmark_count() const {
  return shared_.locked([&] { return shared_.atlas.active().landmark_count(); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
track_counters ORBIS_SLAM_SYSTEM::counters() const {
  return shared_.locked([&] {
    track_counters all = front_end_->counters();
    all.loops_closed = shared_.loops_closed;
    all.maps_merged = shared_.maps_merged;
    all.keyframes_culled = shared_.keyframes_culled;
    return all;
  });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
map_id ORBIS_SLAM_SYSTEM::active_map() const {
  return shared_.locked([&] { return shared_.atlas.active_id(); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
map_id ORBIS_SLAM_SYSTEM::largest_map() const {
  return shared_.locked([&] { return front_end_->log().largest_map(shared_.atlas); });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
bool ORBIS_SLAM_SYSTEM::activate(map_id map) {
  return shared_.locked([&] {
    if (!shared_.atlas.contains(map)) return false;
    if (map != shared_.atlas.active_id()) {
      shared_.atlas.activate(map);
      front_end_->set_lost();
    }
    return true;
  });
}

ORBIS_SLAM_SYSTEM_TEMPLATE
result<void> ORBIS_SLAM_SYSTEM::save_map(const std::filesystem::path& path)
    const requires std::same_as<descriptor_of_t<Extractor>, features::binary_descriptor<256>> {
  const std::string bytes = inspect([](const atlas_type& all) { return map_bytes(all.active()); });
  return write_map_bytes(path, bytes);
}

ORBIS_SLAM_SYSTEM_TEMPLATE
result<void> ORBIS_SLAM_SYSTEM::load_map(const std::filesystem::path& path) requires
    std::same_as<descriptor_of_t<Extractor>, features::binary_descriptor<256>> {
  auto loaded = read_map(path);
  if (!loaded) return fail(loaded.error());
  const auto& content = loaded->content();
  if (content.levels != shared_.rig.scales.levels() || !(content.scale_factor == shared_.rig.scales.factor()))
    return fail(errc::unsupported, path.string(), "the map was built with a different image pyramid");
  if (loaded->scale_is_known() != shared_.rig.scale_is_known)
    return fail(errc::unsupported, path.string(),
                shared_.rig.scale_is_known ? "the map was built without depth; its unit of length is not the metre"
                                           : "the map was built with depth, but this sensor does not measure depth");
  if (loaded->keyframes().empty()) return fail(errc::no_data, path.string(), "the map has no keyframes");
  // Computed before locking, because the lock blocks tracking.
  std::vector<std::pair<keyframe_id, typename Places::signature>> bow_vectors;
  for (const auto& k : loaded->keyframes()) bow_vectors.emplace_back(k.id, shared_.places.describe(k.features));
  const auto lock = shared_.lock();
  const map_id before = shared_.atlas.active_id();
  const bool drop = shared_.atlas.active().keyframes().empty();
  const map_id id = shared_.atlas.create(*std::move(loaded));
  if (drop) shared_.atlas.remove(before);
  for (const auto& [k, seen] : bow_vectors) shared_.places.add({id, k}, seen);
  front_end_->set_lost();
  return {};
}

#undef ORBIS_SLAM_SYSTEM
#undef ORBIS_SLAM_SYSTEM_TEMPLATE

}  // namespace orbis::slam

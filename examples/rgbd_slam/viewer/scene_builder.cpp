// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene_builder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace app {
namespace {

using orbis::se3;
using orbis::vec3f;

constexpr float trail_step = 0.02F;              // metres between points of the path
constexpr std::size_t recent_frames = 300;       // for the percentile of tracking times
constexpr std::size_t keyframes_at_a_time = 64;  // maximum number moved per update after a correction
constexpr int color_tolerance = 12;              // smaller colour changes of a voxel are not shown

std::uint64_t packed_id(orbis::slam::map_keyframe k) {
  return std::uint64_t{k.map.value()} << 32U | k.keyframe.value();
}

/// The displacement in metres of points two metres in front of the camera.
double motion(const se3& from, const se3& to) {
  const auto difference = (from.inverse() * to).log();
  return difference.head<3>().norm() + 2.0 * difference.tail<3>().norm();
}

/// The value below which the fraction `share` of the values lies. @pre there is at least one value
template <class T>
T percentile(std::vector<T> values, double share) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// Returns true if two lists of cubes look the same.
bool is_similar(const std::vector<shown_voxel>& a, const std::vector<shown_voxel>& b) {
  const auto close = [](std::uint8_t p, std::uint8_t q) { return std::abs(p - q) <= color_tolerance; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](const shown_voxel& p, const shown_voxel& q) {
    return p.x == q.x && p.y == q.y && p.z == q.z && p.level == q.level && close(p.color.r, q.color.r) &&
           close(p.color.g, q.color.g) && close(p.color.b, q.color.b);
  });
}

}  // namespace

frustum_rays corner_rays(const orbis::camera::ray_table& rays) {
  frustum_rays corners;
  const int right = rays.width() - 1, bottom = rays.height() - 1;
  const std::array<std::array<int, 2>, 4> at{{{0, 0}, {right, 0}, {right, bottom}, {0, bottom}}};
  for (std::size_t i = 0; i != 4; ++i) {
    corners[i] = rays.at(at[i][0], at[i][1], 1.0F);
    // The corners of a wide-angle image may have no ray; a pyramid of 90 degrees is then drawn.
    if (!corners[i].allFinite()) corners[i] = {at[i][0] == 0 ? -1.0F : 1.0F, at[i][1] == 0 ? -1.0F : 1.0F, 1.0F};
  }
  return corners;
}

scene_builder::scene_builder(std::string title, std::size_t frames, orbis::camera::ray_table rays, double resolution,
                             std::size_t max_samples)
    : rays_{std::move(rays)},
      resolution_{resolution},
      // One sample per voxel at a distance of three metres; most voxels are seen by several keyframes.
      step_{std::clamp(static_cast<int>(resolution / 3.0 * 0.8 * rays_.width()), 3, 8)},
      max_samples_{max_samples},
      colors_{resolution} {
  scene_.title = std::move(title);
  scene_.camera = corner_rays(rays_);
  scene_.voxels.resolution = resolution;
  scene_.numbers.frames = frames;
}

scene_builder::~scene_builder() { std::unique_ptr<mailbox>{box_.load()}.reset(); }

// -- tracking thread

std::vector<scene_builder::sample> scene_builder::take_samples(const viewer_frame& frame) const {
  std::vector<sample> samples;
  const int width = std::min({frame.color.width(), frame.depth.width(), rays_.width()});
  const int height = std::min({frame.color.height(), frame.depth.height(), rays_.height()});
  samples.reserve(static_cast<std::size_t>((width / step_ + 1) * (height / step_ + 1)));
  for (int y = step_ / 2; y < height; y += step_)
    for (int x = step_ / 2; x < width; x += step_) {
      const std::uint16_t d = frame.depth(x, y);
      if (d == 0 || d == 65535) continue;
      samples.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                         static_cast<float>(d / frame.depth_scale), frame.color(x, y)});
    }
  return samples;
}

void scene_builder::push(viewer_frame frame) {
  // Takes back an unread mailbox, adds the frame, and publishes the mailbox again, so that neither thread blocks the
  // other.
  std::unique_ptr<mailbox> mail{box_.exchange(nullptr)};
  if (!mail) mail = std::make_unique<mailbox>();
  if (frame.keyframe && takes_colors_ && mail->samples <= max_samples_ / 8) {
    auto& [keyframe, samples] = mail->keyframes.emplace_back(*frame.keyframe, take_samples(frame));
    mail->samples += samples.size();
  }
  if (frame.tracked) {
    const vec3f at = frame.tracked->T_reference_camera.translation().cast<float>();
    if (was_lost_ || last_reference_ != frame.tracked->reference || (at - last_at_).norm() >= trail_step) {
      mail->passed.push_back({frame.tracked->reference, at, was_lost_});
      last_reference_ = frame.tracked->reference;
      last_at_ = at;
    }
  }
  was_lost_ = !frame.tracked;
  if (mail->tracking_ms.size() == 2 * recent_frames)
    mail->tracking_ms.erase(mail->tracking_ms.begin(), mail->tracking_ms.begin() + recent_frames);
  mail->tracking_ms.push_back(frame.tracking_ms);
  mail->newest = std::move(frame);
  box_.store(mail.release());
}

// -- viewer thread

std::size_t scene_builder::index_of(orbis::slam::map_keyframe k) {
  const auto [at, is_new] = asked_.try_emplace(packed_id(k), graph_.asked.size());
  if (is_new) {
    graph_.asked.push_back(k);
    graph_asked_more_ = true;
  }
  return at->second;
}

void scene_builder::read_mailbox() {
  const std::unique_ptr<mailbox> taken{box_.exchange(nullptr)};
  if (!taken) return;
  mailbox& mail = *taken;
  for (const double ms : mail.tracking_ms) {
    if (tracking_ms_.size() < recent_frames) tracking_ms_.emplace_back();
    tracking_ms_[frames_seen_++ % recent_frames] = ms;
    scene_.numbers.tracking_ms = ms;
  }
  for (const passed_point& p : mail.passed) {
    trail_.push_back({index_of(p.reference), p.at, p.begins});
    graph_asked_more_ = true;
  }
  if (takes_colors_)
    for (auto& [keyframe, samples] : mail.keyframes) {
      samples.shrink_to_fit();
      sample_count_ += samples.size();
      colored_.push_back({index_of(keyframe), std::move(samples), {}});
      colors_wait_ = true;
    }
  make_room();
  if (!mail.newest) return;
  viewer_frame& f = *mail.newest;
  shown_frame shown{f.number, std::move(f.state), f.T_world_camera, {}, {}};
  shown.image = std::make_shared<const orbis::image<orbis::rgb8>>(std::move(f.color));
  if (f.tracked)
    for (const auto& feature : f.tracked->features) shown.features.push_back({feature.x, feature.y, feature.tracked});
  scene_.frame = std::move(shown);
}

const viewer_scene& scene_builder::update(const scene_sources& sources) { return update(sources, false); }
const viewer_scene& scene_builder::update_at_once(const scene_sources& sources) { return update(sources, true); }

const viewer_scene& scene_builder::update(const scene_sources& sources, bool at_once) {
  read_mailbox();
  auto start = clock::now();
  if (sources.graph && (at_once || graph_pace_.is_due(start))) {
    update_graph(sources, at_once);
    graph_pace_.ran(start, clock::now());
  }
  start = clock::now();
  if (at_once || voxel_pace_.is_due(start)) {
    update_voxels(sources, at_once);
    voxel_pace_.ran(start, clock::now());
  }
  start = clock::now();
  if (at_once || number_pace_.is_due(start)) {
    update_numbers(sources);
    number_pace_.ran(start, clock::now());
  }
  return scene_;
}

void scene_builder::update_graph(const scene_sources& sources, bool at_once) {
  if (!sources.graph(graph_, at_once || std::exchange(graph_asked_more_, false))) return;
  graph_asked_more_ = false;
  ++scene_.graph.revision;
  scene_.graph.keyframes = graph_.keyframes;
  scene_.graph.edges = graph_.edges;
  draw_trail();
  colors_wait_ = true;
}

void scene_builder::draw_trail() {
  scene_.graph.trail.clear();
  bool begins = true;
  for (const trail_item& item : trail_) {
    const auto& pose = item.asked < graph_.poses.size() ? graph_.poses[item.asked] : std::nullopt;
    begins = begins || item.begins;
    if (!pose) {  // in another map
      begins = true;
      continue;
    }
    scene_.graph.trail.push_back({(*pose * item.at.cast<double>()).cast<float>(), begins});
    begins = false;
  }
}

template <class Use>
void scene_builder::for_each_point(const std::vector<sample>& samples, const se3& T_world_camera,
                                   const Use& use) const {
  const auto T = T_world_camera.cast<float>();
  for (const sample& s : samples)
    if (const vec3f p = rays_.at(s.x, s.y, s.depth); p.allFinite()) use(vec3f(T * p), s.color);
}

void scene_builder::make_room() {
  while (sample_count_ > max_samples_) {
    const auto has_less = [](const auto& a, const auto& b) { return a.samples.size() < b.samples.size(); };
    colored_keyframe& most = *std::max_element(colored_.begin(), colored_.end(), has_less);
    std::vector<sample> kept, gone;
    kept.reserve(most.samples.size() / 2);
    for (std::size_t i = 0; i != most.samples.size(); ++i) (i % 2 == 0 ? gone : kept).push_back(most.samples[i]);
    if (most.placed) {
      for_each_point(gone, *most.placed, [&](const vec3f& p, orbis::rgb8 c) { colors_.remove(p, c); });
      colors_changed_ = true;
    }
    sample_count_ -= gone.size();
    most.samples = std::move(kept);
  }
}

bool scene_builder::move_colors(std::size_t limit) {
  for (colored_keyframe& k : colored_) {
    const auto& known = k.asked < graph_.poses.size() ? graph_.poses[k.asked] : std::nullopt;
    const std::optional<se3> pose =
        known ? std::optional<se3>{{known->rotation(), known->translation()}} : std::nullopt;
    if (pose.has_value() == k.placed.has_value() && (!pose || motion(*k.placed, *pose) < 0.5 * resolution_)) continue;
    if (limit-- == 0) return false;
    if (k.placed) for_each_point(k.samples, *k.placed, [&](const vec3f& p, orbis::rgb8 c) { colors_.remove(p, c); });
    if (pose) for_each_point(k.samples, *pose, [&](const vec3f& p, orbis::rgb8 c) { colors_.add(p, c); });
    k.placed = pose;
    colors_changed_ = true;
  }
  return true;
}

void scene_builder::update_voxels(const scene_sources& sources, bool at_once) {
  if (has_final_voxels_) return;
  const bool has_new = sources.voxels && sources.voxels(cubes_);
  if (cubes_.empty() && !has_new) return;
  if (colors_wait_) colors_wait_ = !move_colors(at_once ? colored_.size() : keyframes_at_a_time);
  if (!has_new && !std::exchange(colors_changed_, false)) return;
  colors_changed_ = false;
  for (voxel& v : cubes_) v.color = colors_.mean_color(v).value_or(no_color);
  show_cubes();
}

void scene_builder::set_voxels(std::vector<voxel> colored) {
  has_final_voxels_ = true;
  cubes_ = std::move(colored);
  scene_.voxels.absent.clear();
  show_cubes();
  forget_colors();
}

void scene_builder::set_camera(orbis::camera::ray_table rays) {
  rays_ = std::move(rays);
  scene_.camera = corner_rays(rays_);
}

void scene_builder::begin() {
  if (!std::exchange(scene_.is_over, false)) return;
  scene_.frame.reset();
  scene_.graph = {scene_.graph.revision + 1, {}, {}, {}};
  const std::size_t frames = scene_.numbers.frames;
  scene_.numbers = {};
  scene_.numbers.frames = frames;
  show_cubes();  // there are none
  tracking_ms_.clear();
  frames_seen_ = 0;
  takes_colors_ = scene_.voxels.absent.empty();
  last_reference_.reset();
  was_lost_ = true;
}

void scene_builder::finish(const scene_sources& sources) {
  scene_.is_over = true;
  static_cast<void>(update_at_once(sources));
  forget();
}

void scene_builder::forget() {
  forget_colors();
  graph_ = {};
  asked_ = {};
  trail_ = {};
}

void scene_builder::forget_colors() {
  takes_colors_ = false;
  colored_ = {};
  sample_count_ = 0;
  colors_ = voxel_colors{resolution_};
  cubes_ = {};
}

void scene_builder::show_cubes() {
  std::map<block_index, std::vector<shown_voxel>> blocks;
  block_index last{};
  std::vector<shown_voxel>* into = nullptr;
  std::vector<float> heights;
  heights.reserve(cubes_.size());
  for (const voxel& v : cubes_) {
    const auto level = static_cast<int>(std::lround(std::log2(static_cast<double>(v.size) / resolution_)));
    const double to_lowest = 0.5 * (static_cast<double>(v.size) - resolution_);
    block_index block{};
    std::array<std::uint8_t, 3> inside{};
    for (int i = 0; i != 3; ++i) {
      const auto cell =
          static_cast<std::int32_t>(std::floor((static_cast<double>(v.center[i]) - to_lowest) / resolution_));
      const std::int32_t b = cell >> 5;  // rounds towards minus infinity
      block[static_cast<std::size_t>(i)] = b;
      inside[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(cell - b * block_voxels);
    }
    if (into == nullptr || block != last) into = &blocks[last = block];
    into->push_back({inside[0], inside[1], inside[2], static_cast<std::uint8_t>(level), v.color});
    heights.push_back(v.center.z());
  }

  shown_voxels& shown = scene_.voxels;
  const std::uint64_t revision = shown.revision + 1;
  bool changed = false;
  for (auto& [index, block] : shown.blocks)
    if (!block.voxels.empty() && !blocks.contains(index)) {
      block = {revision, {}};
      changed = true;
    }
  for (auto& [index, voxels] : blocks) {
    voxel_block& block = shown.blocks[index];
    if (is_similar(block.voxels, voxels)) continue;
    block = {revision, std::move(voxels)};
    changed = true;
  }
  if (!changed) return;
  shown.revision = revision;
  shown.count = cubes_.size();
  if (heights.empty()) return;
  shown.floor =
      std::floor(10.0F * percentile(heights, 0.01)) / 10.0F;  // rounded, so that colours are stable while the map grows
  shown.ceiling = std::max(std::ceil(10.0F * percentile(heights, 0.99)) / 10.0F, shown.floor + 0.5F);
}

void scene_builder::update_numbers(const scene_sources& sources) {
  shown_numbers& n = scene_.numbers;
  if (!tracking_ms_.empty()) n.tracking_p95_ms = percentile(tracking_ms_, 0.95);
  if (!sources.numbers) return;
  const live_results live = sources.numbers();
  n.insertions = live.insert_ms.size();
  n.corrections = live.correction_ms.size();
  n.behind_frames = live.behind_frames_max;
  if (!live.insert_ms.empty()) {
    n.insert_ms = live.insert_ms.back();
    n.insert_p95_ms = percentile(live.insert_ms, 0.95);
  }
  if (!live.correction_ms.empty()) n.correction_ms = live.correction_ms.back();
}

}  // namespace app

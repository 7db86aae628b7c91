// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of map.hpp.
#pragma once

#include <array>
#include <limits>
#include <type_traits>

#include <orbis/slam/extractor.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam {
namespace detail {

/// Returns the index of the most typical of `count` descriptors (`of(i)`): the one with the smallest median distance to
/// the others, the first if several are equal. With more than 16 descriptors, 16 evenly spaced ones are compared, which
/// bounds the cost. With one or two, returns the last.
/// @pre count > 0
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), section III.C.
template <class Of>
[[nodiscard]] std::size_t most_typical(std::size_t count, Of&& of) {
  using distance = distance_of_t<std::remove_cvref_t<decltype(of(std::size_t{}))>>;
  constexpr std::size_t most = 16;
  const std::size_t n = std::min(count, most);
  if (n < 3) return count - 1;
  const auto original = [&](std::size_t i) { return i * (count - 1) / (n - 1); };
  std::array<std::array<std::uint32_t, most>, most> distances{};
  for (std::size_t i = 0; i != n; ++i)
    for (std::size_t j = 0; j != i; ++j)
      distances[i][j] = distances[j][i] = distance{}(of(original(i)), of(original(j)));
  std::size_t best = 0;
  std::uint32_t best_median = std::numeric_limits<std::uint32_t>::max();
  for (std::size_t i = 0; i != n; ++i) {
    const auto row = distances[i].begin();
    const auto middle = row + static_cast<std::ptrdiff_t>(n / 2);
    std::nth_element(row, middle, row + static_cast<std::ptrdiff_t>(n));
    if (*middle < best_median) {
      best_median = *middle;
      best = i;
    }
  }
  return original(best);
}

}  // namespace detail

template <feature_descriptor D>
basic_map<D>::basic_map(detail::map_content<D> content)
    : content_{std::move(content)}, covisibility_{content_.min_shared} {
  for (keyframe_id k = content_.keyframes.next_id(0); k != keyframe_end(); k = content_.keyframes.next_id(k + 1))
    content_.keyframes[k].landmarks.assign(content_.keyframes[k].size(), no_id);
  for (const landmark_type& l : content_.landmarks)
    for (const observation& o : l.observations) content_.keyframes[o.keyframe].landmarks[o.feature] = l.id;
  for (const keyframe_type& k : content_.keyframes) count_covisible(k, k.id);
}

template <feature_descriptor D>
se3 basic_map<D>::pose(keyframe_id id) const {
  se3 T_below_camera;
  while (!has_keyframe(id)) {
    const detail::erased_keyframe& e = content_.erased.at(id);
    T_below_camera = e.T_replacement_camera * detail::scaled(T_below_camera, e.scale);
    if (e.replacement == no_id) return T_below_camera;
    id = e.replacement;
  }
  return at(id).T_world_camera * detail::scaled(T_below_camera, at(id).scale);
}

template <feature_descriptor D>
double basic_map<D>::scale(keyframe_id id) const {
  double scale = 1.0;
  while (!has_keyframe(id)) {
    const detail::erased_keyframe& e = content_.erased.at(id);
    scale *= e.scale;
    if (e.replacement == no_id) return scale;
    id = e.replacement;
  }
  return scale * at(id).scale;
}

template <feature_descriptor D>
keyframe_id basic_map<D>::next_remembered(keyframe_id id) const {
  const auto gone = content_.erased.lower_bound(id);
  if (gone != content_.erased.end() && gone->first == id) return id;
  const keyframe_id there = content_.keyframes.next_id(id);
  return gone == content_.erased.end() ? there : std::min(there, gone->first);
}

template <feature_descriptor D>
void basic_map<D>::forget_erased(std::span<const keyframe_id> keep, std::size_t latest) {
  std::map<keyframe_id, detail::erased_keyframe> kept;
  const auto take = [&](keyframe_id id) {  // keeps an id with its chain of replacements
    for (auto e = content_.erased.find(id); e != content_.erased.end();) {
      const keyframe_id next = e->second.replacement;
      kept.insert(content_.erased.extract(e));
      e = next == no_id ? content_.erased.end() : content_.erased.find(next);
    }
  };
  for (const keyframe_id id : keep) take(id);
  std::vector<keyframe_id> young;
  for (const auto& [id, e] : content_.erased)
    if (content_.erasures - e.number <= latest) young.push_back(id);
  for (const keyframe_id id : young) take(id);
  content_.forgotten += content_.erased.size();
  content_.erased = std::move(kept);
}

template <feature_descriptor D>
void basic_map<D>::transform(const sim3& T_new_old) {
  for (keyframe_id k = content_.keyframes.next_id(0); k != keyframe_end(); k = content_.keyframes.next_id(k + 1))
    move_keyframe(k, T_new_old);
  for (const landmark_type& l : content_.landmarks) move_landmark(l.id, T_new_old);
  for (auto& [id, e] : content_.erased)
    if (e.replacement == no_id) {
      e.T_replacement_camera = moved(T_new_old, e.T_replacement_camera);
      e.scale *= T_new_old.scale();
    }
}

template <feature_descriptor D>
keyframe_id basic_map<D>::add_keyframe(frame_type f) {
  ++pose_changes_;
  if (content_.keyframes.end_id() == keyframe_id{0}) {
    content_.sensor = f.sensor;
    content_.scale_is_known = f.scale_is_known;
  }
  const keyframe_id before = content_.keyframes.empty() ? no_id : content_.keyframes.back().id;
  const std::vector<landmark_id> seen = std::exchange(f.landmarks, std::vector<landmark_id>(f.features.size(), no_id));
  const keyframe_id id = content_.keyframes.add({std::move(f), keyframe_end()});
  for (std::uint32_t i = 0; i < seen.size(); ++i)
    if (const landmark_id l = replacement(seen[i]); l != no_id) attach(l, id, i);
  count_covisible(at(id), no_id);
  const keyframe_id strongest = covisibility_.strongest(id).keyframe;
  content_.tree.add(id, strongest != no_id ? strongest : before);
  return id;
}

template <feature_descriptor D>
void basic_map<D>::erase_keyframe(keyframe_id id) {
  assert(has_keyframe(id));
  ++pose_changes_;
  for (const landmark_id l : at(id).landmarks)
    if (l != no_id) detach(l, id);
  const keyframe_id replacement =
      content_.tree.erase(id, [&](keyframe_id a, keyframe_id b) { return covisibility_.shared(a, b); });
  covisibility_.erase(id);
  const keyframe_type& gone = at(id);
  detail::erased_keyframe& kept =
      content_.erased[id] = {replacement, gone.T_world_camera, gone.scale, content_.erasures++};
  if (replacement != no_id) {
    const keyframe_type& by = at(replacement);
    kept.T_replacement_camera = detail::scaled(by.T_world_camera.inverse() * gone.T_world_camera, 1.0 / by.scale);
    kept.scale /= by.scale;
  }
  content_.keyframes.erase(id, replacement);
}

template <feature_descriptor D>
landmark_id basic_map<D>::add_landmark(keyframe_id id, std::uint32_t feature, const vec3& position) {
  assert(at(id).landmarks[feature] == no_id);
  landmark_type l;
  l.id = landmark_end();
  l.position = position;
  l.created = id;
  l.visible = l.found = 1;
  const landmark_id created = content_.landmarks.add(std::move(l));
  attach(created, id, feature);
  update_landmark(created);
  return created;
}

template <feature_descriptor D>
bool basic_map<D>::add_observation(landmark_id l, keyframe_id k, std::uint32_t feature) {
  if (!attach(l, k, feature)) return false;
  for (const observation& o : landmark_at(l).observations)
    if (o.keyframe != k) covisibility_.share(k, o.keyframe);
  return true;
}

template <feature_descriptor D>
void basic_map<D>::erase_observation(landmark_id l, keyframe_id k) {
  if (!has_landmark(l) || landmark_at(l).seen_by(k) == nullptr) return;
  for (const observation& o : landmark_at(l).observations)
    if (o.keyframe != k) covisibility_.unshare(k, o.keyframe);
  detach(l, k);
}

template <feature_descriptor D>
bool basic_map<D>::erase_observation(landmark_id l, const observation& noted) {
  const observation* const now = has_landmark(l) ? landmark_at(l).seen_by(noted.keyframe) : nullptr;
  if (now == nullptr || !(*now == noted)) return false;
  erase_observation(l, noted.keyframe);
  return true;
}

template <feature_descriptor D>
void basic_map<D>::fuse(landmark_id from, landmark_id into) {
  assert(from != into && has_landmark(into));
  landmark_type l = remove(from, into);
  for (const observation& o : l.observations)
    if (add_observation(into, o.keyframe, o.feature) && l.patch.pixels != nullptr) {  // measured with the patch of `l`
      pixel_spread spread = at(o.keyframe).spread(o.feature);
      spread.deviation = std::max(spread.deviation, l.patch.corner_deviation);
      set_spread(o.keyframe, o.feature, spread);
    }
  landmark_type& by = content_.landmarks[into];
  if (by.patch.pixels == nullptr) by.patch = std::move(l.patch);
  by.found += l.found;
  by.visible += l.visible;
}

template <feature_descriptor D>
void basic_map<D>::update_landmark(landmark_id id) {
  landmark_type& l = content_.landmarks[id];
  vec3 sum = zeros<vec3>();
  for (const observation& o : l.observations)
    sum += normalized(at(o.keyframe).T_world_camera.translation() - l.position);
  l.normal = norm(sum) > 0.0 ? vec3(normalized(sum)) : zeros<vec3>();
  const observation& last = l.observations.back();
  const keyframe_type& k = at(last.keyframe);
  const double distance = norm(k.T_world_camera.translation() - l.position);
  l.max_distance = distance * std::pow(content_.scale_factor, k.features.keypoints[last.feature].octave);
  l.min_distance = l.max_distance / std::pow(content_.scale_factor, content_.levels - 1);
  if (std::exchange(l.has_current_descriptor, true)) return;
  const auto of = [&](std::size_t i) -> const D& {
    return at(l.observations[i].keyframe).features.descriptors[l.observations[i].feature];
  };
  l.descriptor = of(detail::most_typical(l.observations.size(), of));
}

template <feature_descriptor D>
id_offsets basic_map<D>::append(basic_map&& other, const sim3& T_this_other, const map_link& link) {
  ++pose_changes_;
  assert(content_.levels == other.content_.levels && content_.scale_factor == other.content_.scale_factor);
  other.transform(T_this_other);
  const id_offsets offsets{keyframe_end().value(), landmark_end().value()};
  for (const auto& [id, e] : other.content_.erased) {
    detail::erased_keyframe& here = content_.erased[id + offsets.keyframes] = e;
    if (e.replacement != no_id) here.replacement += offsets.keyframes;
    here.number += content_.erasures;  // as if they were erased now, in the same order
  }
  content_.erasures += other.content_.erasures;
  content_.forgotten += other.content_.forgotten;
  content_.tree.append(std::move(other.content_.tree), offsets.keyframes, link.into, link.from);
  covisibility_.append(std::move(other.covisibility_), offsets.keyframes);
  content_.keyframes.append(std::move(other.content_.keyframes));
  content_.landmarks.append(std::move(other.content_.landmarks));
  if (offsets.keyframes == 0) {
    content_.sensor = other.content_.sensor;
    content_.scale_is_known = other.content_.scale_is_known;
  }
  for (keyframe_id id = content_.keyframes.next_id(offsets.keyframes); id != keyframe_end();
       id = content_.keyframes.next_id(id + 1)) {
    keyframe_type& k = content_.keyframes[id];
    k.id = id;
    for (landmark_id& l : k.landmarks)
      if (l != no_id) l += offsets.landmarks;
  }
  for (landmark_id id = next_landmark(offsets.landmarks); id != landmark_end(); id = next_landmark(id + 1)) {
    landmark_type& l = content_.landmarks[id];
    l.id = id;
    l.created += offsets.keyframes;
    for (observation& o : l.observations) o.keyframe += offsets.keyframes;
  }
  other = basic_map{content_.levels, content_.scale_factor, other.content_.min_shared};
  return offsets;
}

template <feature_descriptor D>
std::vector<covisible> basic_map<D>::observers(const std::vector<landmark_id>& landmarks) const {
  detail::counter<keyframe_id> observed;
  for (const landmark_id l : landmarks)
    if (has_landmark(l))
      for (const observation& o : landmark_at(l).observations) observed.add(o.keyframe);
  std::vector<covisible> order;
  for (const auto& e : observed.entries()) order.push_back({e.id, e.count});
  std::sort(order.begin(), order.end(), stronger);
  return order;
}

template <feature_descriptor D>
bool basic_map<D>::attach(landmark_id id, keyframe_id k, std::uint32_t feature) {
  landmark_id& shown = content_.keyframes[k].landmarks[feature];
  landmark_type& l = content_.landmarks[id];
  if (shown != no_id || l.seen_by(k) != nullptr) return false;
  shown = id;
  const auto at = std::lower_bound(l.observations.begin(), l.observations.end(), k,
                                   [](const observation& o, keyframe_id key) { return o.keyframe < key; });
  l.observations.insert(at, {k, feature});
  l.has_current_descriptor = false;
  return true;
}

template <feature_descriptor D>
void basic_map<D>::release(const landmark_type& l, const observation& o) {
  keyframe_type& k = content_.keyframes[o.keyframe];
  k.landmarks[o.feature] = no_id;
  if (k.spreads.empty()) return;
  // The patch no longer defines where the keypoint is, which is a corner again.
  const bool defines = l.patch.pixels != nullptr && l.created == o.keyframe;
  float& deviation = k.spreads[o.feature].deviation;
  deviation = std::max(deviation, defines ? l.patch.corner_deviation : 1.0F);
}

template <feature_descriptor D>
void basic_map<D>::detach(landmark_id id, keyframe_id k) {
  landmark_type& l = content_.landmarks[id];
  const auto at = l.observations.begin() + (l.seen_by(k) - l.observations.data());
  release(l, *at);
  l.observations.erase(at);
  l.has_current_descriptor = false;
  if (l.observations.empty()) content_.landmarks.erase(id);
}

template <feature_descriptor D>
auto basic_map<D>::remove(landmark_id id, landmark_id replacement) -> landmark_type {
  landmark_type l = std::move(content_.landmarks[id]);
  content_.landmarks.erase(id, replacement);
  for (auto o = l.observations.begin(); o != l.observations.end(); ++o) {
    release(l, *o);
    for (auto other = std::next(o); other != l.observations.end(); ++other)
      covisibility_.unshare(o->keyframe, other->keyframe);
  }
  return l;
}

template <feature_descriptor D>
void basic_map<D>::count_covisible(const keyframe_type& k, keyframe_id below) {
  detail::counter<keyframe_id> shared;
  for (const landmark_id l : k.landmarks)
    if (l != no_id)
      for (const observation& o : landmark_at(l).observations)
        if (o.keyframe != k.id && o.keyframe < below) shared.add(o.keyframe);
  auto entries = std::move(shared).take();
  std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  for (const auto& e : entries) covisibility_.share(k.id, e.id, e.count);
}

}  // namespace orbis::slam

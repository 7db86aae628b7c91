// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whether everything in a map of SLAM fits together.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/slam/detail/map/counter.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::test {

/// One check after the other; each gives the first thing that is wrong, in words, or done.
template <slam::feature_descriptor D>
class map_check {
 public:
  explicit map_check(const slam::basic_map<D>& m) : m_{m} {}

  [[nodiscard]] result<void> run() const {
    for (const auto check : {&map_check::keyframes, &map_check::landmarks, &map_check::covisibility, &map_check::tree,
                             &map_check::lineage})
      if (auto done = (this->*check)(); !done) return done;
    return {};
  }

 private:
  [[nodiscard]] static auto wrong_keyframe(slam::keyframe_id k, std::string what) {
    return fail(errc::malformed, "keyframe " + to_string(k), std::move(what));
  }
  [[nodiscard]] static auto wrong_landmark(slam::landmark_id l, std::string what) {
    return fail(errc::malformed, "landmark " + to_string(l), std::move(what));
  }
  [[nodiscard]] static bool is_finite(const se3& pose) {
    return all_finite(pose.translation()) && all_finite(pose.rotation().unit_quaternion().coeffs());
  }

  /// The first keyframe from an id on that is there.
  [[nodiscard]] slam::keyframe_id next(slam::keyframe_id id) const { return m_.keyframes().next_id(id); }

  [[nodiscard]] result<void> keyframes() const {
    std::size_t count = 0;
    for (slam::keyframe_id id = next(0); id != m_.keyframe_end(); id = next(id + 1)) {
      ++count;
      const auto& k = m_.at(id);
      if (k.id != id) return wrong_keyframe(id, "calls itself " + to_string(k.id));
      const std::size_t n = k.features.keypoints.size();
      if (k.features.descriptors.size() != n || k.depth.size() != n || k.rays.size() != n || k.landmarks.size() != n)
        return wrong_keyframe(id, "does not have one descriptor, depth, ray and landmark for each keypoint");
      if (!is_finite(k.T_world_camera)) return wrong_keyframe(id, "has a pose that is not finite");
      if (!(k.scale > 0.0 && std::isfinite(k.scale))) return wrong_keyframe(id, "has a scale that is none");
      for (std::size_t i = 0; i != n; ++i) {
        if (k.has_depth(i) && !all_finite(k.rays[i]))
          return wrong_keyframe(id, "has depth at keypoint " + std::to_string(i) + ", which has no ray");
        const slam::landmark_id l = k.landmarks[i];
        const auto at = "keypoint " + std::to_string(i) + " shows landmark " + to_string(l);
        if (l == slam::no_id) continue;
        if (!m_.has_landmark(l)) return wrong_keyframe(id, at + ", which is dead");
        const slam::observation* o = m_.landmark_at(l).seen_by(id);
        if (o == nullptr || o->feature != i) return wrong_keyframe(id, at + ", which does not know of it");
      }
    }
    if (count != m_.keyframes().size()) return fail(errc::malformed, "keyframes", "are not as many as are counted");
    return {};
  }

  [[nodiscard]] result<void> landmarks() const {
    std::size_t count = 0;
    for (slam::landmark_id id = m_.next_landmark(0); id != m_.landmark_end(); id = m_.next_landmark(id + 1)) {
      ++count;
      const auto& l = m_.landmark_at(id);
      if (l.id != id) return wrong_landmark(id, "calls itself " + to_string(l.id));
      if (l.observations.empty()) return wrong_landmark(id, "is seen by no keyframe");
      if (l.created >= m_.keyframe_end()) return wrong_landmark(id, "comes from a keyframe that never was");
      if (!all_finite(l.position) || !all_finite(l.normal)) return wrong_landmark(id, "is at no finite place");
      for (std::size_t i = 0; i != l.observations.size(); ++i) {
        const slam::observation& o = l.observations[i];
        const std::string by = "keyframe " + to_string(o.keyframe);
        if (i != 0 && l.observations[i - 1].keyframe >= o.keyframe)
          return wrong_landmark(id, "lists its observations in no order at " + by);
        if (!m_.has_keyframe(o.keyframe)) return wrong_landmark(id, "is seen by " + by + ", which is not there");
        const auto& k = m_.at(o.keyframe);
        if (o.feature >= k.size() || k.landmarks[o.feature] != id)
          return wrong_landmark(id, "is seen by " + by + ", which does not know of it");
      }
    }
    if (count != m_.landmark_count()) return fail(errc::malformed, "landmarks", "are not as many as are counted");
    return {};
  }

  /// Against a recount.
  [[nodiscard]] result<void> covisibility() const {
    const slam::covisibility_graph& graph = m_.covisibility();
    std::size_t sharing = 0;
    for (slam::keyframe_id id = next(0); id != m_.keyframe_end(); id = next(id + 1)) {
      slam::detail::counter<slam::keyframe_id> counted;
      for (const slam::landmark_id l : m_.at(id).landmarks)
        if (l != slam::no_id)
          for (const slam::observation& o : m_.landmark_at(l).observations)
            if (o.keyframe != id) counted.add(o.keyframe);
      std::vector<slam::covisible> shared;
      slam::covisible most;
      for (const auto& e : counted.entries()) {
        shared.push_back({e.id, e.count});
        if (slam::stronger(shared.back(), most)) most = shared.back();
      }
      std::sort(shared.begin(), shared.end(),
                [](const slam::covisible& a, const slam::covisible& b) { return a.keyframe < b.keyframe; });
      sharing += shared.empty() ? 0 : 1;
      if (!std::ranges::equal(shared, graph.sharing(id)))
        return wrong_keyframe(id, "shares other landmarks than the covisibility graph counts");
      if (most != graph.strongest(id)) return wrong_keyframe(id, "does not share most with whom the graph says");
      for (const slam::covisible& n : graph.neighbors(id))
        if (!graph.connected(n.keyframe, id))
          return wrong_keyframe(id, "has an edge to keyframe " + to_string(n.keyframe) + ", but not back");
      if (!shared.empty() && graph.neighbors(id).empty()) return wrong_keyframe(id, "shares landmarks but has no edge");
    }
    if (sharing != graph.size())
      return fail(errc::malformed, "covisibility", "has keyframes that share landmarks and are not there");
    return {};
  }

  [[nodiscard]] result<void> tree() const {
    const slam::spanning_tree& tree = m_.tree();
    if (tree.size() != m_.keyframes().size()) return fail(errc::malformed, "tree", "does not have all keyframes");
    if (m_.keyframes().empty()) {
      if (tree.root() != slam::no_id) return fail(errc::malformed, "tree", "has a root but no keyframe");
      return {};
    }
    if (!m_.has_keyframe(tree.root())) return fail(errc::malformed, "tree", "has a root that is not there");
    if (tree.parent(tree.root()) != slam::no_id) return fail(errc::malformed, "tree", "has a root with a parent");
    // Whatever the edges are, each keyframe is met at most once on the way down.
    std::vector<slam::keyframe_id> open{tree.root()};
    std::size_t reached = 0;
    while (!open.empty()) {
      const slam::keyframe_id id = open.back();
      open.pop_back();
      if (++reached > tree.size()) return wrong_keyframe(id, "is met twice in the tree");
      slam::keyframe_id last;
      for (const slam::keyframe_id child : tree.children(id)) {
        if (!m_.has_keyframe(child) || !tree.contains(child))
          return wrong_keyframe(id, "has the child " + to_string(child) + ", which is not there");
        if (tree.parent(child) != id) return wrong_keyframe(child, "is a child of " + to_string(id) + " only there");
        if (last != slam::no_id && last >= child) return wrong_keyframe(id, "lists its children in no order");
        open.push_back(last = child);
      }
      for (const slam::keyframe_id other : tree.loop_edges(id)) {
        if (other == id || !tree.contains(other)) return wrong_keyframe(id, "closes a loop with no keyframe");
        const auto& back = tree.loop_edges(other);
        if (!std::binary_search(back.begin(), back.end(), id))
          return wrong_keyframe(id, "closes a loop with " + to_string(other) + ", but not back");
      }
    }
    if (reached != tree.size()) return fail(errc::malformed, "tree", "does not hold all keyframes together");
    return {};
  }

  /// What was erased leads to what is there.
  [[nodiscard]] result<void> lineage() const {
    for (slam::keyframe_id id = m_.next_remembered(0); id != m_.keyframe_end(); id = m_.next_remembered(id + 1)) {
      const slam::keyframe_id replacement = m_.replacement(id);
      if (replacement != slam::no_id && !m_.has_keyframe(replacement))
        return wrong_keyframe(id, "became one that is not there");
      if (m_.has_keyframe(id)) continue;
      const slam::keyframe_id next = m_.content().erased.at(id).replacement;
      if (next != slam::no_id && !m_.remembers(next)) return wrong_keyframe(id, "became one that is forgotten");
      if (!is_finite(m_.pose(id))) return wrong_keyframe(id, "was at no finite place");
    }
    const std::size_t known = m_.content().erased.size() + m_.content().forgotten + m_.keyframes().size();
    if (known > m_.keyframe_end().value())
      return fail(errc::malformed, "keyframes", "are remembered as erased that never were");
    if (known < m_.keyframe_end().value())
      return fail(errc::malformed, "keyframes", "are gone, and where they were is not known");
    const auto& all = m_.landmarks();
    for (slam::landmark_id id = all.next_known_id(0); id != m_.landmark_end(); id = all.next_known_id(id + 1))
      if (const slam::landmark_id now = m_.replacement(id); now != slam::no_id && !m_.has_landmark(now))
        return wrong_landmark(id, "became one that is not there");
    return {};
  }

  const slam::basic_map<D>& m_;
};

/// Done if both sides of every observation agree, the covisibility graph is what a recount gives, the tree holds all
/// keyframes together, and what was erased leads to what is there; else the first thing that is wrong, and where.
/// O(map).
template <slam::feature_descriptor D>
[[nodiscard]] result<void> validate(const slam::basic_map<D>& m) {
  return map_check<D>{m}.run();
}

}  // namespace orbis::test

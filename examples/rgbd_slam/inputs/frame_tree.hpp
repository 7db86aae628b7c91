// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The coordinate frames of a robot and the transforms between them, as published on /tf_static and /tf.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/se3.hpp>

#include "inputs/ros_messages.hpp"

namespace app {

class frame_tree {
 public:
  struct link {
    std::string parent;
    orbis::se3 T_parent_child;
    bool is_constant = true;
  };

  /// Sets a static transform, which replaces an earlier one of the same child frame.
  void set(const ros_messages::transform& t) {
    links_.insert_or_assign(t.child_frame_id, link{t.header.frame_id, t.T_parent_child});
  }
  /// Adds a transform. A link for which different transforms are added is a moving link.
  void add(const ros_messages::transform& t) {
    const auto [at, is_new] = links_.try_emplace(t.child_frame_id, link{t.header.frame_id, t.T_parent_child});
    link& known = at->second;
    if (is_new || (known.parent == t.header.frame_id && is_equal(known.T_parent_child, t.T_parent_child))) return;
    known = {t.header.frame_id, t.T_parent_child, false};
  }

  /// The link of a frame to its parent; null for a root and for an unknown frame.
  [[nodiscard]] const link* find(const std::string& frame) const {
    const auto at = links_.find(frame);
    return at == links_.end() ? nullptr : &at->second;
  }
  /// The frame, its parent, and so on up to the root. In a cycle, each frame occurs once.
  [[nodiscard]] std::vector<std::string> path_to_root(std::string frame) const {
    std::vector<std::string> path{frame};
    std::set<std::string> known{frame};
    for (const link* up = find(frame); up != nullptr && known.insert(up->parent).second; up = find(path.back()))
      path.push_back(up->parent);
    return path;
  }
  /// `T_a_b`; empty if the frames are not connected by constant links.
  [[nodiscard]] std::optional<orbis::se3> transform(const std::string& a, const std::string& b) const {
    const auto up_b = constant_path(b);
    const std::map<std::string, orbis::se3> T_up_b{up_b.begin(), up_b.end()};
    for (const auto& [frame, T_frame_a] : constant_path(a))
      if (const auto met = T_up_b.find(frame); met != T_up_b.end()) return T_frame_a.inverse() * met->second;
    return std::nullopt;
  }

 private:
  static bool is_equal(const orbis::se3& a, const orbis::se3& b) {
    return a.translation() == b.translation() &&
           a.rotation().unit_quaternion().coeffs() == b.rotation().unit_quaternion().coeffs();
  }
  /// The ancestors of a frame up to the first moving link, with the pose of the frame in each ancestor.
  [[nodiscard]] std::vector<std::pair<std::string, orbis::se3>> constant_path(const std::string& frame) const {
    std::vector<std::pair<std::string, orbis::se3>> path;
    orbis::se3 T_up_frame;
    for (const std::string& up : path_to_root(frame)) {
      if (!path.empty()) {
        const link& last = *find(path.back().first);
        if (!last.is_constant) break;
        T_up_frame = last.T_parent_child * T_up_frame;
      }
      path.emplace_back(up, T_up_frame);
    }
    return path;
  }

  std::map<std::string, link> links_;
};

}  // namespace app

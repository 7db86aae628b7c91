// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finds the parts of a map that have changed since they were last read, from the map's change log.
#pragma once

#include <algorithm>
#include <cassert>
#include <concepts>
#include <cstdint>
#include <optional>
#include <utility>

#include <orbis/octree/change_log.hpp>

namespace orbis::nav::detail {

/// A map that records its changes.
template <class Map>
concept has_change_log = requires(const Map& map) {
  { map.changes() } -> std::convertible_to<const octree::change_log&>;
};

/// Stores the revision at which a map was last read.
class map_follower {
 public:
  /// Updates derived data from `map` by calling `some(log, since)` or `all()`, see the overload below; calls `all()` if
  /// the map has no log.
  template <class Map, class Some, class All>
  void follow(const Map& map, Some&& some, All&& all) {
    if constexpr (has_change_log<Map>) {
      const octree::change_log& log = map.changes();
      if (seen_ && *seen_ > log.revision()) seen_.reset();  // another map was moved into `map`
      follow(log, log.revision(), some, all);
    } else {
      all();
    }
  }
  /// Like the overload above, for a copy that was made at `revision` of the map to which `log` belongs. Calls `all()`
  /// if the log does not reach back to the last revision read. Otherwise, if that is not `revision`, calls `some(log,
  /// since)`: the changes after revision `since` in the log include all differences between the two.
  template <class Some, class All>
  void follow(const octree::change_log& log, std::uint64_t revision, Some&& some, All&& all) {
    assert(revision <= log.revision());
    // If the log is newer than both revisions, it may list more octants than have changed between them, never fewer.
    const std::uint64_t since = seen_ ? std::min(*seen_, revision) : 0;
    const std::optional<std::uint64_t> seen = std::exchange(seen_, std::nullopt);  // in case one of these throws
    if (!seen || since < log.complete_since() || log.revision() == 0)
      all();
    else if (*seen != revision)
      some(log, since);
    seen_ = revision;
  }
  /// Marks the current revision of `map` as read.
  template <class Map>
  void mark_read(const Map& map) {
    seen_.reset();
    if constexpr (has_change_log<Map>) seen_ = map.changes().revision();
  }

 private:
  std::optional<std::uint64_t> seen_;
};

}  // namespace orbis::nav::detail

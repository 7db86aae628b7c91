// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The ids of landmarks, keyframes and maps.
#pragma once

#include <compare>
#include <cstdint>
#include <limits>
#include <ostream>
#include <string>

namespace orbis::slam {

/// The value of a null id, which refers to no object.
inline constexpr std::uint32_t no_id = std::numeric_limits<std::uint32_t>::max();

/// A strongly typed 32-bit id. An integer converts to an id; an id converts neither to an integer nor to an id of
/// another kind (`value()` returns the integer). Ids are assigned in ascending order and never reused.
template <class Kind>
class basic_id {
 public:
  /// `no_id`.
  constexpr basic_id() noexcept = default;
  constexpr basic_id(std::uint32_t value) noexcept : value_{value} {}

  [[nodiscard]] constexpr std::uint32_t value() const noexcept { return value_; }

  constexpr basic_id& operator++() noexcept {
    ++value_;
    return *this;
  }
  constexpr basic_id operator++(int) noexcept { return value_++; }
  constexpr basic_id& operator+=(std::uint32_t n) noexcept {
    value_ += n;
    return *this;
  }
  friend constexpr basic_id operator+(basic_id id, std::uint32_t n) noexcept { return id.value_ + n; }
  /// The difference of two ids.
  friend constexpr std::uint32_t operator-(basic_id a, basic_id b) noexcept { return a.value_ - b.value_; }
  friend constexpr bool operator==(basic_id, basic_id) noexcept = default;
  friend constexpr auto operator<=>(basic_id, basic_id) noexcept = default;

  friend std::string to_string(basic_id id) { return std::to_string(id.value_); }
  friend std::ostream& operator<<(std::ostream& out, basic_id id) { return out << id.value_; }

 private:
  std::uint32_t value_ = no_id;
};

/// Identifies a landmark within its map.
using landmark_id = basic_id<struct landmark_kind>;
/// Identifies a keyframe within its map.
using keyframe_id = basic_id<struct keyframe_kind>;
/// Identifies a map within its atlas.
using map_id = basic_id<struct map_kind>;

/// Identifies a keyframe within an atlas.
struct map_keyframe {
  map_id map = 0;
  keyframe_id keyframe;
  friend constexpr bool operator==(const map_keyframe&, const map_keyframe&) = default;
};

/// The offsets added to the ids of a map when it was merged into another one.
struct id_offsets {
  std::uint32_t keyframes = 0;
  std::uint32_t landmarks = 0;
};

/// A pair of keyframes, one from each of two maps, that observe the same place. One map is attached to the other there.
struct map_link {
  keyframe_id into;  ///< keyframe of the map that is kept
  keyframe_id from;  ///< keyframe of the merged map, with its id in that map
};

}  // namespace orbis::slam

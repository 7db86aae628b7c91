// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The order of the observations in bundle adjustment, and the blocks of its reduced system.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/optimize/detail/sparse/block_ordering.hpp>

namespace orbis::optimize::detail {

/// Observations in two orders. The order by camera is for arithmetic that is the same for each observation: within a
/// chunk of points that fits into the cache, the observations by one camera form a segment; segments consist of tiles
/// of eight places, and the last tile may have empty places. The order by point, with cameras ascending, is for
/// products of pairs of observations of a point: points observed by the same cameras are adjacent and form groups;
/// points with the same first camera are also adjacent, so that their pairs update a common part of the reduced system.
/// Reuses its memory.
///
/// O(observations + pairs of observations of the same point + pairs of movable cameras). Memory: also one bit for each
/// pair of movable cameras.
template <class = void>
class basic_bundle_structure {
 public:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t tile = 8;

  /// The observations of a chunk's points by one camera, at the places [8 * first_tile, 8 * first_tile + count).
  struct segment {
    std::uint32_t camera = 0;
    std::uint32_t count = 0;
    std::size_t first_tile = 0;
    std::size_t first_mixed_tile = 0;  ///< like `first_tile`, but counting only tiles of movable cameras
  };
  /// Points observed by the same `cameras` movable cameras. The observation of the i-th point by the a-th of these
  /// cameras has the index `first_mixed + a * points + i`.
  struct group {
    std::uint32_t first_point = 0, points = 0;
    std::uint32_t first_mixed = 0, cameras = 0;
    std::size_t first_pair = 0;  ///< index of the first pair (a > b, a ascending); shared by groups of the same cameras
  };
  /// A run of consecutive points with all their observations; it ends where the next chunk begins.
  struct chunk {
    std::size_t first_point = 0, first_segment = 0, first_group = 0, first_mixed = 0;
  };

  std::vector<chunk> chunk_begin;           ///< start of each chunk, followed by the end
  std::vector<segment> segments;            ///< ordered by chunk, then by camera
  std::vector<std::uint32_t> source;        ///< index of the caller's observation at each place
  std::vector<std::uint32_t> point;         ///< point of each place; for empty places, the segment's first point
  std::vector<std::uint32_t> mixed_number;  ///< for each place: its index among observations by movable cameras

  std::vector<std::uint32_t> point_source;  ///< index of point p in the caller's array
  std::vector<group> groups;
  std::vector<std::uint32_t> mixed_unknown;  ///< for each observation by a movable camera: the unknown of the camera
  /// For each observation by a movable camera: its place, counting only places of movable cameras.
  std::vector<std::uint32_t> mixed_place;
  std::vector<std::uint32_t> pair_slot;  ///< slot of each pair of observations

  // Movable cameras, and blocks of the reduced system: the lower triangle including the diagonal, row by row.
  std::vector<std::uint32_t> count;            ///< number of observations by each camera
  std::vector<std::uint32_t> unknown, camera;  ///< for each camera, its unknown or `none`; for each unknown, its camera
  std::vector<block_place> slots;
  std::vector<std::uint32_t> diagonal_slot;  ///< slot of each movable camera

  [[nodiscard]] std::size_t unknowns() const { return camera.size(); }
  [[nodiscard]] std::size_t points() const { return point_source.size(); }
  [[nodiscard]] std::size_t chunks() const { return chunk_begin.empty() ? 0 : chunk_begin.size() - 1; }
  [[nodiscard]] std::size_t places() const { return source.size(); }
  [[nodiscard]] std::size_t mixed_tiles() const { return mixed_tiles_; }
  [[nodiscard]] std::size_t pairs() const { return pairs_; }  ///< number of pairs of observations of the same point
  /// The largest number of observations by movable cameras in a chunk.
  [[nodiscard]] std::size_t largest_chunk() const { return largest_chunk_; }

  /// Orders the observations for which `is_usable(index)` is true. Cameras without such observations are not moved.
  /// @pre their indices are in range; `fixed` is empty or has one entry per camera
  template <class Observation, class Usable>
  void build(std::size_t cameras, std::size_t points, std::span<const Observation> observations,
             std::span<const std::uint8_t> fixed, const Usable& is_usable) {
    sort(cameras, points, observations, is_usable);
    number_cameras(cameras, fixed);
    order_points(points);
    find_points_alike();
    lay_out(cameras);
    find_blocks();
  }

 private:
  struct entry {
    std::uint32_t observation, other;  ///< `other`: index of the observation's point or camera, depending on the order
  };
  struct span_of_cameras {
    /// The first and last movable cameras that observe a point, and the number of movable cameras that observe it.
    std::uint32_t first = none, last = none, seen = 0;
  };

  [[nodiscard]] std::span<const entry> point_observations(std::size_t source_point) const {
    return std::span{by_point_}.subspan(of_point_[source_point], of_point_[source_point + 1] - of_point_[source_point]);
  }

  /// Sorts observations: `by_point_` contains those of each point in ascending order of camera.
  template <class Observation, class Usable>
  void sort(std::size_t cameras, std::size_t points, std::span<const Observation> observations,
            const Usable& is_usable) {
    count.assign(cameras, 0);
    of_point_.assign(points + 1, 0);
    for (std::uint32_t k = 0; k != observations.size(); ++k)
      if (is_usable(k)) {
        ++count[observations[k].pose];
        ++of_point_[observations[k].point + 1];
      }
    for (std::size_t p = 0; p != points; ++p) of_point_[p + 1] += of_point_[p];
    cursor_.assign(cameras + 1, 0);
    for (std::size_t c = 0; c != cameras; ++c) cursor_[c + 1] = cursor_[c] + count[c];
    by_camera_.resize(of_point_[points]);
    for (std::uint32_t k = 0; k != observations.size(); ++k)
      if (is_usable(k)) by_camera_[cursor_[observations[k].pose]++] = {k, observations[k].point};
    cursor_.assign(of_point_.begin(), of_point_.end());
    by_point_.resize(by_camera_.size());
    const entry* at = by_camera_.data();
    for (std::uint32_t c = 0; c != cameras; ++c)
      for (const entry* const end = at + count[c]; at != end; ++at)
        by_point_[cursor_[at->other]++] = {at->observation, c};
  }

  void number_cameras(std::size_t cameras, std::span<const std::uint8_t> fixed) {
    unknown.assign(cameras, none);
    camera.clear();
    for (std::uint32_t c = 0; c != cameras; ++c)
      if (count[c] != 0 && (fixed.empty() || fixed[c] == 0)) {
        unknown[c] = static_cast<std::uint32_t>(camera.size());
        camera.push_back(c);
      }
  }

  /// Sorts points by their first and last movable cameras and by the number of their movable cameras.
  void order_points(std::size_t points) {
    const auto n = static_cast<std::uint32_t>(unknowns());
    spans_.assign(points, {});
    point_source.clear();
    for (std::uint32_t p = 0; p != points; ++p) {
      if (of_point_[p] == of_point_[p + 1]) continue;
      point_source.push_back(p);
      span_of_cameras& s = spans_[p];
      for (const entry& o : point_observations(p))
        if (const std::uint32_t u = unknown[o.other]; u != none) {
          s.first = std::min(s.first, u);
          s.last = u;
          ++s.seen;
        }
    }
    sort_points(n, [&](std::uint32_t p) { return std::min(spans_[p].seen, n); });
    sort_points(n, [&](std::uint32_t p) { return std::min(spans_[p].last, n); });
    sort_points(n, [&](std::uint32_t p) { return std::min(spans_[p].first, n); });
  }
  /// Stably sorts `point_source` by a key of at most `largest`.
  template <class Key>
  void sort_points(std::uint32_t largest, const Key& key) {
    cursor_.assign(std::size_t{largest} + 2, 0);
    for (const std::uint32_t p : point_source) ++cursor_[key(p) + 1];
    for (std::size_t k = 0; k != std::size_t{largest} + 1; ++k) cursor_[k + 1] += cursor_[k];
    moved_.resize(point_source.size());
    for (const std::uint32_t p : point_source) moved_[cursor_[key(p)]++] = p;
    point_source.swap(moved_);
  }

  void find_points_alike() {
    is_like_last_.assign(points(), 0);
    for (std::size_t p = 1; p < points(); ++p) {
      const std::span<const entry> one = point_observations(point_source[p - 1]),
                                   other = point_observations(point_source[p]);
      const auto moves = [&](const entry& o) { return unknown[o.other] != none; };
      auto a = one.begin(), b = other.begin();
      for (;; ++a, ++b) {
        a = std::find_if(a, one.end(), moves), b = std::find_if(b, other.end(), moves);
        if (a == one.end() || b == other.end() || a->other != b->other) break;
      }
      is_like_last_[p] = a == one.end() && b == other.end() ? 1 : 0;
    }
  }

  /// Divides the points into chunks. A chunk ends when it has enough observations, in total and per camera.
  void lay_out(std::size_t cameras) {
    constexpr std::size_t enough = 2048, enough_of_camera = 48;
    segments.clear();
    groups.clear();
    chunk_begin.assign(1, {});
    point.clear();
    source.clear();
    mixed_number.clear();
    mixed_unknown.clear();
    mixed_place.clear();
    in_chunk_.assign(cameras, 0);
    mixed_in_chunk_.assign(cameras, 0);
    mixed_tiles_ = largest_chunk_ = 0;
    std::size_t tiles = 0;
    for (std::size_t begin = 0, end = 0; begin != points(); begin = end) {
      std::size_t observations = 0;
      touched_.clear();
      while (end != points() && observations < std::max(enough, enough_of_camera * touched_.size()))
        for (const std::size_t stop = std::min(points(), end + tile); end != stop; ++end)
          for (const entry& o : point_observations(point_source[end])) {
            if (in_chunk_[o.other]++ == 0) touched_.push_back(o.other);
            ++observations;
          }
      std::sort(touched_.begin(), touched_.end());
      for (const std::uint32_t c : touched_) {
        segments.push_back({c, in_chunk_[c], tiles, mixed_tiles_});
        in_chunk_[c] = static_cast<std::uint32_t>(tile * tiles);  // the next free places
        mixed_in_chunk_[c] = static_cast<std::uint32_t>(tile * mixed_tiles_);
        const std::size_t own = (segments.back().count + tile - 1) / tile;
        tiles += own;
        if (unknown[c] != none) mixed_tiles_ += own;
      }
      source.resize(tile * tiles, none);
      point.resize(source.size(), none);
      mixed_number.resize(source.size(), none);
      for (std::size_t p = begin, next = 0; p != end; p = next) {
        next = end_of_group(p, end);
        place_group(p, next);
      }
      for (const std::uint32_t c : touched_) in_chunk_[c] = 0;
      for (std::size_t s = chunk_begin.back().first_segment; s != segments.size(); ++s) {
        const std::size_t at = tile * segments[s].first_tile;
        for (std::size_t place = at + segments[s].count; place % tile != 0; ++place) point[place] = point[at];
      }
      largest_chunk_ = std::max(largest_chunk_, mixed_unknown.size() - chunk_begin.back().first_mixed);
      chunk_begin.push_back({end, segments.size(), groups.size(), mixed_unknown.size()});
    }
  }
  /// Returns the end of the group that begins at `p`; groups fit into the first-level cache.
  [[nodiscard]] std::size_t end_of_group(std::size_t p, std::size_t end) const {
    constexpr std::size_t room = 96;
    const std::size_t most = std::max<std::size_t>(1, room / std::max(1U, spans_[point_source[p]].seen));
    std::size_t next = p + 1;
    while (next != end && next - p < most && is_like_last_[next] != 0) ++next;
    return next;
  }
  void place_group(std::size_t begin, std::size_t end) {
    group g;
    g.first_point = static_cast<std::uint32_t>(begin);
    g.points = static_cast<std::uint32_t>(end - begin);
    g.first_mixed = static_cast<std::uint32_t>(mixed_unknown.size());
    g.cameras = spans_[point_source[begin]].seen;
    groups.push_back(g);
    mixed_unknown.resize(mixed_unknown.size() + std::size_t{g.points} * g.cameras);
    mixed_place.resize(mixed_unknown.size());
    for (std::size_t p = begin; p != end; ++p) {
      std::size_t number = g.first_mixed + (p - begin);
      for (const entry& o : point_observations(point_source[p])) {
        const std::size_t place = in_chunk_[o.other]++;
        source[place] = o.observation;
        point[place] = static_cast<std::uint32_t>(p);
        if (unknown[o.other] == none) continue;
        mixed_number[place] = static_cast<std::uint32_t>(number);
        mixed_unknown[number] = unknown[o.other];
        mixed_place[number] = mixed_in_chunk_[o.other]++;
        number += g.points;
      }
    }
  }

  /// Returns true if the group has the same pairs as the previous one.
  [[nodiscard]] bool shares_pairs(std::size_t g) const { return g != 0 && is_like_last_[groups[g].first_point] != 0; }
  /// Calls `f(row * (row + 1) / 2 + column)` for the pairs of each group that does not share the previous group's
  /// pairs.
  template <class F>
  void for_each_pair(const F& f) const {
    for (std::size_t k = 0; k != groups.size(); ++k) {
      if (shares_pairs(k)) continue;
      const group& g = groups[k];
      const auto unknown_of = [&](std::size_t a) { return std::size_t{mixed_unknown[g.first_mixed + a * g.points]}; };
      for (std::size_t a = 1; a < g.cameras; ++a) {
        const std::size_t row = unknown_of(a);
        for (std::size_t b = 0; b != a; ++b) f(row * (row + 1) / 2 + unknown_of(b));
      }
    }
  }

  void find_blocks() {
    const std::size_t n = unknowns();
    present_.assign((n * (n + 1) / 2 + 63) / 64, 0);
    const auto bit = [](std::size_t at) { return std::uint64_t{1} << (at % 64); };
    for (std::size_t i = 0; i != n; ++i) present_[i * (i + 3) / 2 / 64] |= bit(i * (i + 3) / 2);
    for_each_pair([&](std::size_t at) { present_[at / 64] |= bit(at); });
    rank_.resize(present_.size());
    std::uint32_t total = 0;
    for (std::size_t w = 0; w != present_.size(); ++w) {
      rank_[w] = total;
      total += static_cast<std::uint32_t>(std::popcount(present_[w]));
    }
    const auto slot_of = [&](std::size_t at) {
      return rank_[at / 64] + static_cast<std::uint32_t>(std::popcount(present_[at / 64] & (bit(at) - 1)));
    };
    slots.clear();
    slots.reserve(total);
    diagonal_slot.resize(n);
    std::size_t at = 0;
    for (std::uint32_t i = 0; i != n; ++i) {
      for (std::uint32_t j = 0; j <= i; ++j, ++at)
        if ((present_[at / 64] & bit(at)) != 0) slots.push_back({i, j});
      diagonal_slot[i] = static_cast<std::uint32_t>(slots.size() - 1);
    }
    pair_slot.clear();
    for_each_pair([&](std::size_t pair) { pair_slot.push_back(slot_of(pair)); });
    pairs_ = 0;
    std::size_t distinct = 0;  // number of pairs up to this group
    for (std::size_t k = 0; k != groups.size(); ++k) {
      group& g = groups[k];
      const std::size_t own = std::size_t{g.cameras} * (std::max(1U, g.cameras) - 1) / 2;
      pairs_ += own * g.points;
      if (!shares_pairs(k)) distinct += own;
      g.first_pair = distinct - own;
    }
  }

  std::size_t mixed_tiles_ = 0, largest_chunk_ = 0, pairs_ = 0;
  std::vector<entry> by_camera_, by_point_;
  std::vector<std::uint32_t> of_point_, cursor_, moved_, in_chunk_, mixed_in_chunk_, touched_;
  std::vector<std::uint8_t> is_like_last_;  // for each point: true if the same movable cameras observe the previous one
  std::vector<span_of_cameras> spans_;
  std::vector<std::uint64_t> present_;
  std::vector<std::uint32_t> rank_;
};
using bundle_structure = basic_bundle_structure<>;

}  // namespace orbis::optimize::detail

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What has changed since when: for sending a map's changes to other processes, or bringing up to date
/// what was derived from it.
#pragma once

#include <algorithm>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/octree/key.hpp>
#include <orbis/octree/morton.hpp>

namespace orbis::octree {

/// A log of changed voxels, as masks of octants of 4x4x4 voxels, by revision. Whoever has seen revision
/// r asks for what changed after it:
///
/// @code
///   const std::uint64_t seen = log.revision();
///   ...                                            // begin_revision(), record() with each scan
///   log.for_each_since(seen, [&](const voxel_key& octant, std::uint64_t mask) { send(octant, mask); });
/// @endcode
///
/// 16 bytes for each recorded octant and revision, up to a capacity; then the oldest revisions are
/// merged, each octant once (24 bytes), so that memory is bounded by the capacity and the number of
/// octants that have ever changed. Const members may be called from several threads at once.
class change_log {
 public:
  /// The current revision; 0 until the first begin_revision().
  [[nodiscard]] std::uint64_t revision() const noexcept { return revision_; }
  /// Begins the next revision, and returns its number.
  std::uint64_t begin_revision() noexcept { return ++revision_; }

  /// Voxels of the octant that contains `k` have changed in this revision: those whose bits are set, in
  /// Morton order. Any number of times for the same octant. Amortised O(log capacity), if the octants
  /// that have changed are not many more than the capacity. @pre revision() != 0; coordinates < 2^21
  void record(const voxel_key& k, std::uint64_t mask) {
    assert(revision_ != 0);
    if (mask == 0) return;
    const std::uint64_t octant = morton_code(k) >> 6U;
    if (runs_.empty() || runs_.back().revision != revision_) {
      runs_.push_back({revision_, entries_.size()});
    } else if (entries_.back().octant == octant) {
      entries_.back().mask |= mask;
      return;
    }
    if (entries_.size() >= limit_) compact();
    entries_.push_back({octant, mask});
  }

  /// Calls `visit(lowest voxel of the octant, mask)` once for every octant of which a voxel changed
  /// after `revision`, in Morton order; the mask has the voxels that did. If `revision` is older than
  /// exact_since(), it may have more of those that changed before as well. O(n log n) for the n entries
  /// looked at. @pre revision >= complete_since()
  template <std::invocable<const voxel_key&, std::uint64_t> Visit>
  void for_each_since(std::uint64_t revision, Visit&& visit) const {
    assert(revision >= complete_since_);
    std::vector<entry> changed;
    const std::size_t first = first_after(revision);
    changed.reserve((revision < exact_since_ ? merged_.size() : 0) + entries_.size() - first);
    if (revision < exact_since_)
      for (const merged_entry& m : merged_)
        if (m.last > revision) changed.push_back({m.octant, m.mask});
    changed.insert(changed.end(), entries_.begin() + static_cast<std::ptrdiff_t>(first), entries_.end());
    unite(changed, 0);
    for (const entry& e : changed) visit(morton_key(e.octant << 6U), e.mask);
  }

  /// Nobody will ask for what changed after a revision older than this one any more.
  void forget_before(std::uint64_t revision) {
    if (revision <= complete_since_) return;
    complete_since_ = std::min(revision, revision_);
    exact_since_ = std::max(exact_since_, complete_since_);
    std::erase_if(merged_, [&](const merged_entry& m) { return m.last <= complete_since_; });
    drop_first(runs_until(complete_since_));
  }
  /// The oldest revision that may be asked about, see forget_before() and clear(): who has seen only an
  /// older one needs the whole map.
  [[nodiscard]] std::uint64_t complete_since() const noexcept { return complete_since_; }
  /// The oldest revision about which answers are exact; for older ones they may have too many voxels,
  /// never too few.
  [[nodiscard]] std::uint64_t exact_since() const noexcept { return exact_since_; }

  /// How many octants and revisions to tell apart before the oldest are merged. The current revision is
  /// never merged, however much there is of it.
  void set_capacity(std::size_t entries) {
    capacity_ = entries;
    limit_ = entries;
    if (entries_.size() > limit_) compact();
  }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }

  /// Forgets all changes, keeps counting revisions.
  void clear() {
    const std::size_t capacity = capacity_;
    const std::uint64_t revision = revision_;
    *this = {};
    capacity_ = limit_ = capacity;
    revision_ = complete_since_ = exact_since_ = revision;
  }
  /// Bytes on the heap.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return entries_.capacity() * sizeof(entry) + runs_.capacity() * sizeof(run) +
           merged_.capacity() * sizeof(merged_entry);
  }

 private:
  struct entry {
    std::uint64_t octant;  ///< its Morton code
    std::uint64_t mask;
  };
  /// The entries of one revision: from `first` to where the next run begins.
  struct run {
    std::uint64_t revision;
    std::size_t first;
  };
  struct merged_entry {
    std::uint64_t octant;
    std::uint64_t mask;
    std::uint64_t last;  ///< revision in which it changed
  };

  /// The number of runs of revisions up to `revision`.
  [[nodiscard]] std::size_t runs_until(std::uint64_t revision) const noexcept {
    const auto after =
        std::partition_point(runs_.begin(), runs_.end(), [&](const run& r) { return r.revision <= revision; });
    return static_cast<std::size_t>(after - runs_.begin());
  }
  [[nodiscard]] std::size_t run_begin(std::size_t i) const noexcept {
    return i == runs_.size() ? entries_.size() : runs_[i].first;
  }
  [[nodiscard]] std::size_t first_after(std::uint64_t revision) const noexcept {
    return run_begin(runs_until(revision));
  }

  /// Sorts the entries from the `first` on, each octant once.
  static void unite(std::vector<entry>& entries, std::size_t first) {
    const auto begin = entries.begin() + static_cast<std::ptrdiff_t>(first);
    std::sort(begin, entries.end(), [](const entry& a, const entry& b) { return a.octant < b.octant; });
    auto out = begin;
    for (auto in = begin; in != entries.end(); ++in) {
      if (out != begin && (out - 1)->octant == in->octant)
        (out - 1)->mask |= in->mask;
      else
        *out++ = *in;
    }
    entries.erase(out, entries.end());
  }

  /// Drops the first `n` runs and their entries.
  void drop_first(std::size_t n) {
    const std::size_t dropped = run_begin(n);
    entries_.erase(entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(dropped));
    runs_.erase(runs_.begin(), runs_.begin() + static_cast<std::ptrdiff_t>(n));
    for (run& r : runs_) r.first -= dropped;
  }

  /// Unites the newest revision, which loses nothing, then merges the oldest until half of the capacity
  /// is free or only the newest is left.
  void compact() {
    if (runs_.empty()) return;
    unite(entries_, runs_.back().first);
    std::size_t n = 0;
    while (n + 1 < runs_.size() && entries_.size() - run_begin(n) > capacity_ / 2) ++n;
    if (n != 0) merge_first(n);
    limit_ = std::max(capacity_, 2 * entries_.size());
  }
  void merge_first(std::size_t n) {
    const std::size_t old = merged_.size();
    for (std::size_t i = 0; i != n; ++i)
      for (std::size_t e = run_begin(i); e != run_begin(i + 1); ++e)
        merged_.push_back({entries_[e].octant, entries_[e].mask, runs_[i].revision});
    const auto by_octant = [](const merged_entry& a, const merged_entry& b) { return a.octant < b.octant; };
    const auto added = merged_.begin() + static_cast<std::ptrdiff_t>(old);
    std::sort(added, merged_.end(), by_octant);
    std::inplace_merge(merged_.begin(), added, merged_.end(), by_octant);
    auto out = merged_.begin();
    for (const merged_entry& m : merged_) {
      if (out != merged_.begin() && (out - 1)->octant == m.octant) {
        (out - 1)->mask |= m.mask;
        (out - 1)->last = std::max((out - 1)->last, m.last);
      } else {
        *out++ = m;
      }
    }
    merged_.erase(out, merged_.end());
    exact_since_ = std::max(exact_since_, runs_[n - 1].revision);
    drop_first(n);
  }

  std::vector<entry> entries_;  ///< in the order of revisions
  std::vector<run> runs_;
  std::vector<merged_entry> merged_;  ///< in Morton order
  std::uint64_t revision_ = 0;
  std::uint64_t complete_since_ = 0;
  std::uint64_t exact_since_ = 0;
  std::size_t capacity_ = std::size_t{1} << 20U;
  std::size_t limit_ = capacity_;  ///< entries at which to compact
};

}  // namespace orbis::octree

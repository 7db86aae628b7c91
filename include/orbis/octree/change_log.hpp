// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Log of voxels changed since a revision, for sending map changes to other processes or updating data derived from the
/// map.
#pragma once

#include <algorithm>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include <orbis/core/hash_index.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree {

/// A log of the voxels that changed in each revision, as masks of octants of 4x4x4 voxels. A reader that has processed
/// revision r requests the changes after it:
///
/// @code
///   const std::uint64_t seen = log.revision();
///   ...                                            // begin_revision(), record() with each scan
///   log.for_each_since(seen, [&](const voxel_key& octant, std::uint64_t mask) { send(octant, mask); });
/// @endcode
///
/// Takes 24 bytes per recorded octant and revision, up to a capacity. Beyond the capacity the oldest entries are merged
/// into one entry per octant, a few with each new entry. Memory is thus bounded by the capacity and the number of
/// octants that have ever changed, and record() has no long pauses. Const members can be called from several threads
/// concurrently.
class change_log {
 public:
  /// Returns the current revision; 0 before the first begin_revision().
  [[nodiscard]] std::uint64_t revision() const noexcept { return revision_; }
  /// Begins the next revision and returns its number.
  std::uint64_t begin_revision() noexcept {
    if (entries_.size() < 2 * capacity_) limit_ = 2 * capacity_;
    return ++revision_;
  }

  /// Records that the voxels selected by `mask` (bits in Morton order) of the octant that contains `k` changed in this
  /// revision. Can be called repeatedly for an octant. Amortised O(1), as long as no revision exceeds twice the
  /// capacity.
  /// @pre revision() != 0; coordinates < 2^21
  void record(const voxel_key& k, std::uint64_t mask) {
    assert(revision_ != 0);
    if (mask == 0) return;
    const std::uint64_t octant = morton_code(k) >> 6U;
    if (!entries_.empty() && entries_.back().octant == octant && entries_.back().revision == revision_) {
      entries_.back().mask |= mask;
      return;
    }
    // Merge two old entries for each new one, so that a log that has grown too long shrinks again.
    for (int i = 0; i != 2 && entries_.size() >= capacity_; ++i) merge_oldest();
    if (entries_.size() >= limit_) unite_newest();
    entries_.push_back({octant, mask, revision_});
  }

  /// Calls `visit(lowest voxel of the octant, mask)` once for every octant with voxels that changed after `revision`,
  /// in Morton order; the mask selects these voxels. If `revision` is older than exact_since(), the mask may also
  /// contain voxels that changed earlier. O(n log n) for n entries read. @pre revision >= complete_since()
  template <std::invocable<const voxel_key&, std::uint64_t> Visit>
  void for_each_since(std::uint64_t revision, Visit&& visit) const {
    assert(revision >= complete_since_);
    std::vector<entry> changed;
    const std::size_t first = first_after(revision);
    changed.reserve((revision < exact_since_ ? merged_.size() : 0) + entries_.size() - first);
    if (revision < exact_since_)
      std::copy_if(merged_.begin(), merged_.end(), std::back_inserter(changed),
                   [&](const entry& e) { return e.revision > revision; });
    for (std::size_t i = first; i != entries_.size(); ++i) changed.push_back(entries_[i]);
    unite(changed);
    for (const entry& e : changed) visit(morton_key(e.octant << 6U), e.mask);
  }

  /// Discards changes up to `revision`, which becomes the oldest revision for queries. O(entries).
  void forget_before(std::uint64_t revision) {
    if (revision <= complete_since_) return;
    complete_since_ = std::max(complete_since_, std::min(revision, revision_));
    exact_since_ = std::max(exact_since_, complete_since_);
    while (!entries_.empty() && entries_[0].revision <= complete_since_) entries_.pop_front();
    std::erase_if(merged_, [&](const entry& e) { return e.revision <= complete_since_; });
    merged_index_.clear();
    for (std::size_t i = 0; i != merged_.size(); ++i)
      merged_index_.set(merged_[i].octant, static_cast<std::uint32_t>(i));
  }
  /// Oldest revision for which queries are complete, see forget_before(), clear() and stop(). A reader that has
  /// processed only an older revision needs the whole map.
  [[nodiscard]] std::uint64_t complete_since() const noexcept { return complete_since_; }
  /// Oldest revision for which queries are exact; for older revisions the masks may contain additional voxels.
  [[nodiscard]] std::uint64_t exact_since() const noexcept { return exact_since_; }

  /// Sets the number of entries (one per octant and revision) above which the oldest are merged. The current revision
  /// is never merged, regardless of its size.
  void set_capacity(std::size_t entries) {
    capacity_ = entries;
    limit_ = 2 * entries;
    while (entries_.size() > capacity_ && merge_oldest()) {
    }
  }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }

  /// Discards all changes and keeps the revision number. O(1).
  void clear() {
    const std::size_t capacity = capacity_;
    const std::uint64_t revision = revision_;
    *this = {};
    set_capacity(capacity);
    revision_ = complete_since_ = exact_since_ = revision;
  }
  /// Stops recording: discards all changes; no revision, not even the current one, is complete until the next clear().
  /// A log that never had a revision has revision() == 0. O(1).
  void stop() {
    clear();
    if (revision_ != 0) exact_since_ = ++complete_since_;
  }
  /// Heap memory in bytes.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return entries_.memory_bytes() + merged_.capacity() * sizeof(entry) + merged_index_.memory_bytes();
  }

 private:
  struct entry {
    std::uint64_t octant;  ///< Morton code
    std::uint64_t mask;
    std::uint64_t revision;  ///< revision of the change; for merged entries, the last of their revisions
  };

  /// A first-in-first-out ring buffer that grows to its maximum size.
  class queue {
   public:
    queue() = default;
    queue(const queue&) = default;
    queue(queue&& other) noexcept
        : ring_{std::exchange(other.ring_, {})}, first_{other.first_}, size_{std::exchange(other.size_, 0)} {}
    queue& operator=(queue other) noexcept {
      std::swap(ring_, other.ring_);
      std::swap(first_, other.first_);
      std::swap(size_, other.size_);
      return *this;
    }
    ~queue() = default;

    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
    [[nodiscard]] const entry& operator[](std::size_t i) const noexcept { return ring_[place(i)]; }
    [[nodiscard]] entry& operator[](std::size_t i) noexcept { return ring_[place(i)]; }
    [[nodiscard]] entry& back() noexcept { return ring_[place(size_ - 1)]; }
    void push_back(const entry& e) {
      if (size_ == ring_.size()) {
        std::vector<entry> longer(std::max<std::size_t>(16, 2 * size_));
        for (std::size_t i = 0; i != size_; ++i) longer[i] = (*this)[i];
        ring_ = std::move(longer);
        first_ = 0;
      }
      ring_[place(size_++)] = e;
    }
    void pop_front() noexcept {
      first_ = place(1);
      --size_;
    }
    void truncate(std::size_t n) noexcept { size_ = n; }
    [[nodiscard]] std::size_t memory_bytes() const noexcept { return ring_.capacity() * sizeof(entry); }

   private:
    [[nodiscard]] std::size_t place(std::size_t i) const noexcept { return (first_ + i) & (ring_.size() - 1); }

    std::vector<entry> ring_;  ///< size is a power of two or zero
    std::size_t first_ = 0;
    std::size_t size_ = 0;
  };

  /// Number of entries with revisions up to `revision`.
  [[nodiscard]] std::size_t first_after(std::uint64_t revision) const noexcept {
    std::size_t low = 0, high = entries_.size();
    while (low != high) {
      const std::size_t middle = low + (high - low) / 2;
      if (entries_[middle].revision <= revision)
        low = middle + 1;
      else
        high = middle;
    }
    return low;
  }

  /// Sorts entries by octant and merges those for the same octant.
  static void unite(std::vector<entry>& entries) {
    std::sort(entries.begin(), entries.end(), [](const entry& a, const entry& b) { return a.octant < b.octant; });
    auto out = entries.begin();
    for (const entry& e : entries) {
      if (out != entries.begin() && (out - 1)->octant == e.octant)
        (out - 1)->mask |= e.mask;
      else
        *out++ = e;
    }
    entries.erase(out, entries.end());
  }
  /// Merges the entries of the current revision by octant, which loses no information.
  void unite_newest() {
    const std::size_t first = first_after(revision_ - 1);
    std::vector<entry> newest;
    newest.reserve(entries_.size() - first);
    for (std::size_t i = first; i != entries_.size(); ++i) newest.push_back(entries_[i]);
    unite(newest);
    for (std::size_t i = 0; i != newest.size(); ++i) entries_[first + i] = newest[i];
    entries_.truncate(first + newest.size());
    limit_ = std::max(2 * capacity_, 2 * entries_.size());
  }
  /// Moves the oldest entry to the merged entries, unless it belongs to the current revision.
  bool merge_oldest() {
    if (entries_.empty() || entries_[0].revision == revision_) return false;
    const entry oldest = entries_[0];
    if (const std::uint32_t i = merged_index_.find(oldest.octant); i != hash_index::none) {
      merged_[i].mask |= oldest.mask;
      merged_[i].revision = oldest.revision;
    } else {
      merged_.push_back(oldest);
      merged_index_.set(oldest.octant, static_cast<std::uint32_t>(merged_.size() - 1));
    }
    exact_since_ = std::max(exact_since_, oldest.revision);
    entries_.pop_front();
    return true;
  }

  queue entries_;              ///< in order of revision
  std::vector<entry> merged_;  ///< one entry per octant
  hash_index merged_index_;
  std::uint64_t revision_ = 0;
  std::uint64_t complete_since_ = 0;
  std::uint64_t exact_since_ = 0;
  std::size_t capacity_ = std::size_t{1} << 18U;
  std::size_t limit_ = 2 * capacity_;  ///< number of entries at which those of the current revision are merged
};

}  // namespace orbis::octree

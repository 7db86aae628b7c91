// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Per-voxel sums of measurements, from which measurements can be removed exactly.
///
/// All sums are integers: the position of a measurement in its voxel in units of 1/1024 of the edge, its colour, and
/// its range in millimetres. Such sums do not depend on the order of addition, and subtraction is exact. The surfaces
/// that depth cameras see are thin, so voxels are stored in bricks of 8^3 voxels, each of which holds sums for its
/// occupied voxels only.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/cloud/detail/voxels/voxel_brick.hpp>
#include <orbis/cloud/detail/voxels/voxel_key.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/hash_index.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud {

namespace detail {

/// Position of a measurement in a grid of bricks.
struct brick_place {
  voxel_key brick;
  std::uint16_t cell;                   ///< x + 8 y + 64 z
  std::array<std::uint16_t, 3> offset;  ///< within the voxel, in 1/1024 of its edge
};

/// Finds the voxel of a point with one conversion to fixed point. Returns false if the point is not finite or more than
/// 2^31 voxels from the origin. `steps_per_metre`: 1024 / voxel edge in metres.
[[nodiscard]] inline bool locate(const vec3& point, double steps_per_metre, brick_place& out) noexcept {
  std::array<double, 3> scaled;
  for (std::size_t a = 0; a != 3; ++a)
    scaled[a] = rounded_product(point[static_cast<Eigen::Index>(a)], steps_per_metre);
  constexpr double end = 0x1p31 * 1024 - 1024;
  if (!(std::abs(scaled[0]) < end && std::abs(scaled[1]) < end && std::abs(scaled[2]) < end)) return false;
  std::uint32_t cell = 0;
  for (std::size_t a = 0; a != 3; ++a) {
    const auto toward_zero = static_cast<std::int64_t>(scaled[a]);
    // std::floor is a function call without SSE4.
    const std::int64_t step = toward_zero - (scaled[a] < static_cast<double>(toward_zero) ? 1 : 0);
    out.brick[a] = static_cast<std::int32_t>(step >> 13);
    out.offset[a] = static_cast<std::uint16_t>(step & 1023);
    cell |= static_cast<std::uint32_t>(step >> 10 & 7) << (3 * a);
  }
  out.cell = static_cast<std::uint16_t>(cell);
  return true;
}

}  // namespace detail

/// A list of measurements to add to or remove from `voxel_sums`, stored as runs of consecutive measurements in the same
/// brick. Reuses its memory.
class voxel_measurements {
 public:
  /// `size`: edge of a voxel, metres. @pre size > 0
  explicit voxel_measurements(double size) : steps_per_metre_{1024.0 / size} { assert(size > 0); }

  void clear() {
    items_.clear();
    runs_.clear();
    without_voxel_ = 0;
  }
  /// Adds a measurement (world frame, metres) and its distance from the sensor in metres. Non-finite measurements, and
  /// those more than 2^31 voxels from the origin, have no voxel; they are counted but not stored.
  void push(const vec3& point, const rgb8& color, float range) {
    detail::brick_place at;
    if (!detail::locate(point, steps_per_metre_, at)) {
      ++without_voxel_;
      return;
    }
    constexpr float longest = 4e6F;  // metres; fits the integer, and exceeds the range of any sensor
    const auto millimetres =
        range > 0 ? static_cast<std::uint32_t>(static_cast<std::int64_t>(1000.0F * std::min(range, longest) + 0.5F))
                  : 0;
    const auto differs = [&](std::size_t a) { return last_[a] ^ at.brick[a]; };
    if ((differs(0) | differs(1) | differs(2)) != 0 || items_.empty()) {
      runs_.push_back({at.brick, static_cast<std::uint32_t>(items_.size())});
      last_ = at.brick;
    }
    items_.push_back({at.cell, at.offset, color, millimetres});
  }
  /// Number of measurements that have a voxel.
  [[nodiscard]] std::size_t size() const noexcept { return items_.size(); }
  [[nodiscard]] std::size_t without_voxel() const noexcept { return without_voxel_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return items_.capacity() * sizeof(detail::voxel_item) + runs_.capacity() * sizeof(run);
  }

 private:
  friend class voxel_sums;
  struct run {
    detail::voxel_key brick;
    std::uint32_t begin;  ///< index of the first item of the run, which ends where the next run begins
  };
  double steps_per_metre_;
  std::vector<detail::voxel_item> items_;
  std::vector<run> runs_;
  detail::voxel_key last_{};  ///< brick of the last run
  std::size_t without_voxel_ = 0;
};

/// The mean of the measurements in each voxel. It depends only on the measurements added and not yet removed, not on
/// their order, the number of threads or earlier measurements. Takes about 50 bytes per voxel.
class voxel_sums {
  [[nodiscard]] auto key_by_number() const {
    return [this](std::uint32_t number) -> const detail::voxel_key& { return bricks_[number].key; };
  }

 public:
  /// `size`: edge of a voxel, metres. @pre size > 0
  explicit voxel_sums(double size) : size_{size} { assert(size > 0); }

  /// Adds measurements. O(n). @pre fewer than 2^22 measurements in a voxel; `finish` has not been called
  template <execution_policy Policy>
  void add(const Policy& policy, std::span<voxel_measurements> parts) {
    apply<true>(policy, parts);
  }
  /// Removes measurements that were added. Frees voxels without measurements and bricks without voxels. O(n). @pre the
  /// measurements were added and have not been removed since; `finish` has not been called
  template <execution_policy Policy>
  void remove(const Policy& policy, std::span<voxel_measurements> parts) {
    apply<false>(policy, parts);
  }

  /// Frees the sums but keeps the set of occupied voxels. O(bricks).
  void finish() {
    finished_ = true;
    for (brick& b : bricks_) b.voxels.drop_sums();
    std::vector<std::uint32_t>{}.swap(touched_);
    std::vector<chained_run>{}.swap(chained_);
  }

  /// Number of occupied voxels.
  [[nodiscard]] std::size_t size() const noexcept { return occupied_; }
  /// Memory in use, bytes.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = bricks_.capacity() * sizeof(brick) + free_.capacity() * sizeof(std::uint32_t) +
                        touched_.capacity() * sizeof(std::uint32_t) + chained_.capacity() * sizeof(chained_run) +
                        index_.memory_bytes();
    for (const brick& b : bricks_) bytes += b.voxels.memory_bytes();
    return bytes;
  }

  /// The order of the voxels in `cloud`: bricks sorted by z, then y, then x; in each brick, its voxels in the same way.
  /// Valid until the next change. O(bricks log bricks).
  class order {
   private:
    friend class voxel_sums;
    std::vector<std::uint32_t> bricks_;  ///< brick indices, in order
    std::vector<std::size_t> first_;     ///< position of each brick's first voxel, indexed by brick
  };
  [[nodiscard]] order in_order() const {
    order out;
    for (std::uint32_t b = 0; b != bricks_.size(); ++b) {
      if (bricks_[b].voxels.size() != 0) out.bricks_.push_back(b);
    }
    std::ranges::sort(out.bricks_, [&](std::uint32_t a, std::uint32_t b) {
      const detail::voxel_key& i = bricks_[a].key;
      const detail::voxel_key& j = bricks_[b].key;
      return std::array{i[2], i[1], i[0]} < std::array{j[2], j[1], j[0]};
    });
    out.first_.resize(bricks_.size());
    std::size_t place = 0;
    for (const std::uint32_t b : out.bricks_) {
      out.first_[b] = place;
      place += bricks_[b].voxels.size();
    }
    return out;
  }

  /// A subset of the voxels, stored for fast look-ups. Valid until the next change.
  class choice {
   public:
    choice() = default;
    /// Looks up one point at a time; fast if most points are in the same brick as the previous one.
    class reader {
     public:
      explicit reader(const choice& of) noexcept : of_{&of}, steps_per_metre_{1024.0 / of.sums_->size_} {}
      /// Returns true if the voxel that contains the point (world frame, metres) was chosen, false if not; empty if the
      /// voxel is not occupied.
      [[nodiscard]] std::optional<bool> find(const vec3& point) {
        detail::brick_place at;
        if (!detail::locate(point, steps_per_metre_, at)) return std::nullopt;
        if (at.brick != brick_ || !asked_) {
          asked_ = true;
          brick_ = at.brick;
          number_ = of_->sums_->index_.find(brick_, of_->sums_->key_by_number());
        }
        if (number_ == none || !of_->sums_->bricks_[number_].voxels.contains(at.cell)) return std::nullopt;
        return (of_->chosen_[number_][at.cell / 64U] >> (at.cell % 64U) & 1U) != 0;
      }

     private:
      const choice* of_;
      double steps_per_metre_;
      bool asked_ = false;
      detail::voxel_key brick_{};  ///< brick of the last point
      std::uint32_t number_ = 0;   ///< index of `brick_`
    };

   private:
    friend class voxel_sums;
    const voxel_sums* sums_ = nullptr;
    std::vector<std::array<std::uint64_t, 8>> chosen_;  ///< indexed by brick; one bit per cell
  };
  /// Creates a subset. `chosen`: for each voxel, in the order of `cloud`, nonzero to choose it. O(voxels + bricks log
  /// bricks).
  [[nodiscard]] choice choose(std::span<const char> chosen) const {
    assert(chosen.size() == occupied_);
    choice out;
    out.sums_ = this;
    out.chosen_.resize(bricks_.size());
    const order places = in_order();
    std::size_t place = 0;
    for (const std::uint32_t b : places.bricks_)
      bricks_[b].voxels.for_each_cell([&](std::uint32_t cell) {
        if (chosen[place++] != 0) out.chosen_[b][cell / 64U] |= std::uint64_t{1} << (cell % 64U);
      });
    return out;
  }

  /// Returns the mean of each voxel's measurements, with their mean colours. O(voxels). @pre `finish` has not been
  /// called
  template <execution_policy Policy>
  [[nodiscard]] point_cloud cloud(const Policy& policy, const order& places, bool with_colors = true) const {
    point_cloud out;
    out.points.resize(occupied_);
    if (with_colors) out.colors.resize(occupied_);
    for_each_voxel(
        policy, places, [&](std::size_t place, const detail::voxel_key& voxel, const detail::voxel_sum& sum) {
          for (std::size_t a = 0; a != 3; ++a) {
            // An offset represents the middle of an interval of 1/1024 of the edge.
            const double within = (sum.offset[a] / static_cast<double>(sum.count) + 0.5) / 1024.0;
            out.points[place][static_cast<Eigen::Index>(a)] = static_cast<float>((voxel[a] + within) * size_);
          }
          const auto channel = [&](std::size_t c) {
            return static_cast<std::uint8_t>((sum.color[c] + sum.count / 2) / sum.count);  // rounded
          };
          if (with_colors) out.colors[place] = {channel(0), channel(1), channel(2)};
        });
    return out;
  }
  /// Returns the mean distance from which each voxel was measured, metres. O(voxels). @pre `finish` has not been called
  template <execution_policy Policy>
  [[nodiscard]] std::vector<float> ranges(const Policy& policy, const order& places) const {
    std::vector<float> out(occupied_);
    for_each_voxel(policy, places, [&](std::size_t place, const detail::voxel_key&, const detail::voxel_sum& sum) {
      out[place] = static_cast<float>(static_cast<double>(sum.range()) / (1000.0 * sum.count));
    });
    return out;
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  struct brick {
    detail::voxel_key key{};
    std::uint32_t first_run = none;  ///< used while measurements are applied
    detail::voxel_brick voxels{};
  };

  template <execution_policy Policy, class F>
  void for_each_voxel(const Policy& policy, const order& places, F&& f) const {
    assert(!finished_);
    for_each_index(policy, places.bricks_.size(), 64, [&](std::size_t i) {
      const brick& b = bricks_[places.bricks_[i]];
      std::size_t place = places.first_[places.bricks_[i]];
      b.voxels.for_each([&](std::uint32_t cell, const detail::voxel_sum& sum) {
        f(place++,
          detail::voxel_key{b.key[0] * 8 + static_cast<std::int32_t>(cell & 7U),
                            b.key[1] * 8 + static_cast<std::int32_t>(cell >> 3U & 7U),
                            b.key[2] * 8 + static_cast<std::int32_t>(cell >> 6U)},
          sum);
      });
    });
  }

  /// Returns the index of the brick with this key; adds the brick if it does not exist.
  std::uint32_t brick_at(const detail::voxel_key& key) {
    const auto number = free_.empty() ? static_cast<std::uint32_t>(bricks_.size()) : free_.back();
    if (const std::uint32_t found = index_.find_or_insert(key, number, key_by_number()); found != number) return found;
    if (free_.empty())
      bricks_.emplace_back();
    else
      free_.pop_back();
    bricks_[number].key = key;
    return number;
  }

  template <bool Add, execution_policy Policy>
  void apply(const Policy& policy, std::span<voxel_measurements> parts) {
    assert(!finished_);
    // Chain the runs of each brick, so that one thread can handle the whole brick.
    std::size_t total = 0;
    for (const auto& part : parts) total += part.runs_.size();
    chained_.clear();
    chained_.reserve(total);
    touched_.clear();
    for (auto& part : parts) {
      for (std::size_t r = 0; r != part.runs_.size(); ++r) {
        const auto& run = part.runs_[r];
        const std::size_t end = r + 1 != part.runs_.size() ? part.runs_[r + 1].begin : part.items_.size();
        std::uint32_t number = 0;
        if constexpr (Add) {
          number = brick_at(run.brick);
        } else {
          number = index_.find(run.brick, key_by_number());
          assert(number != none && "removed without having been added");
          if (number == none) continue;
        }
        std::uint32_t& first = bricks_[number].first_run;
        if (first == none) touched_.push_back(number);
        const std::uint32_t next = std::exchange(first, static_cast<std::uint32_t>(chained_.size()));
        chained_.push_back({{part.items_.data() + run.begin, part.items_.data() + end}, next});
      }
    }
    std::atomic<std::size_t> more{0};  // modulo 2^64, so it can also decrease
    for_each_index(policy, touched_.size(), 8, [&](std::size_t i) {
      brick& b = bricks_[touched_[i]];
      const std::size_t before = b.voxels.size();
      const auto for_each_run = [&](auto&& f) {
        for (std::uint32_t r = b.first_run; r != none; r = chained_[r].next) f(chained_[r].items);
      };
      if constexpr (Add) {
        b.voxels.add(for_each_run);
      } else {
        b.voxels.remove(for_each_run);
      }
      b.first_run = none;
      more.fetch_add(b.voxels.size() - before, std::memory_order_relaxed);
    });
    occupied_ += more.load(std::memory_order_relaxed);
    if constexpr (!Add) {
      for (const std::uint32_t number : touched_) {
        if (bricks_[number].voxels.size() != 0) continue;
        index_.erase(bricks_[number].key, key_by_number());
        bricks_[number].voxels = {};
        free_.push_back(number);
      }
    }
  }

  struct chained_run {
    std::span<const detail::voxel_item> items;
    std::uint32_t next;  ///< next run of the same brick
  };
  double size_;
  bool finished_ = false;  ///< true if the sums were freed
  std::size_t occupied_ = 0;
  std::vector<brick> bricks_;
  std::vector<std::uint32_t> free_;                                ///< indices of unused bricks
  number_index<detail::voxel_key, detail::voxel_key_hash> index_;  ///< brick indices by key
  std::vector<std::uint32_t> touched_;                             ///< scratch memory, reused
  std::vector<chained_run> chained_;
};

}  // namespace orbis::cloud

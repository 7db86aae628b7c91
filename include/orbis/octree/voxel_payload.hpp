// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a voxel can carry beside its log-odds: a mean colour, a label, a count. All of it is integers,
/// so that the same observations in the same order leave the same bits everywhere.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include <orbis/core/image.hpp>

namespace orbis::octree {

/// A payload: plain bytes, which copies of a map can share; its default value is that of a voxel that
/// has none yet.
template <class T>
concept voxel_payload = std::copyable<T> && std::default_initializable<T> && std::is_trivially_copyable_v<T>;

/// The mean of the colours seen; 8 bytes. Exact over the first 257 of them; after that the past counts
/// as 128 observations or more, so that the mean follows the last two hundred or so.
class rgb_mean {
 public:
  void update(const rgb8& color) noexcept {
    if (count_ == full) halve();
    sum_[0] = static_cast<std::uint16_t>(sum_[0] + color.r);
    sum_[1] = static_cast<std::uint16_t>(sum_[1] + color.g);
    sum_[2] = static_cast<std::uint16_t>(sum_[2] + color.b);
    ++count_;
  }
  /// How many observations the mean is of, 257 at most.
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  /// The mean, rounded; black if nothing has been seen.
  [[nodiscard]] rgb8 color() const noexcept {
    const std::uint32_t n = count_ == 0 ? 1U : count_;
    const auto mean = [&](std::uint32_t sum) { return static_cast<std::uint8_t>((sum + n / 2) / n); };
    return {mean(sum_[0]), mean(sum_[1]), mean(sum_[2])};
  }
  friend bool operator==(const rgb_mean&, const rgb_mean&) = default;

 private:
  static constexpr std::uint32_t full = std::numeric_limits<std::uint16_t>::max() / 255;
  void halve() noexcept {
    for (std::uint16_t& s : sum_) s = static_cast<std::uint16_t>((s * (full / 2) + full / 2) / full);
    count_ = full / 2;
  }

  std::array<std::uint16_t, 3> sum_{};
  std::uint16_t count_ = 0;
};

/// The label that most observations agree on, without counting each: if more than half of them say
/// the same, it is that one (as long as the counter does not saturate).
///
/// R. S. Boyer, J S. Moore, "MJRTY: a fast majority vote algorithm", in: Automated Reasoning, 1991.
template <std::unsigned_integral Label = std::uint16_t>
class label_votes {
 public:
  void update(Label seen) noexcept {
    if (votes_ == 0) label_ = seen;
    if (seen != label_)
      --votes_;
    else if (votes_ != std::numeric_limits<Label>::max())
      ++votes_;
  }
  /// The label ahead; empty if there is none.
  [[nodiscard]] std::optional<Label> label() const noexcept {
    return votes_ == 0 ? std::nullopt : std::optional{label_};
  }
  /// By how many votes it is ahead, at least.
  [[nodiscard]] Label votes() const noexcept { return votes_; }
  friend bool operator==(const label_votes&, const label_votes&) = default;

 private:
  Label label_ = 0;
  Label votes_ = 0;
};

/// How often something was seen; stops at 2^32 - 1.
class hit_count {
 public:
  void update() noexcept { count_ += count_ != std::numeric_limits<std::uint32_t>::max() ? 1U : 0U; }
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  friend bool operator==(const hit_count&, const hit_count&) = default;

 private:
  std::uint32_t count_ = 0;
};

}  // namespace orbis::octree

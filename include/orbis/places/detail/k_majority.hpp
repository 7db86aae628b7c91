// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Clustering of binary descriptors; a cluster centre is the bitwise majority of its members.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/bits.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/places/detail/nearest_child.hpp>

namespace orbis::places::detail {

/// Maps bit k of a byte to the lowest bit of byte k.
[[nodiscard]] constexpr std::array<std::uint64_t, 256> make_spread_bits() noexcept {
  std::array<std::uint64_t, 256> table{};
  for (std::size_t byte = 0; byte != 256; ++byte)
    for (std::size_t k = 0; k != 8; ++k) table[byte] |= std::uint64_t{(byte >> k) & 1U} << (8 * k);
  return table;
}
inline constexpr std::array<std::uint64_t, 256> spread_bits = make_spread_bits();

/// Counts, for each bit, the descriptors in which it is set. Uses eight counters per word, which are flushed before any
/// of them can overflow.
template <std::size_t Bits>
class bit_votes {
 public:
  void add(const bit_words<Bits>& descriptor) noexcept {
    if (pending_ == 255) flush();
    ++pending_;
    for (std::size_t w = 0; w != Bits / 64; ++w)
      for (std::size_t b = 0; b != 8; ++b) narrow_[8 * w + b] += spread_bits[(descriptor[w] >> (8 * b)) & 0xffU];
  }
  void add(bit_votes& other) noexcept {
    flush();
    other.flush();
    for (std::size_t i = 0; i != Bits; ++i) ones_[i] += other.ones_[i];
    total_ += other.total_;
  }
  [[nodiscard]] std::uint64_t total() const noexcept { return total_ + pending_; }

  /// The bits that are set in more than half of the descriptors; ties are resolved by the bits of `tie`.
  [[nodiscard]] bit_words<Bits> majority(const bit_words<Bits>& tie) noexcept {
    flush();
    bit_words<Bits> result{};
    for (std::size_t i = 0; i != Bits; ++i) {
      const std::uint64_t twice = 2 * std::uint64_t{ones_[i]};
      const bool set = twice == total_ ? ((tie[i / 64] >> (i % 64)) & 1U) != 0 : twice > total_;
      if (set) result[i / 64] |= std::uint64_t{1} << (i % 64);
    }
    return result;
  }

 private:
  void flush() noexcept {
    for (std::size_t i = 0; i != Bits; ++i)
      ones_[i] += static_cast<std::uint32_t>((narrow_[i / 8] >> (8 * (i % 8))) & 0xffU);
    narrow_ = {};
    total_ += pending_;
    pending_ = 0;
  }

  std::array<std::uint64_t, Bits / 8> narrow_{};
  std::array<std::uint32_t, Bits> ones_{};
  std::uint64_t total_ = 0;
  std::uint32_t pending_ = 0;
};

struct k_majority_options {
  std::uint32_t clusters = 10;  ///< maximum number of clusters; there are fewer if there are fewer distinct descriptors
  int max_iterations = 10;
  std::uint64_t seed = 1;
};

/// Centres, each with at least one member, and the nearest centre of each descriptor (the first on ties).
template <std::size_t Bits>
struct clustering {
  std::vector<bit_words<Bits>> centres;
  std::vector<std::uint16_t> cluster_of;
};

/// Lloyd's algorithm under the Hamming distance, for which the median is the bitwise majority. All sums are integers,
/// so neither the number of threads nor the order affects the result.
template <std::size_t Bits>
class k_majority_solver {
  static constexpr std::size_t grain = 4096;
  using words = bit_words<Bits>;

 public:
  k_majority_solver(std::span<const words> descriptors, const k_majority_options& options)
      : descriptors_{descriptors}, options_{options}, random_{options.seed} {}

  template <execution_policy Policy>
  [[nodiscard]] clustering<Bits> solve(const Policy& policy) {
    if (descriptors_.empty()) return {};
    choose_seeds(policy);
    result_.cluster_of.assign(descriptors_.size(), 0);
    std::vector<std::uint16_t> before;
    for (int iteration = 0;; ++iteration) {
      before.swap(result_.cluster_of);
      result_.cluster_of.resize(descriptors_.size());
      assign(policy);
      // The last step is an assignment: every descriptor belongs to the nearest final centre.
      if (iteration >= options_.max_iterations || (iteration != 0 && before == result_.cluster_of)) break;
      move_centres(policy);
    }
    drop_empty();
    return std::move(result_);
  }

 private:
  /// Selects the seeds: each is a descriptor drawn with a probability proportional to its squared distance from the
  /// nearest previous seed. D. Arthur, S. Vassilvitskii, "k-means++: the advantages of careful seeding", SODA 2007.
  template <execution_policy Policy>
  void choose_seeds(const Policy& policy) {
    const std::size_t n = descriptors_.size();
    std::vector<std::uint32_t> nearest(n, ~std::uint32_t{0});
    std::vector<std::uint64_t> sums((n + grain - 1) / grain);
    std::size_t chosen = random_.below(static_cast<std::uint32_t>(n));
    for (;;) {
      result_.centres.push_back(descriptors_[chosen]);
      if (result_.centres.size() == options_.clusters) return;
      const words centre = result_.centres.back();
      for_each_chunk(policy, n, grain, [&](std::size_t begin, std::size_t end) {
        std::uint64_t sum = 0;
        for (std::size_t i = begin; i != end; ++i) {
          const std::uint32_t distance = hamming_distance(descriptors_[i], centre);
          nearest[i] = std::min(nearest[i], distance * distance);
          sum += nearest[i];
        }
        sums[begin / grain] = sum;
      });
      std::uint64_t total = 0;
      for (const std::uint64_t sum : sums) total += sum;
      if (total == 0) return;  // all descriptors equal a seed
      std::uint64_t left = static_cast<std::uint64_t>(random_.uniform() * static_cast<double>(total));
      left = std::min(left, total - 1);
      std::size_t chunk = 0;
      while (left >= sums[chunk]) left -= sums[chunk++];
      for (chosen = chunk * grain; left >= nearest[chosen]; ++chosen) left -= nearest[chosen];
    }
  }

  template <execution_policy Policy>
  void assign(const Policy& policy) {
    for_each_chunk(policy, descriptors_.size(), grain, [&](std::size_t begin, std::size_t end) {
      assign_nearest<Bits>({result_.centres.data(), static_cast<std::uint32_t>(result_.centres.size()),
                            descriptors_.data() + begin, end - begin, result_.cluster_of.data() + begin});
    });
  }

  template <execution_policy Policy>
  void move_centres(const Policy& policy) {
    const std::size_t k = result_.centres.size();
    // Use a few long pieces, because each piece needs separate counters for every cluster.
    const std::size_t pieces = std::clamp<std::size_t>(descriptors_.size() / (16 * k * grain / 8 + 1), 1, 16);
    const std::size_t piece = (descriptors_.size() + pieces - 1) / pieces;
    std::vector<bit_votes<Bits>> votes(pieces * k);
    for_each_chunk(policy, descriptors_.size(), piece, [&](std::size_t begin, std::size_t end) {
      bit_votes<Bits>* const of_piece = votes.data() + begin / piece * k;
      for (std::size_t i = begin; i != end; ++i) of_piece[result_.cluster_of[i]].add(descriptors_[i]);
    });
    for (std::size_t c = 0; c != k; ++c) {
      for (std::size_t p = 1; p != pieces; ++p) votes[c].add(votes[p * k + c]);
      // A centre without members is unchanged; it may gain members later.
      if (votes[c].total() != 0) result_.centres[c] = votes[c].majority(result_.centres[c]);
    }
  }

  void drop_empty() {
    std::vector<std::uint32_t> members(result_.centres.size());
    for (const std::uint16_t c : result_.cluster_of) ++members[c];
    std::vector<std::uint16_t> renamed(members.size());
    std::size_t kept = 0;
    for (std::size_t c = 0; c != members.size(); ++c) {
      renamed[c] = static_cast<std::uint16_t>(kept);
      if (members[c] != 0) result_.centres[kept++] = result_.centres[c];
    }
    result_.centres.resize(kept);
    for (std::uint16_t& c : result_.cluster_of) c = renamed[c];
  }

  std::span<const words> descriptors_;
  k_majority_options options_;
  random_bits random_;
  clustering<Bits> result_;
};

/// Clusters `descriptors`. The same seed gives the same clusters under every policy. O(descriptors x clusters x
/// iterations). The result is empty if the input is.
/// Source: C. Grana, D. Borghesani, M. Manfredi, R. Cucchiara, "A fast approach for integrating ORB descriptors in
/// the bag of words model", SPIE 2013.
/// @pre 0 < clusters < 65536, max_iterations >= 0, fewer than 2^32 descriptors
template <std::size_t Bits, execution_policy Policy>
[[nodiscard]] clustering<Bits> k_majority(const Policy& policy, std::span<const bit_words<Bits>> descriptors,
                                          const k_majority_options& options = {}) {
  assert(options.clusters > 0 && options.clusters < 65536 && options.max_iterations >= 0);
  return k_majority_solver<Bits>{descriptors, options}.solve(policy);
}

}  // namespace orbis::places::detail

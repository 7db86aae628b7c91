// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of train.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>

#include <orbis/core/random.hpp>
#include <orbis/places/detail/k_majority.hpp>
#include <orbis/places/train.hpp>
#include <orbis/places/vocabulary-inl.hpp>
#include <orbis/places/vocabulary_tree.hpp>

namespace orbis::places {

namespace detail {

/// Trains level by level; the descriptors of each node are contiguous and in the order of their images.
template <std::size_t Bits>
class vocabulary_trainer {
  using words = bit_words<Bits>;
  struct segment {
    std::size_t begin, end;
    std::uint64_t seed;
    [[nodiscard]] std::size_t size() const noexcept { return end - begin; }
  };
  /// Nodes with more descriptors are split one after the other, each by all threads; the others are split in parallel.
  static constexpr std::size_t large = 65536;

 public:
  vocabulary_trainer(training_data<Bits> data, const training_options& options, progress report)
      : options_{options},
        report_{report},
        descriptors_{std::move(data.descriptors)},
        images_{std::move(data.images)},
        image_count_{data.image_count} {}

  template <execution_policy Policy>
  [[nodiscard]] result<basic_vocabulary<Bits>> train(const Policy& policy) {
    if (descriptors_.empty()) return fail(errc::no_data, "images", "there are no descriptors");
    if (descriptors_.size() > std::numeric_limits<std::uint32_t>::max() / 2)
      return fail(errc::invalid_argument, "images", "more than 2^31 descriptors");
    const bool by_rarity = options_.weighting == weighting::tf_idf || options_.weighting == weighting::idf;
    if (by_rarity && image_count_ < 2)
      return fail(errc::invalid_argument, "images", "idf weighting needs at least two images");
    total_ = descriptors_.size() * options_.depth;
    std::vector<segment> level{{0, descriptors_.size(), mix64(options_.seed)}};
    for (std::uint32_t depth = 0; depth != options_.depth && !level.empty(); ++depth) {
      auto next = split_level(policy, level);
      if (!next) return fail(next.error());
      level = *std::move(next);
    }
    for (const segment& leaf : level) end_at(leaf);
    if (!report_(total_, total_)) return fail(errc::cancelled, "", "training was cancelled");
    return finish();
  }

 private:
  /// Splits the nodes of a level into the nodes of the next level.
  template <execution_policy Policy>
  [[nodiscard]] result<std::vector<segment>> split_level(const Policy& policy, const std::vector<segment>& level) {
    std::vector<clustering<Bits>> parts(level.size());
    constexpr std::size_t side_by_side = 512;
    for (std::size_t i = 0; i != level.size();) {
      const std::size_t first = i;
      if (level[i].size() > large) {
        parts[i] = split(policy, level[i]);
        ++i;
      } else {
        while (i != level.size() && i - first != side_by_side && level[i].size() <= large) ++i;
        for_each_index(policy, i - first, 1, [&](std::size_t k) { parts[first + k] = split(seq, level[first + k]); });
      }
      for (std::size_t k = first; k != i; ++k) done_ += level[k].size();
      if (!report_(std::min(done_, total_), total_)) return fail(errc::cancelled, "", "training was cancelled");
    }
    std::vector<segment> next;
    for (std::size_t i = 0; i != level.size(); ++i) {
      const clustering<Bits>& part = parts[i];
      child_counts_.push_back(static_cast<std::uint16_t>(part.centres.size()));
      if (part.centres.empty()) {
        leaves_.push_back({child_counts_.size() - 1, level[i]});
        continue;
      }
      centres_.insert(centres_.end(), part.centres.begin(), part.centres.end());
      order_by_cluster(level[i], part, next);
    }
    return next;
  }

  /// Clusters the descriptors of a node; returns an empty result if all are equal.
  template <execution_policy Policy>
  [[nodiscard]] clustering<Bits> split(const Policy& policy, const segment& node) const {
    const auto part = std::span{descriptors_}.subspan(node.begin, node.size());
    if (std::ranges::adjacent_find(part, std::ranges::not_equal_to{}) == part.end()) return {};
    return k_majority<Bits>(policy, part, {options_.branching, options_.max_iterations, node.seed});
  }

  void order_by_cluster(const segment& node, const clustering<Bits>& part, std::vector<segment>& next) {
    std::vector<std::size_t> begin(part.centres.size() + 1, 0);
    for (const std::uint16_t c : part.cluster_of) ++begin[c + 1U];
    for (std::size_t c = 1; c != begin.size(); ++c) begin[c] += begin[c - 1];
    for (std::size_t c = 0; c != part.centres.size(); ++c)
      next.push_back({node.begin + begin[c], node.begin + begin[c + 1], mix64(node.seed ^ mix64(c + 1))});
    std::vector<words> descriptors(node.size());
    std::vector<std::uint32_t> images(node.size());
    for (std::size_t i = 0; i != node.size(); ++i) {
      const std::size_t to = begin[part.cluster_of[i]]++;
      descriptors[to] = descriptors_[node.begin + i];
      images[to] = images_[node.begin + i];
    }
    std::ranges::copy(descriptors, descriptors_.begin() + static_cast<std::ptrdiff_t>(node.begin));
    std::ranges::copy(images, images_.begin() + static_cast<std::ptrdiff_t>(node.begin));
  }

  void end_at(const segment& leaf) {
    child_counts_.push_back(0);
    leaves_.push_back({child_counts_.size() - 1, leaf});
  }

  [[nodiscard]] result<basic_vocabulary<Bits>> finish() {
    vocabulary_tree<Bits> tree;
    tree.resize(static_cast<std::uint32_t>(child_counts_.size()));
    tree.weights_are = options_.weighting;
    std::ranges::copy(centres_, tree.descriptors.values().begin());
    for (const auto& [node, part] : leaves_) tree.weights.push_back(word_weight(part));  // in ascending order of node
    while (!child_counts_.empty() && child_counts_.back() == 0) child_counts_.pop_back();
    if (std::string problem = connect_tree(tree, child_counts_); !problem.empty())
      return fail(errc::degenerate, "", std::move(problem));
    return basic_vocabulary<Bits>{std::move(tree)};
  }

  /// The logarithm of the number of images divided by the number of images that contain the word: K. Sparck Jones, "A
  /// statistical interpretation of term specificity and its application in retrieval", 1972.
  [[nodiscard]] float word_weight(const segment& leaf) const {
    if (options_.weighting == weighting::tf || options_.weighting == weighting::binary) return 1.0F;
    std::size_t with = 0;
    for (std::size_t i = leaf.begin; i != leaf.end; ++i)
      with += i == leaf.begin || images_[i] != images_[i - 1] ? 1 : 0;
    return static_cast<float>(std::log(static_cast<double>(image_count_) / static_cast<double>(with)));
  }

  training_options options_;
  progress report_;
  std::vector<words> descriptors_;
  std::vector<std::uint32_t> images_;  // image index of each descriptor
  std::uint32_t image_count_ = 0;
  std::vector<std::uint16_t> child_counts_;  // number of children of each node
  std::vector<words> centres_;               // centre of each node except the root
  struct ended {
    std::size_t node;
    segment part;
  };
  std::vector<ended> leaves_;
  std::size_t done_ = 0, total_ = 0;
};

template <std::size_t Bits, execution_policy Policy>
result<basic_vocabulary<Bits>> train_by(const Policy& policy, training_data<Bits> data, const training_options& options,
                                        const progress& report) {
  return vocabulary_trainer<Bits>{std::move(data), options, report}.train(policy);
}

}  // namespace detail

}  // namespace orbis::places

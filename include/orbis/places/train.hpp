// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Trains a vocabulary from the descriptors of images.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/bits.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/result.hpp>
#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/detail/k_majority.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/places/vocabulary_tree.hpp>

namespace orbis::places {

/// The shape of the vocabulary, its weights and the effort of training.
struct training_options {
  std::uint32_t branching = 10;  ///< children of a node, at most; from 2 to 65535
  std::uint32_t depth = 4;       ///< levels below the root, at least 1; branching^depth is the most words there can be
  places::weighting weighting = places::weighting::tf_idf;
  std::uint64_t seed = 1;
  int max_iterations = 10;  ///< of each clustering
};

/// Images, as the ranges of their descriptors.
template <class R>
concept training_images = std::ranges::forward_range<R> && bit_string_range<std::ranges::range_value_t<R>>;

namespace detail {

/// Level after level; each node's descriptors lie side by side, in the order of their images.
template <std::size_t Bits>
class vocabulary_trainer {
  using words = bit_words<Bits>;
  struct segment {
    std::size_t begin, end;
    std::uint64_t seed;
    [[nodiscard]] std::size_t size() const noexcept { return end - begin; }
  };
  /// Nodes of more descriptors are split one after the other by all threads, the others side by side.
  static constexpr std::size_t large = 65536;

 public:
  vocabulary_trainer(const training_options& options, progress report) : options_{options}, report_{report} {}

  template <class Image>
  void add_image(const Image& image) {
    for (const auto& descriptor : image) {
      descriptors_.push_back(words_of(descriptor));
      images_.push_back(image_count_);
    }
    ++image_count_;
  }

  template <execution_policy Policy>
  [[nodiscard]] result<basic_vocabulary<Bits>> train(const Policy& policy) {
    if (descriptors_.empty()) return fail(errc::no_data, "images", "there are no descriptors to learn from");
    if (descriptors_.size() > std::numeric_limits<std::uint32_t>::max() / 2)
      return fail(errc::invalid_argument, "images", "more than 2^31 descriptors");
    const bool by_rarity = options_.weighting == weighting::tf_idf || options_.weighting == weighting::idf;
    if (by_rarity && image_count_ < 2)
      return fail(errc::invalid_argument, "images", "how rare a word is among images takes at least two of them");
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
  /// Splits the nodes of a level into those of the next.
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

  /// Nothing where all descriptors are the same.
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
    for (const auto& [node, part] : leaves_) tree.weights.push_back(weight_of(part));  // by ascending node
    while (!child_counts_.empty() && child_counts_.back() == 0) child_counts_.pop_back();
    if (std::string problem = connect_tree(tree, child_counts_); !problem.empty())
      return fail(errc::degenerate, "", std::move(problem));
    return basic_vocabulary<Bits>{std::move(tree)};
  }

  /// The logarithm of the number of images over that of those in which the word occurs: K. Sparck Jones, "A
  /// statistical interpretation of term specificity and its application in retrieval", 1972.
  [[nodiscard]] float weight_of(const segment& leaf) const {
    if (options_.weighting == weighting::tf || options_.weighting == weighting::binary) return 1.0F;
    std::size_t with = 0;
    for (std::size_t i = leaf.begin; i != leaf.end; ++i)
      with += i == leaf.begin || images_[i] != images_[i - 1] ? 1 : 0;
    return static_cast<float>(std::log(static_cast<double>(image_count_) / static_cast<double>(with)));
  }

  training_options options_;
  progress report_;
  std::vector<words> descriptors_;
  std::vector<std::uint32_t> images_;  // of the descriptors
  std::uint32_t image_count_ = 0;
  std::vector<std::uint16_t> child_counts_;  // of the nodes
  std::vector<words> centres_;               // of the nodes but the root
  struct ended {
    std::size_t node;
    segment part;
  };
  std::vector<ended> leaves_;
  std::size_t done_ = 0, total_ = 0;
};

}  // namespace detail

/// Learns a vocabulary from the descriptors of images that should show what there is to see, each no more than a few
/// times. The same seed gives the same vocabulary under every policy. A node whose descriptors are all the same is not
/// split. O(descriptors x depth x branching x iterations) time; memory for two copies of the descriptors.
/// `report` counts descriptors times levels.
///
/// Errors: no_data, invalid_argument (weights by rarity among fewer than two images), cancelled.
/// @pre 2 <= branching < 65536, depth >= 1, max_iterations >= 0
template <execution_policy Policy, training_images Images>
[[nodiscard]] auto train(const Policy& policy, const Images& images, const training_options& options = {},
                         progress report = {}) {
  using descriptor = std::ranges::range_value_t<std::ranges::range_value_t<Images>>;
  assert(options.branching >= 2 && options.branching < 65536 && options.depth >= 1 && options.max_iterations >= 0);
  detail::vocabulary_trainer<8 * sizeof(descriptor)> trainer{options, report};
  for (const auto& image : images) trainer.add_image(image);
  return trainer.train(policy);
}

}  // namespace orbis::places

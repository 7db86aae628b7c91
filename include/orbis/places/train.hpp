// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Training of a vocabulary on the descriptors of images.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <ranges>
#include <utility>
#include <vector>

#include <orbis/core/bits.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>
#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/vocabulary.hpp>

namespace orbis::places {

/// The shape of the vocabulary, its weighting, and the training effort.
struct training_options {
  std::uint32_t branching = 10;  ///< maximum number of children of a node; from 2 to 65535
  std::uint32_t depth = 4;       ///< levels below the root, at least 1; branching^depth is the maximum number of words
  places::weighting weighting = places::weighting::tf_idf;
  std::uint64_t seed = 1;
  int max_iterations = 10;  ///< maximum number of iterations of each clustering
};

/// A range of images, each a range of descriptors.
template <class R>
concept training_images = std::ranges::forward_range<R> && bit_string_range<std::ranges::range_value_t<R>>;

namespace detail {

/// The descriptors of images, concatenated.
template <std::size_t Bits>
struct training_data {
  std::vector<bit_words<Bits>> descriptors;
  std::vector<std::uint32_t> images;  ///< the image of each descriptor
  std::uint32_t image_count = 0;
};

/// Implementation of `train`, independent of the image type.
template <std::size_t Bits, execution_policy Policy>
[[nodiscard]] result<basic_vocabulary<Bits>> train_by(const Policy& policy, training_data<Bits> data,
                                                      const training_options& options, const progress& report);

}  // namespace detail

/// Trains a vocabulary on the descriptors of representative images that show each part of the environment at most a few
/// times. The same seed gives the same vocabulary under every policy. A node whose descriptors are all equal is not
/// split. O(descriptors x depth x branching x iterations) time; memory for two copies of the descriptors. The progress
/// passed to `report` counts descriptors times levels.
///
/// Errors: no_data, invalid_argument (idf weighting with fewer than two images), cancelled. The library orbis::compiled
/// contains the function for descriptors of 256 bits with `seq` and `par`; for other cases, include train-inl.hpp.
/// @pre 2 <= branching < 65536, depth >= 1, max_iterations >= 0
template <execution_policy Policy, training_images Images>
[[nodiscard]] auto train(const Policy& policy, const Images& images, const training_options& options = {},
                         progress report = {}) {
  using descriptor = std::ranges::range_value_t<std::ranges::range_value_t<Images>>;
  assert(options.branching >= 2 && options.branching < 65536 && options.depth >= 1 && options.max_iterations >= 0);
  detail::training_data<8 * sizeof(descriptor)> data;
  for (const auto& image : images) {
    for (const auto& d : image) {
      data.descriptors.push_back(as_words(d));
      data.images.push_back(data.image_count);
    }
    ++data.image_count;
  }
  return detail::train_by(policy, std::move(data), options, report);
}

}  // namespace orbis::places

#ifndef ORBIS_COMPILED
#include <orbis/places/train-inl.hpp>
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An inverted index: from words to the images that contain them.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/places/bag_of_words.hpp>

namespace orbis::places {

/// For each word, the indices of the images that contain it, unordered. Unused words cost four bytes; lists release
/// unneeded memory, so memory does not grow while images are erased as fast as they are added.
class inverted_index {
  static constexpr std::uint32_t nothing = ~std::uint32_t{0};

 public:
  /// @pre `image` is not in the index
  void add(std::uint32_t image, const bag_of_words& bag) {
    if (!bag.empty() && bag.words.back().word >= list_of_.size())
      list_of_.resize(std::size_t{bag.words.back().word} + 1, nothing);
    for (const word_value& w : bag.words) {
      std::uint32_t& list = list_of_[w.word];
      if (list == nothing) list = take_list();
      lists_[list].push_back(image);
    }
  }

  /// @pre `image` was added with this bag
  void erase(std::uint32_t image, const bag_of_words& bag) {
    for (const word_value& w : bag.words) {
      std::vector<std::uint32_t>& list = lists_[list_of_[w.word]];
      const auto at = std::find(list.begin(), list.end(), image);
      assert(at != list.end());
      *at = list.back();
      list.pop_back();
      if (list.empty()) {
        list = {};
        unused_.push_back(std::exchange(list_of_[w.word], nothing));
      } else if (list.capacity() > 4 * list.size()) {
        std::vector<std::uint32_t> shorter;
        shorter.reserve(2 * list.size());
        shorter.assign(list.begin(), list.end());
        list.swap(shorter);
      }
    }
  }

  void clear() noexcept {
    list_of_.clear();
    lists_.clear();
    unused_.clear();
  }

  /// The images that contain the word.
  [[nodiscard]] std::span<const std::uint32_t> images_with(std::uint32_t word) const noexcept {
    if (word >= list_of_.size() || list_of_[word] == nothing) return {};
    return lists_[list_of_[word]];
  }

  /// Memory in bytes. O(words).
  [[nodiscard]] std::size_t memory() const noexcept {
    std::size_t bytes = (list_of_.capacity() + unused_.capacity()) * sizeof(std::uint32_t) +
                        lists_.capacity() * sizeof(std::vector<std::uint32_t>);
    for (const auto& list : lists_) bytes += list.capacity() * sizeof(std::uint32_t);
    return bytes;
  }

 private:
  [[nodiscard]] std::uint32_t take_list() {
    if (unused_.empty()) {
      lists_.emplace_back();
      return static_cast<std::uint32_t>(lists_.size() - 1);
    }
    const std::uint32_t taken = unused_.back();
    unused_.pop_back();
    return taken;
  }

  std::vector<std::uint32_t> list_of_;  // index of each word's list
  std::vector<std::vector<std::uint32_t>> lists_;
  std::vector<std::uint32_t> unused_;  // free lists
};

}  // namespace orbis::places

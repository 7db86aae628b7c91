// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Place recognition: finds keyframes whose appearance is similar to that of an image.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/inline.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/default_vocabulary.hpp>
#include <orbis/places/keyframe_database.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/slam/ids.hpp>

namespace orbis::slam {

/// A database of the appearance of keyframes, for descriptors of type `D`.
/// - `describe(features)`: returns the signature of an image. Callable at any time, from any thread.
/// - `add`, `erase`, `rename`: change the keyframes in the database; return false if that is impossible.
/// - `similar(signature, count, exclude, neighbors)`: returns at most `count` keyframes, the most similar first,
/// excluding those for which `exclude(id)` is true. `neighbors(id)` returns keyframes that observe the same place, of
/// which the result need contain only one. The same sequence of changes gives the same results.
template <class P, class D>
concept place_recognizer = std::movable<P> &&
    requires(P& places, const P& known, const features::basic_features<D>& seen,
             const typename P::signature& bow_vector, map_keyframe k, std::size_t count, bool (*exclude)(map_keyframe),
             std::vector<map_keyframe> (*neighbors)(map_keyframe)) {
  { known.describe(seen) } -> std::convertible_to<typename P::signature>;
  { places.add(k, bow_vector) } -> std::same_as<bool>;
  { places.erase(k) } -> std::same_as<bool>;
  { places.rename(k, k) } -> std::same_as<bool>;
  { places.similar(bow_vector, count, exclude, neighbors) } -> std::convertible_to<std::vector<map_keyframe>>;
};

/// Place recognition by bags of words with a vocabulary tree (see `orbis/places.hpp`), for ORB descriptors.
class bag_of_words_places {
 public:
  using signature = places::bag_of_words;

  /// Uses the built-in vocabulary.
  ORBIS_LAZY bag_of_words_places() : bag_of_words_places(places::default_vocabulary()) {}
  explicit bag_of_words_places(places::vocabulary words) : words_{std::move(words)} {}
  bag_of_words_places(places::vocabulary words, const places::query_options& options)
      : words_{std::move(words)}, options_{options} {}

  [[nodiscard]] const places::vocabulary& vocabulary() const noexcept { return words_; }
  /// The number of keyframes.
  [[nodiscard]] std::size_t size() const noexcept { return database_.size(); }

  /// Returns the bag of words of an image.
  ORBIS_LAZY [[nodiscard]] signature describe(const features::features& f) const {
    return words_.transform(f.descriptors);
  }

  /// Adds a keyframe. Returns false if the keyframe is already in the database.
  ORBIS_LAZY bool add(map_keyframe k, const signature& bow_vector) { return database_.add(packed(k), bow_vector); }
  /// Erases a keyframe. Returns false if the keyframe is not in the database.
  ORBIS_LAZY bool erase(map_keyframe k) { return database_.erase(packed(k)); }
  /// Changes the id of a keyframe. Returns false if `from` is not in the database, or if `to` already is.
  ORBIS_LAZY bool rename(map_keyframe from, map_keyframe to) { return database_.rename(packed(from), packed(to)); }

  /// Returns at most `count` keyframes with similar bags of words, the most similar first (see `place_recognizer`).
  template <std::predicate<map_keyframe> Exclude, std::invocable<map_keyframe> Neighbors>
  [[nodiscard]] std::vector<map_keyframe> similar(const signature& bow_vector, std::size_t count, Exclude&& exclude,
                                                  Neighbors&& neighbors) {
    std::vector<std::uint64_t> around;
    database_.query(
        bow_vector, found_, memory_, options_, [&](std::uint64_t k) { return exclude(unpacked(k)); },
        [&](std::uint64_t k) -> const std::vector<std::uint64_t>& {
          around.clear();
          for (const map_keyframe& n : neighbors(unpacked(k))) around.push_back(packed(n));
          return around;
        });
    std::vector<map_keyframe> best;
    for (std::size_t i = 0; i != std::min(count, found_.size()); ++i) best.push_back(unpacked(found_[i].id));
    return best;
  }

 private:
  using database = places::basic_keyframe_database<std::uint64_t>;
  [[nodiscard]] static std::uint64_t packed(map_keyframe k) {
    return std::uint64_t{k.map.value()} << 32 | k.keyframe.value();
  }
  [[nodiscard]] static map_keyframe unpacked(std::uint64_t k) {
    return {static_cast<std::uint32_t>(k >> 32), static_cast<std::uint32_t>(k & no_id)};
  }

  places::vocabulary words_;
  places::query_options options_;
  database database_;
  database::workspace memory_;
  std::vector<database::candidate> found_;
};

}  // namespace orbis::slam

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which keyframes look like an image: what finds them, and how it is done by default.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/features/descriptor.hpp>
#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/default_vocabulary.hpp>
#include <orbis/places/keyframe_database.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/slam/ids.hpp>

namespace orbis::slam {

/// Remembers keyframes by their looks. `describe` makes of an image's features what is remembered and asked for: it
/// may be called at any time, from any thread. `similar` names at most so many keyframes, the likeliest first: not
/// those for which `exclude` is true, and not several of one place, where `neighbors` tells which keyframes show the
/// same. The same additions and removals give the same answers.
template <class P>
concept place_recognizer = std::movable<P> &&
    requires(P& places, const P& known, const features::features& seen, const typename P::signature& bow_vector,
             map_keyframe k, std::size_t count, bool (*exclude)(map_keyframe),
             std::vector<map_keyframe> (*neighbors)(map_keyframe)) {
  { known.describe(seen) } -> std::convertible_to<typename P::signature>;
  { places.add(k, bow_vector) } -> std::same_as<bool>;
  { places.erase(k) } -> std::same_as<bool>;
  { places.rename(k, k) } -> std::same_as<bool>;
  { places.similar(bow_vector, count, exclude, neighbors) } -> std::convertible_to<std::vector<map_keyframe>>;
};

/// By the words of a vocabulary tree; see orbis/places.hpp. Without a vocabulary of the caller's, the built-in one.
class bag_of_words_places {
 public:
  using signature = places::bag_of_words;

  bag_of_words_places() : bag_of_words_places(places::default_vocabulary()) {}
  explicit bag_of_words_places(places::vocabulary words) : words_{std::move(words)} {}
  bag_of_words_places(places::vocabulary words, const places::query_options& options)
      : words_{std::move(words)}, options_{options} {}

  [[nodiscard]] const places::vocabulary& vocabulary() const noexcept { return words_; }
  [[nodiscard]] std::size_t size() const noexcept { return seen_.size(); }

  [[nodiscard]] signature describe(const features::features& f) const { return words_.transform(f.descriptors); }

  /// False if it is known already.
  bool add(map_keyframe k, const signature& bow_vector) { return seen_.add(packed(k), bow_vector); }
  /// False if it is not known.
  bool erase(map_keyframe k) { return seen_.erase(packed(k)); }
  /// A keyframe has another name now. False if it is not known by the old one, or another is by the new one.
  bool rename(map_keyframe from, map_keyframe to) {
    if (!seen_.contains(packed(from)) || seen_.contains(packed(to))) return false;
    const signature bow_vector = seen_.bag(packed(from));
    seen_.erase(packed(from));
    return seen_.add(packed(to), bow_vector);
  }

  template <std::predicate<map_keyframe> Exclude, std::invocable<map_keyframe> Neighbors>
  [[nodiscard]] std::vector<map_keyframe> similar(const signature& bow_vector, std::size_t count, Exclude&& exclude,
                                                  Neighbors&& neighbors) {
    std::vector<std::uint64_t> around;
    seen_.query(
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
  [[nodiscard]] static std::uint64_t packed(map_keyframe k) { return std::uint64_t{k.map} << 32 | k.keyframe; }
  [[nodiscard]] static map_keyframe unpacked(std::uint64_t k) {
    return {static_cast<map_id>(k >> 32), static_cast<keyframe_id>(k & no_id)};
  }

  places::vocabulary words_;
  places::query_options options_;
  database seen_;
  database::workspace memory_;
  std::vector<database::candidate> found_;
};

}  // namespace orbis::slam

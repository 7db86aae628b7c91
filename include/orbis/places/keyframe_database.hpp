// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finds keyframes that may show the same place as an image, based on their visual words.
#pragma once

#include <algorithm>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <ranges>
#include <span>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/inverted_index.hpp>

namespace orbis::places {

/// The id of a keyframe: any ordered, hashable value.
template <class Id>
concept keyframe_id = std::totally_ordered<Id> && std::copyable<Id> && std::default_initializable<Id> &&
    requires(const Id& id) {
  { std::hash<Id>{}(id) } -> std::convertible_to<std::size_t>;
};

/// Acceptance criteria of a query.
struct query_options {
  double shared_words = 0.8;  ///< the number of shared words must exceed this fraction of the largest number
  double min_score = 0.0;     ///< minimum score
  double group_score = 0.75;  ///< the score sum of a group must exceed this fraction of the best group's
};

/// A keyframe that may show the same place as the image.
template <class Id>
struct place_candidate {
  Id id{};
  std::uint32_t shared_words = 0;
  double score = 0.0;
  double group_score = 0.0;  ///< sum of the scores in its group
  friend bool operator==(const place_candidate&, const place_candidate&) = default;
};

/// Reusable memory for queries; its size is proportional to the largest numbers of keyframes and candidates so far.
template <class Id>
struct query_workspace {
  std::vector<std::uint32_t> shared;   ///< number of shared words, indexed by slot
  std::vector<std::uint32_t> touched;  ///< slots of keyframes that share a word
  std::vector<double> scores;          ///< scores indexed by slot, for the keyframes scored in the current query
  std::vector<std::uint32_t> scored;
  std::vector<place_candidate<Id>> groups;
};

/// Default callables for queries: exclude no keyframes, and return no neighbours.
struct none_excluded {
  template <class Id>
  [[nodiscard]] constexpr bool operator()(const Id&) const noexcept {
    return false;
  }
};
template <class Id>
struct no_neighbors {
  [[nodiscard]] std::span<const Id> operator()(const Id&) const noexcept { return {}; }
};

/// Keyframes and their bags of words, with an inverted index. The caller chooses the ids. Results depend only on the
/// contents, not on the order in which keyframes were added and erased. Concurrent queries on a const object are
/// allowed, each with its own workspace; adding and erasing need exclusive access.
///
/// Source of the criteria: R. Mur-Artal, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// IEEE T-RO 2015, sections III.E and VII.A.
template <keyframe_id Id = std::uint32_t>
class basic_keyframe_database {
 public:
  using id_type = Id;
  using candidate = place_candidate<Id>;
  using workspace = query_workspace<Id>;

  [[nodiscard]] std::size_t size() const noexcept { return slots_.size(); }
  [[nodiscard]] bool empty() const noexcept { return slots_.empty(); }
  [[nodiscard]] bool contains(const Id& id) const { return slots_.contains(id); }
  /// The bag of a keyframe. @pre contains(id)
  [[nodiscard]] const bag_of_words& bag(const Id& id) const {
    const auto at = slots_.find(id);
    assert(at != slots_.end());
    return keyframes_[at->second].bag;
  }

  /// Adds a keyframe; returns false, without changes, if the id is in use. O(words).
  /// @pre the bag is normalised and uses the same vocabulary as all other bags
  bool add(const Id& id, const bag_of_words& bag) {
    const bool reuse = !free_.empty();
    const auto slot = reuse ? free_.back() : static_cast<std::uint32_t>(keyframes_.size());
    if (!slots_.try_emplace(id, slot).second) return false;
    if (reuse) {
      free_.pop_back();
    } else {
      keyframes_.emplace_back();
    }
    keyframes_[slot].id = id;
    keyframes_[slot].bag.words.assign(bag.words.begin(), bag.words.end());
    index_.add(slot, bag);
    return true;
  }

  /// Erases a keyframe; returns false if the id is unknown. O(keyframes that share its words).
  bool erase(const Id& id) {
    const auto at = slots_.find(id);
    if (at == slots_.end()) return false;
    const std::uint32_t slot = at->second;
    index_.erase(slot, keyframes_[slot].bag);
    keyframes_[slot].bag.words.clear();
    free_.push_back(slot);
    slots_.erase(at);
    return true;
  }

  /// Changes the id of a keyframe; returns false, without changes, if the id is unknown or `to` is in use. O(1).
  bool rename(const Id& from, const Id& to) {
    if (!contains(from) || contains(to)) return false;
    auto renamed = slots_.extract(from);
    keyframes_[renamed.mapped()].id = renamed.key() = to;
    slots_.insert(std::move(renamed));
    return true;
  }

  void clear() {
    slots_.clear();
    keyframes_.clear();
    free_.clear();
    index_.clear();
  }

  /// Similarity of an image and a keyframe. @pre contains(id)
  [[nodiscard]] double score(const bag_of_words& image, const Id& id) const { return similarity(image, bag(id)); }

  /// Finds the keyframes that may show the same place as an image; the best group comes first, ties are ordered by id.
  ///
  /// Considers the keyframes that share words with the image, except those for which `exclude(id)` is true (for loop
  /// closing, the surroundings of the image itself). Computes the scores of keyframes that share enough words. Each
  /// keyframe with a sufficient score forms a group with those of its neighbours that were also scored (`neighbors(id)`
  /// returns a range of ids: the keyframes with the most common landmarks). A group represents a place; the best
  /// keyframe of each group with a sufficient score sum becomes a candidate (at most once). Neighbours that are not in
  /// the database are ignored.
  ///
  /// O(keyframes + keyframes that share a word, counted once per shared word + candidates x words); in steady state
  /// only the callables allocate memory.
  template <std::predicate<const Id&> Exclude = none_excluded, class Neighbors = no_neighbors<Id>>
  requires std::ranges::input_range<std::invoke_result_t<Neighbors&, const Id&>> &&
      std::convertible_to<std::ranges::range_reference_t<std::invoke_result_t<Neighbors&, const Id&>>, Id>
  void query(const bag_of_words& image, std::vector<candidate>& found, workspace& memory,
             const query_options& options = {}, Exclude&& exclude = {}, Neighbors&& neighbors = {}) const {
    found.clear();
    count_shared(image, memory, exclude);
    score_those_with_most(image, memory, options);
    gather_groups(memory, options, neighbors);
    keep_best(memory, options, found);
  }
  /// Returns the candidates; allocates its own memory.
  template <std::predicate<const Id&> Exclude = none_excluded, class Neighbors = no_neighbors<Id>>
  [[nodiscard]] std::vector<candidate> query(const bag_of_words& image, const query_options& options = {},
                                             Exclude&& exclude = {}, Neighbors&& neighbors = {}) const {
    std::vector<candidate> found;
    workspace memory;
    query(image, found, memory, options, exclude, neighbors);
    return found;
  }

  /// Finds the `count` keyframes with the highest scores, ties ordered by id; fewer if fewer share a word with the
  /// image. O(keyframes that share a word x words).
  template <std::predicate<const Id&> Exclude = none_excluded>
  void best(const bag_of_words& image, std::size_t count, std::vector<candidate>& found, workspace& memory,
            Exclude&& exclude = {}) const {
    found.clear();
    count_shared(image, memory, exclude);
    for (const std::uint32_t slot : memory.touched) {
      const double score = similarity(image, keyframes_[slot].bag);
      found.push_back({keyframes_[slot].id, memory.shared[slot], score, score});
    }
    const auto end = found.begin() + static_cast<std::ptrdiff_t>(std::min(count, found.size()));
    std::partial_sort(found.begin(), end, found.end(), better);
    found.erase(end, found.end());
  }
  template <std::predicate<const Id&> Exclude = none_excluded>
  [[nodiscard]] std::vector<candidate> best(const bag_of_words& image, std::size_t count,
                                            Exclude&& exclude = {}) const {
    std::vector<candidate> found;
    workspace memory;
    best(image, count, found, memory, exclude);
    return found;
  }

  /// Approximate memory in bytes.
  [[nodiscard]] std::size_t memory() const noexcept {
    std::size_t bytes = index_.memory() + keyframes_.capacity() * sizeof(keyframe) +
                        slots_.size() * (sizeof(Id) + 3 * sizeof(void*)) + slots_.bucket_count() * sizeof(void*);
    for (const keyframe& k : keyframes_) bytes += k.bag.words.capacity() * sizeof(word_value);
    return bytes;
  }

 private:
  static constexpr double unscored = -1.0;
  struct keyframe {
    Id id{};
    bag_of_words bag;
  };

  [[nodiscard]] static bool better(const candidate& a, const candidate& b) {
    return a.group_score != b.group_score ? a.group_score > b.group_score : a.id < b.id;
  }

  template <class Exclude>
  void count_shared(const bag_of_words& image, workspace& memory, Exclude& exclude) const {
    memory.shared.assign(keyframes_.size(), 0);
    memory.touched.clear();
    for (std::size_t i = 0; i != image.size(); ++i) {
#if defined(__GNUC__)
      // Prefetch the next list while counting the current one.
      if (i + 1 != image.size()) __builtin_prefetch(index_.images_with(image.words[i + 1].word).data());
#endif
      for (const std::uint32_t slot : index_.images_with(image.words[i].word))
        if (memory.shared[slot]++ == 0) memory.touched.push_back(slot);
    }
    std::erase_if(memory.touched, [&](std::uint32_t slot) {
      return static_cast<bool>(std::invoke(exclude, std::as_const(keyframes_[slot].id)));
    });
  }

  void score_those_with_most(const bag_of_words& image, workspace& memory, const query_options& options) const {
    memory.scores.assign(keyframes_.size(), unscored);
    memory.scored.clear();
    std::uint32_t most = 0;
    for (const std::uint32_t slot : memory.touched) most = std::max(most, memory.shared[slot]);
    const double enough = options.shared_words * most;
    for (const std::uint32_t slot : memory.touched) {
      if (!(memory.shared[slot] > enough)) continue;
      memory.scores[slot] = similarity(image, keyframes_[slot].bag);
      memory.scored.push_back(slot);
    }
  }

  template <class Neighbors>
  void gather_groups(workspace& memory, const query_options& options, Neighbors& neighbors) const {
    memory.groups.clear();
    for (const std::uint32_t slot : memory.scored) {
      if (!(memory.scores[slot] >= options.min_score)) continue;
      const Id& id = keyframes_[slot].id;
      candidate group{id, memory.shared[slot], memory.scores[slot], memory.scores[slot]};
      for (auto&& neighbor : std::invoke(neighbors, id)) {
        const auto at = slots_.find(static_cast<Id>(neighbor));
        if (at == slots_.end() || at->second == slot || memory.scores[at->second] == unscored) continue;
        const double score = memory.scores[at->second];
        group.group_score += score;
        if (score < group.score || (score == group.score && !(at->first < group.id))) continue;
        group.id = at->first;
        group.score = score;
        group.shared_words = memory.shared[at->second];
      }
      memory.groups.push_back(group);
    }
  }

  void keep_best(workspace& memory, const query_options& options, std::vector<candidate>& found) const {
    double most = 0.0;
    for (const candidate& group : memory.groups) most = std::max(most, group.group_score);
    for (const candidate& group : memory.groups)
      if (group.group_score > options.group_score * most) found.push_back(group);
    // Keep each keyframe once, with its best group.
    std::sort(found.begin(), found.end(), [](const candidate& a, const candidate& b) {
      return a.id != b.id ? a.id < b.id : a.group_score > b.group_score;
    });
    found.erase(
        std::unique(found.begin(), found.end(), [](const candidate& a, const candidate& b) { return a.id == b.id; }),
        found.end());
    std::sort(found.begin(), found.end(), better);
  }

  std::unordered_map<Id, std::uint32_t> slots_;
  std::vector<keyframe> keyframes_;
  std::vector<std::uint32_t> free_;
  inverted_index index_;
};

/// A keyframe database with integer ids.
using keyframe_database = basic_keyframe_database<>;

}  // namespace orbis::places

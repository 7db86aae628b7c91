// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Matchers as values: a source followed by stages, composed with `|`.
///
/// @code
///   constexpr auto matcher = brute_force(hamming{}) | ratio_test{0.7f} | cross_check{} | max_distance{50};
///   std::vector<match> matches = matcher(f1.descriptors, f2.descriptors);
/// @endcode
///
/// A chain begins with one source (`brute_force`, `windowed`, `projected`, `epipolar`); a stage is anything that
/// satisfies `match_stage`, for example a lambda `bool(const candidate&)`. Stages test candidates in order; each
/// receives the nearest neighbour, the second distance and the reverse neighbour that the source found among *all*
/// descriptors, not among the descriptors left by earlier stages.
///
/// A matcher that is called every frame can keep its memory in a workspace:
///
/// @code
///   decltype(matcher)::workspace memory;
///   matcher.match_into(matches, memory, f1.descriptors, f2.descriptors);
/// @endcode
#pragma once

#include <cassert>
#include <concepts>
#include <cstddef>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <orbis/features/match.hpp>

namespace orbis::features {

/// A source with its stages. Created by `|`, called with query and train descriptors.
template <match_source Source, match_stage... Stages>
class match_chain {
 public:
  static constexpr search_needs needs = (search_needs{} | ... | stage_needs<Stages>());

  constexpr match_chain(Source source, std::tuple<Stages...> stages) : source_{source}, stages_{std::move(stages)} {}

  /// Reusable memory for `match_into`.
  struct workspace {
    std::vector<candidate> candidates;
    workspace_of<Source> source;
    std::tuple<workspace_of<Stages>...> stages;
  };

  /// Returns the matches in ascending order of query, at most one per query. `where`: additional arguments of the
  /// source, e.g. the windows of `windowed`.
  /// @pre both sides have keypoints if a stage needs them
  template <describable Queries, describable Trains, class... Where>
  requires std::same_as<descriptor_of<Queries>, descriptor_of<Trains>> &&
      searches<Source, descriptor_of<Queries>, Where...>
  [[nodiscard]] std::vector<match> operator()(const Queries& queries, const Trains& trains,
                                              const Where&... where) const {
    std::vector<match> matches;
    workspace memory;
    match_into(matches, memory, queries, trains, where...);
    return matches;
  }

  /// Replaces the contents of `matches`. Once `memory` has been used for a call of the same size, the library's parts
  /// allocate nothing.
  template <describable Queries, describable Trains, class... Where>
  requires std::same_as<descriptor_of<Queries>, descriptor_of<Trains>> &&
      searches<Source, descriptor_of<Queries>, Where...>
  void match_into(std::vector<match>& matches, workspace& memory, const Queries& queries, const Trains& trains,
                  const Where&... where) const {
    const auto q = as_view(queries);
    const auto t = as_view(trains);
    if constexpr (needs.keypoints) {
      assert(q.keypoints.size() == q.descriptors.size() && t.keypoints.size() == t.descriptors.size());
    }
    source_.search(memory.candidates, memory.source, q, t, needs, where...);
    run_all(memory, q.keypoints, t.keypoints, std::index_sequence_for<Stages...>{});

    matches.clear();
    matches.reserve(memory.candidates.size());
    for (const candidate& c : memory.candidates) matches.push_back({c.query, c.train, c.distance});
  }

  /// Returns a copy of this chain with one more stage at the end.
  template <match_stage Stage>
  [[nodiscard]] constexpr auto then(Stage stage) const {
    return match_chain<Source, Stages..., Stage>{source_, std::tuple_cat(stages_, std::tuple<Stage>{std::move(stage)})};
  }

 private:
  template <std::size_t... I>
  void run_all(workspace& memory, std::span<const keypoint> queries, std::span<const keypoint> trains,
               std::index_sequence<I...>) const {
    (run(std::get<I>(stages_), memory.candidates, queries, trains, std::get<I>(memory.stages)), ...);
  }
  template <class Stage>
  static void run(const Stage& stage, std::vector<candidate>& candidates, std::span<const keypoint> queries,
                  std::span<const keypoint> trains, workspace_of<Stage>& memory) {
    if constexpr (match_predicate<Stage>) {
      std::erase_if(candidates, [&](const candidate& c) { return !stage(c); });
    } else {
      stage(candidates, queries, trains, memory);
    }
  }

  Source source_;
  std::tuple<Stages...> stages_;
};

namespace detail {

template <class T>
inline constexpr bool is_chain = false;
template <class... Parts>
inline constexpr bool is_chain<match_chain<Parts...>> = true;

template <class T>
concept chain_part = is_chain<T> || match_source<T> || match_stage<T>;

/// Placeholder result of an invalid composition, to avoid further compiler errors.
struct no_matcher {
  std::vector<match> operator()(const auto&...) const { return {}; }
};

}  // namespace detail

/// Appends a stage to a source or a chain.
template <class Left, class Right>
requires(detail::chain_part<Left> || detail::chain_part<Right>) [[nodiscard]] constexpr auto operator|(Left left,
                                                                                                       Right right) {
  constexpr bool begins_well = detail::is_chain<Left> || match_source<Left>;
  constexpr bool one_source = !detail::is_chain<Right> && !match_source<Right>;
  static_assert(begins_well,
                "orbis: a matcher begins with a source, such as brute_force(hamming{}), followed by stages");
  static_assert(!begins_well || one_source, "orbis: a matcher has one source, in the first position");
  static_assert(!begins_well || !one_source || match_stage<Right>,
                "orbis: the right operand of | must be a matching stage, which has const call operators: either "
                "bool(const candidate&), or void(std::vector<candidate>&, std::span<const keypoint>, "
                "std::span<const keypoint>, workspace&) with its member type workspace, or no_workspace");
  if constexpr (!begins_well || !one_source || !match_stage<Right>) {
    return detail::no_matcher{};
  } else if constexpr (detail::is_chain<Left>) {
    return left.then(std::move(right));
  } else {
    return match_chain<Left, Right>{std::move(left), std::tuple<Right>{std::move(right)}};
  }
}

}  // namespace orbis::features

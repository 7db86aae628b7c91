// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Matches, candidates, and the concepts of the parts of a matcher: sources and stages.
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <ranges>
#include <span>
#include <type_traits>
#include <vector>

#include <orbis/features/descriptor.hpp>

namespace orbis::features {

/// A pair of similar descriptors: indices `query` and `train`, and their descriptor distance.
struct match {
  std::uint32_t query = 0;
  std::uint32_t train = 0;
  std::uint32_t distance = 0;
  friend constexpr bool operator==(const match&, const match&) = default;
};

/// Placeholder for an index or a distance that does not exist.
inline constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// The result of a source for one query; stages accept or reject it.
struct candidate {
  std::uint32_t query = 0;
  std::uint32_t train = 0;               ///< index of the nearest train descriptor; the lowest on ties
  std::uint32_t distance = 0;            ///< distance to the nearest
  std::uint32_t second_distance = none;  ///< distance to the second-nearest; `none` if there is only one
  std::uint32_t reverse_query = none;    ///< the query nearest to `train` (lowest index on ties), if requested
  friend constexpr bool operator==(const candidate&, const candidate&) = default;
};

/// A non-owning view of descriptors with optional keypoints: the arguments of a matcher. Constructed from `features` or
/// any contiguous range of descriptors.
template <class Descriptor>
struct feature_view {
  std::span<const keypoint> keypoints;  ///< empty, or one per descriptor
  std::span<const Descriptor> descriptors;
};

/// Converts any valid argument of a matcher to a view: `basic_features`, a `feature_view` or a contiguous range of
/// descriptors.
template <class Descriptor>
[[nodiscard]] feature_view<Descriptor> as_view(const basic_features<Descriptor>& f) noexcept {
  return {f.keypoints, f.descriptors};
}
template <class Descriptor>
[[nodiscard]] constexpr feature_view<Descriptor> as_view(const feature_view<Descriptor>& view) noexcept {
  return view;
}
template <std::ranges::contiguous_range Range>
requires std::ranges::sized_range<Range>
[[nodiscard]] constexpr feature_view<std::ranges::range_value_t<Range>> as_view(const Range& descriptors) noexcept {
  return {{}, {std::ranges::data(descriptors), std::ranges::size(descriptors)}};
}
template <class T>
concept describable = requires(const T& x) {
  as_view(x);
};
template <describable T>
[[deprecated("use as_view")]] [[nodiscard]] constexpr auto view_of(const T& x) noexcept {
  return as_view(x);
}
template <describable T>
using descriptor_of =
    std::remove_const_t<typename decltype(decltype(as_view(std::declval<const T&>()))::descriptors)::element_type>;

/// Data that the stages after a source require in addition to the nearest neighbour.
struct search_needs {
  bool reverse = false;    ///< `candidate::reverse_query`
  bool keypoints = false;  ///< the keypoints of both sides, provided by the caller
  [[nodiscard]] constexpr search_needs operator|(search_needs other) const noexcept {
    return {reverse || other.reverse, keypoints || other.keypoints};
  }
};

/// The workspace of a part that needs no memory.
struct no_workspace {};

namespace detail {
template <class Part>
struct workspace_of_part {
  using type = no_workspace;
};
template <class Part>
requires requires { typename Part::workspace; }
struct workspace_of_part<Part> {
  using type = typename Part::workspace;
};
}  // namespace detail

/// The reusable memory of a part of a matcher: its member type `workspace`, if it has one.
template <class Part>
using workspace_of = typename detail::workspace_of_part<Part>::type;

/// The first part of a matcher. Its function `search(candidates, workspace, queries, trains, needs, where...)`
/// replaces `candidates` with at most one candidate per query, in ascending order of query.
template <class S>
concept match_source = requires {
  typename S::match_source_tag;
};

/// A source that searches descriptors of this type. `Where` are its additional arguments, e.g. the windows of
/// `windowed`.
template <class S, class Descriptor, class... Where>
concept searches = match_source<S> &&
    requires(const S& source, std::vector<candidate>& candidates, workspace_of<S>& memory,
             const feature_view<Descriptor>& view, search_needs needs, const Where&... where) {
  source.search(candidates, memory, view, view, needs, where...);
};

/// A stage that tests each candidate individually: any callable `bool(const candidate&)`.
template <class S>
concept match_predicate = std::predicate<const S&, const candidate&>;

/// A stage that tests the candidates together, with the keypoints (empty if the caller passed none): any callable
/// `void(std::vector<candidate>&, std::span<const keypoint>, std::span<const keypoint>, workspace_of<S>&)` that erases
/// rejected candidates and keeps the order.
template <class S>
concept match_filter = std::invocable < const S&,
        std::vector<candidate>
&, std::span<const keypoint>, std::span<const keypoint>, workspace_of<S>& > ;

/// Any stage. A static member `needs` may request more data than the nearest neighbour.
template <class S>
concept match_stage = (match_predicate<S> || match_filter<S>)&&!match_source<S>;

/// Returns the data that a stage requires.
template <match_stage S>
[[nodiscard]] constexpr search_needs stage_needs() noexcept {
  if constexpr (requires {
                  { S::needs } -> std::convertible_to<search_needs>;
                }) {
    return S::needs;
  } else {
    return {};
  }
}

}  // namespace orbis::features

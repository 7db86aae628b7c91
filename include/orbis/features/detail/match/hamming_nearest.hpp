// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The nearest neighbours of many bit strings under the Hamming distance.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

#include <orbis/core/bits.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/features/detail/match/hamming_listed.hpp>
#include <orbis/features/detail/match/hamming_search.hpp>
#include <orbis/features/detail/match/hamming_slices.hpp>
#include <orbis/features/detail/match/nearest.hpp>

namespace orbis::features::detail {

/// The search result per query: the nearest train descriptor and the distance of the second-nearest.
struct keep_two {
  nearest_two* nearest;
  [[nodiscard]] std::uint32_t limit(std::size_t q) const noexcept { return nearest[q].second_distance; }
  /// @pre distance < limit(q); indices are inserted in ascending order
  ORBIS_ALWAYS_INLINE void insert(std::size_t q, std::uint32_t index, std::uint32_t distance) const noexcept {
    nearest_two& n = nearest[q];
    if (distance < n.distance) {
      n = {index, distance, n.distance};
    } else {
      n.second_distance = distance;
    }
  }
};

/// Compares pair by pair, for sets too small for bit slices.
template <class Target, class D>
ORBIS_ALWAYS_INLINE void search_pairs(std::span<const D> queries, std::span<const D> trains, const keep_two& keep,
                                      std::span<std::uint32_t> reverse, hamming_workspace& workspace) {
  workspace.reverse_distance.assign(reverse.size(), none);
  for (std::size_t q = 0; q != queries.size(); ++q) {
    const D query = queries[q];
    std::uint32_t limit = keep.limit(q);
    for (std::size_t t = 0; t != trains.size(); ++t) {
      const std::uint32_t distance = count_differing_bits<Target>(query, trains[t]);
      if (distance < limit) {
        keep.insert(q, static_cast<std::uint32_t>(t), distance);
        limit = keep.limit(q);
      }
      if (!reverse.empty() && distance < workspace.reverse_distance[t]) {
        workspace.reverse_distance[t] = distance;
        reverse[t] = static_cast<std::uint32_t>(q);
      }
    }
  }
}

/// Calls `visit(index)` for every bit that is set in both `bits` and `valid`, in ascending order.
template <std::size_t Words, class Visit>
ORBIS_ALWAYS_INLINE void for_each_bit(const slice<Words>& bits, const slice<Words>& valid, Visit&& visit) {
  for (std::size_t w = 0; w != Words; ++w)
    for (std::uint64_t rest = bits.words[w] & valid.words[w]; rest != 0; rest &= rest - 1)
      visit(64 * w + static_cast<std::size_t>(std::countr_zero(rest)));
}

/// Compares all queries with one block of train descriptors at a time, so that the block's table stays in the L1 cache.
template <class Target, class D>
ORBIS_ALWAYS_INLINE void search_slices(std::span<const D> queries, std::span<const D> trains, const keep_two& keep,
                                       std::span<std::uint32_t> reverse, hamming_workspace& workspace) {
  constexpr std::size_t Words = slice_words<Target>;
  auto& tables = [&]() -> auto& {
    if constexpr (Words == 4) {
      return workspace.table4;
    } else {
      return workspace.table8;
    }
  }
  ();
  tables.resize(1);
  workspace.queries.resize(queries.size());
  for (std::size_t q = 0; q != queries.size(); ++q)
    make_slice_query<Target>(as_words(queries[q]), workspace.queries[q]);
  slice_table<Words>& table = tables.front();
  for (std::size_t begin = 0; begin < trains.size(); begin += 64 * Words) {
    const auto block = trains.subspan(begin, std::min<std::size_t>(64 * Words, trains.size() - begin));
    make_slice_table<Target>(block, table);
    slice<Words> valid;
    for (std::size_t t = 0; t != block.size(); ++t) valid.words[t / 64] |= std::uint64_t{1} << (t % 64);
    slice_distances<Words> least;
    for (slice<Words>& plane : least) plane.words.fill(~std::uint64_t{0});
    const std::size_t rank = std::min<std::size_t>(2, block.size());
    std::uint32_t guess = 0;
    slice_distances<Words>
        distances;  // of the current query; declared here, because initialising them per query costs 8 % of the time
    slice<Words> below;

    for (std::size_t q = 0; q != queries.size(); ++q) {
      std::uint32_t limit = keep.limit(q);
      const bool first = limit == none;
      slice_count<Target>(table, workspace.queries[q], first ? guess : limit, distances, below);
      if (first) {
        // The limit of the previous query is a good estimate; the exact limit costs more.
        std::size_t found = 0;
        for (std::size_t w = 0; w != Words; ++w) found += simd::ones<Target>(below.words[w] & valid.words[w]);
        if (found < rank || found > 4 * rank + 8) {
          limit = slice_ranked<Target>(distances, valid, rank) + 1;
          slice_below<Target>(distances, limit, below);
          guess = limit + 3;
        }
      }
      for_each_bit(below, valid, [&](std::size_t t) ORBIS_INLINE_LAMBDA {
        const std::uint32_t distance = count_differing_bits<Target>(queries[q], block[t]);
        if (distance < keep.limit(q)) keep.insert(q, static_cast<std::uint32_t>(begin + t), distance);
      });
      if (reverse.empty()) continue;
      slice_lower<Target>(distances, least, below);
      for_each_bit(below, valid,
                   [&](std::size_t t) ORBIS_INLINE_LAMBDA { reverse[begin + t] = static_cast<std::uint32_t>(q); });
    }
  }
}

struct hamming_search_kernel {
  template <class Target, class D>
  static ORBIS_ALWAYS_INLINE void run(std::span<const D> queries, std::span<const D> trains, const keep_two& keep,
                                      std::span<std::uint32_t> reverse, hamming_workspace& workspace) {
    // Building a table costs about as much as it saves in a dozen queries; a block costs the same for any number of
    // train descriptors.
    if constexpr (bits_of<D> == 256) {
      if (queries.size() >= 16 && trains.size() >= 64)
        return search_slices<Target>(queries, trains, keep, reverse, workspace);
    }
    search_pairs<Target>(queries, trains, keep, reverse, workspace);
  }
};

template <bit_string D>
void hamming_nearest(std::span<const D> queries, std::span<const D> trains, std::span<nearest_two> nearest,
                     std::span<std::uint32_t> reverse, hamming_workspace& workspace) {
  assert(nearest.size() == queries.size() && (reverse.empty() || reverse.size() == trains.size()));
  std::fill(nearest.begin(), nearest.end(), nearest_two{});
  using signature =
      void(std::span<const D>, std::span<const D>, const keep_two&, std::span<std::uint32_t>, hamming_workspace&);
  simd::kernel<hamming_search_kernel, signature, simd::popcnt, simd::avx2, simd::avx512>()(
      queries, trains, keep_two{nearest.data()}, reverse, workspace);
}

}  // namespace orbis::features::detail

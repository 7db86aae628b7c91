// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The nearest neighbours of many binary descriptors at once, by run-time dispatched kernels.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/features/detail/match/hamming_slices.hpp>
#include <orbis/features/detail/match/nearest.hpp>
#include <orbis/features/hamming.hpp>

namespace orbis::features::detail {

template <class T>
inline constexpr bool is_binary_descriptor = false;
template <std::size_t Bits>
inline constexpr bool is_binary_descriptor<binary_descriptor<Bits>> = true;

/// Descriptors that `hamming_nearest` knows. Those of 256 bits have kernels of their own.
template <class Descriptor>
concept has_hamming_kernel = is_binary_descriptor<Descriptor>;

/// Memory of `hamming_nearest`, which the next call uses again.
struct hamming_workspace {
  std::vector<slice_query> queries;
  std::vector<slice_table<4>> table4;  ///< of the trains at hand, for registers of up to 256 bits
  std::vector<slice_table<8>> table8;  ///< likewise, of 512 bits
  std::vector<std::uint32_t> reverse_distance;
};

template <std::size_t Bits>
using descriptor_span = std::span<const binary_descriptor<Bits>>;
template <std::size_t Bits, class Keep>
using hamming_kernel = void(descriptor_span<Bits>, descriptor_span<Bits>, const Keep&, std::span<std::uint32_t>,
                            hamming_workspace&);

/// What a search found of each query so far, for any number of neighbours: rows of `k`, ascending.
struct keep_k {
  neighbor* rows;
  std::size_t k;
  [[nodiscard]] std::size_t rank() const noexcept { return k; }
  [[nodiscard]] std::uint32_t limit(std::size_t q) const noexcept { return rows[q * k + k - 1].distance; }
  /// @pre distance < limit(q); indices arrive ascending
  [[gnu::always_inline]] void insert(std::size_t q, std::uint32_t index, std::uint32_t distance) const noexcept {
    neighbor* const row = rows + q * k;
    std::size_t at = k - 1;
    for (; at != 0 && row[at - 1].distance > distance; --at) row[at] = row[at - 1];
    row[at] = {index, distance};
  }
};

/// Likewise for the nearest and the distance of the second.
struct keep_two {
  nearest_two* nearest;
  [[nodiscard]] static std::size_t rank() noexcept { return 2; }
  [[nodiscard]] std::uint32_t limit(std::size_t q) const noexcept { return nearest[q].second_distance; }
  [[gnu::always_inline]] void insert(std::size_t q, std::uint32_t index, std::uint32_t distance) const noexcept {
    nearest_two& n = nearest[q];
    if (distance < n.distance) {
      n = {index, distance, n.distance};
    } else {
      n.second_distance = distance;
    }
  }
};

template <class Ops, std::size_t Bits>
[[gnu::always_inline]] inline std::uint32_t hamming_by(const binary_descriptor<Bits>& a,
                                                       const binary_descriptor<Bits>& b) noexcept {
  std::uint32_t sum = 0;
#pragma GCC unroll 8
  for (std::size_t w = 0; w != Bits / 64; ++w) sum += Ops::ones(a.words[w] ^ b.words[w]);
  return sum;
}

/// Pair by pair: for so few that slicing does not pay.
template <class Ops, std::size_t Bits, class Keep>
[[gnu::always_inline]] inline void hamming_pairs(descriptor_span<Bits> queries, descriptor_span<Bits> trains,
                                                 const Keep& keep, std::span<std::uint32_t> reverse,
                                                 hamming_workspace& workspace) {
  workspace.reverse_distance.assign(reverse.size(), no_neighbor);
  for (std::size_t q = 0; q != queries.size(); ++q) {
    const binary_descriptor<Bits> query = queries[q];
    std::uint32_t limit = keep.limit(q);
    for (std::size_t t = 0; t != trains.size(); ++t) {
      const std::uint32_t distance = hamming_by<Ops>(query, trains[t]);
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

/// Calls `visit(index)` for every bit that is set in both, ascending.
template <std::size_t Words, class Visit>
[[gnu::always_inline]] inline void for_each_bit(const slice<Words>& bits, const slice<Words>& valid, Visit&& visit) {
  for (std::size_t w = 0; w != Words; ++w)
    for (std::uint64_t rest = bits.words[w] & valid.words[w]; rest != 0; rest &= rest - 1)
      visit(64 * w + static_cast<std::size_t>(std::countr_zero(rest)));
}

/// Block after block of trains, each against all queries while its table is in the first-level cache.
template <class Ops, class Keep>
[[gnu::always_inline]] inline void hamming_slices(descriptor_span<256> queries, descriptor_span<256> trains,
                                                  const Keep& keep, std::span<std::uint32_t> reverse,
                                                  hamming_workspace& workspace) {
  constexpr std::size_t Words = Ops::words;
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
  for (std::size_t q = 0; q != queries.size(); ++q) make_slice_query(queries[q], workspace.queries[q]);
  slice_table<Words>& table = tables.front();
  for (std::size_t begin = 0; begin < trains.size(); begin += 64 * Words) {
    const auto block = trains.subspan(begin, std::min<std::size_t>(64 * Words, trains.size() - begin));
    make_slice_table(block, table);
    slice<Words> valid;
    for (std::size_t t = 0; t != block.size(); ++t) valid.words[t / 64] |= std::uint64_t{1} << (t % 64);
    slice_distances<Words> least;
    for (slice<Words>& plane : least) plane.words.fill(~std::uint64_t{0});
    const std::size_t rank = std::min(keep.rank(), block.size());
    std::uint32_t guess = 0;
    slice_distances<Words> distances;  // of the query at hand; here, as clearing them for each would cost a twelfth
    slice<Words> below;

    for (std::size_t q = 0; q != queries.size(); ++q) {
      std::uint32_t limit = keep.limit(q);
      const bool first = limit == no_neighbor;
      slice_count<Ops>(table, workspace.queries[q], first ? guess : limit, distances, below);
      if (first) {
        // The last queries tell about where the nearest lie; the exact limit costs more.
        std::size_t found = 0;
        for (std::size_t w = 0; w != Words; ++w) found += Ops::ones(below.words[w] & valid.words[w]);
        if (found < rank || found > 4 * rank + 8) {
          limit = slice_ranked<Ops>(distances, valid, rank) + 1;
          slice_below<Ops>(distances, limit, below);
          guess = limit + 3;
        }
      }
      for_each_bit(
          below, valid, [&](std::size_t t) __attribute__((always_inline)) {
            const std::uint32_t distance = hamming_by<Ops>(queries[q], block[t]);
            if (distance < keep.limit(q)) keep.insert(q, static_cast<std::uint32_t>(begin + t), distance);
          });
      if (reverse.empty()) continue;
      slice_lower<Ops>(distances, least, below);
      for_each_bit(
          below, valid, [&](std::size_t t) __attribute__((always_inline)) {
            reverse[begin + t] = static_cast<std::uint32_t>(q);
          });
    }
  }
}

template <class Ops, std::size_t Bits, class Keep>
[[gnu::always_inline]] inline void hamming_search(descriptor_span<Bits> queries, descriptor_span<Bits> trains,
                                                  const Keep& keep, std::span<std::uint32_t> reverse,
                                                  hamming_workspace& workspace) {
  // A table costs about as much as a dozen queries save; a block costs the same however few trains it holds.
  if constexpr (Bits == 256) {
    if (queries.size() >= 16 && trains.size() >= 64)
      return hamming_slices<Ops>(queries, trains, keep, reverse, workspace);
  }
  hamming_pairs<Ops, Bits>(queries, trains, keep, reverse, workspace);
}

template <std::size_t Bits, class Keep>
void hamming_search_portable(descriptor_span<Bits> queries, descriptor_span<Bits> trains, const Keep& keep,
                             std::span<std::uint32_t> reverse, hamming_workspace& workspace) {
  hamming_search<slice_ops_portable, Bits>(queries, trains, keep, reverse, workspace);
}
#if ORBIS_X86
template <std::size_t Bits, class Keep>
ORBIS_TARGET("popcnt")
void hamming_search_popcnt(descriptor_span<Bits> queries, descriptor_span<Bits> trains, const Keep& keep,
                           std::span<std::uint32_t> reverse, hamming_workspace& workspace) {
  hamming_search<slice_ops_popcnt, Bits>(queries, trains, keep, reverse, workspace);
}
template <std::size_t Bits, class Keep>
ORBIS_TARGET("avx2,popcnt,bmi,bmi2")
void hamming_search_avx2(descriptor_span<Bits> queries, descriptor_span<Bits> trains, const Keep& keep,
                         std::span<std::uint32_t> reverse, hamming_workspace& workspace) {
  hamming_search<slice_ops_avx2, Bits>(queries, trains, keep, reverse, workspace);
}
template <std::size_t Bits, class Keep>
ORBIS_TARGET("avx2,popcnt,bmi,bmi2,avx512f")
void hamming_search_avx512(descriptor_span<Bits> queries, descriptor_span<Bits> trains, const Keep& keep,
                           std::span<std::uint32_t> reverse, hamming_workspace& workspace) {
  hamming_search<slice_ops_avx512, Bits>(queries, trains, keep, reverse, workspace);
}
#endif

template <std::size_t Bits, class Keep>
void hamming_dispatch(simd::level level, descriptor_span<Bits> queries, descriptor_span<Bits> trains, const Keep& keep,
                      std::span<std::uint32_t> reverse, hamming_workspace& workspace) {
#if ORBIS_X86
  const auto search = simd::select<hamming_kernel<Bits, Keep>>(level, {.portable = hamming_search_portable<Bits, Keep>,
                                                                       .popcnt = hamming_search_popcnt<Bits, Keep>,
                                                                       .avx2 = hamming_search_avx2<Bits, Keep>,
                                                                       .avx512 = hamming_search_avx512<Bits, Keep>});
#else
  static_cast<void>(level);
  const auto search = hamming_search_portable<Bits, Keep>;
#endif
  search(queries, trains, keep, reverse, workspace);
}

/// For each query its nearest and second nearest train; if `reverse` is not empty, for each train its nearest
/// query (the lowest on ties), in the same pass. Every level gives the same answer. O(queries x trains) time,
/// O(queries + trains) memory, all of it in `workspace`.
/// @pre nearest.size() == queries.size(); reverse is empty or of the size of trains
template <std::size_t Bits = 256>
void hamming_nearest(simd::level level, std::type_identity_t<descriptor_span<Bits>> queries,
                     std::type_identity_t<descriptor_span<Bits>> trains, std::span<nearest_two> nearest,
                     std::span<std::uint32_t> reverse, hamming_workspace& workspace) {
  assert(nearest.size() == queries.size() && (reverse.empty() || reverse.size() == trains.size()));
  std::fill(nearest.begin(), nearest.end(), nearest_two{});
  hamming_dispatch<Bits>(level, queries, trains, keep_two{nearest.data()}, reverse, workspace);
}
/// The same, with memory of its own.
template <std::size_t Bits = 256>
void hamming_nearest(simd::level level, std::type_identity_t<descriptor_span<Bits>> queries,
                     std::type_identity_t<descriptor_span<Bits>> trains, std::span<nearest_two> nearest,
                     std::span<std::uint32_t> reverse) {
  hamming_workspace workspace;
  hamming_nearest<Bits>(level, queries, trains, nearest, reverse, workspace);
}

/// For each query its `k` nearest trains by ascending distance, then index: row `q` begins at `nearest[q * k]`,
/// and what there are too few trains for is left at the default.
/// @pre k > 0; nearest.size() == queries.size() * k
template <std::size_t Bits = 256>
void hamming_k_nearest(simd::level level, std::type_identity_t<descriptor_span<Bits>> queries,
                       std::type_identity_t<descriptor_span<Bits>> trains, std::size_t k, std::span<neighbor> nearest,
                       hamming_workspace& workspace) {
  assert(k > 0 && nearest.size() == queries.size() * k);
  std::fill(nearest.begin(), nearest.end(), neighbor{});
  hamming_dispatch<Bits>(level, queries, trains, keep_k{nearest.data(), k}, {}, workspace);
}

}  // namespace orbis::features::detail

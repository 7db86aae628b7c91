// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Accumulates the points of every occupied voxel in the order of the cloud.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/detail/voxels/voxel_cells.hpp>
#include <orbis/cloud/detail/voxels/voxel_table.hpp>
#include <orbis/core/bits.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/table_memory.hpp>

namespace orbis::cloud::detail {

/// Result for a voxel: the mean of its points and of their colours.
struct voxel_summary {
  std::array<float, 3> position{};
  rgb8 color;
};

/// Accumulation of points into voxels. Each voxel has a record, initially `empty`, to which its points are added in the
/// order of the cloud. After `resize(count)`, `put(number, summary)` is called once for each voxel, concurrently for
/// different voxels; `number` is the index of the voxel in the order of first occurrence.
template <bool Colored>
struct centroid_fold {
  struct plain_record {
    std::array<double, 3> position;
    std::uint32_t count;
  };
  struct colored_record : plain_record {
    std::array<std::uint64_t, 3> color;
  };
  using record = std::conditional_t<Colored, colored_record, plain_record>;
  static constexpr record empty{};

  std::span<const rgb8> colors;
  point_cloud& out;

  void add(record& r, std::uint32_t i, const std::array<double, 3>& p) const {
    for (std::size_t a = 0; a != 3; ++a) r.position[a] += p[a];
    if constexpr (Colored) {
      r.color[0] += colors[i].r;
      r.color[1] += colors[i].g;
      r.color[2] += colors[i].b;
    }
    ++r.count;
  }
  [[nodiscard]] voxel_summary summary(const record& r) const {
    voxel_summary out;
    const auto mean = [&](double sum) { return r.count == 1 ? sum : sum / r.count; };  // many voxels have one point
    for (std::size_t a = 0; a != 3; ++a) out.position[a] = static_cast<float>(mean(r.position[a]));
    if constexpr (Colored) {
      const auto channel = [&](std::size_t c) {
        return static_cast<std::uint8_t>((r.color[c] + r.count / 2) / r.count);  // rounded
      };
      out.color = {channel(0), channel(1), channel(2)};
    }
    return out;
  }
  void resize(std::size_t count) {
    out.points.resize(count);
    if constexpr (Colored) out.colors.resize(count);
  }
  void put(std::uint32_t number, const voxel_summary& s) {
    out.points[number] = {s.position[0], s.position[1], s.position[2]};
    if constexpr (Colored) out.colors[number] = s.color;
  }
};

/// Loads the points of [begin, end) into `block`, up to its capacity at a time, and calls `f(from, count)` for the
/// points [from, from + count).
template <class S, int CubeBits, class F>
void for_each_block(point_block<S, CubeBits>& block, const basic_point_view<S>& points, std::size_t begin,
                    std::size_t end, F&& f) {
  for (std::size_t from = begin; from != end;) {
    const std::size_t count = std::min(end - from, block.capacity);
    block.assign(count, [&](std::size_t i) { return points[from + i]; });
    f(from, count);
    from += count;
  }
}

/// One pass with one table, initially sized for `expected` voxels. Returns false if there are more than `most` voxels.
template <std::floating_point S, bool Colored>
[[nodiscard]] bool fold_in_one_table(const basic_point_view<S>& points, double size, std::size_t expected,
                                     std::size_t most, centroid_fold<Colored>& fold) {
  voxel_table<typename centroid_fold<Colored>::record> table{fold.empty};
  point_block<S> block{size};
  const std::size_t count = points.size();
  table.clear(expected);
  constexpr std::size_t piece = 4096;
  for (std::size_t begin = 0; begin < count; begin += piece) {
    for_each_block(block, points, begin, std::min(count, begin + piece), [&](std::size_t from, std::size_t taken) {
      table.reserve_more(taken, std::min(count, most + piece));
      table.expect(block.hashes(taken));
      for (std::size_t i = 0; i != taken; ++i) {
        if (!is_cell(block.key(i))) continue;
        const auto index = static_cast<std::uint32_t>(from + i);
        table.update(block.key(i), block.hash(i), index,
                     [&](auto& record) { fold.add(record, index, block.point(i)); });
      }
    });
    if (table.rows().size() > most) return false;
  }
  fold.resize(table.rows().size());
  std::uint32_t number = 0;
  for (const auto& row : table.rows()) fold.put(number++, fold.summary(row.record));
  return true;
}

/// A cloud partitioned so that each part holds all points of its voxels, in their original order, and usually few
/// enough voxels for a table that fits into the cache. A part is a pseudo-random selection of cubes of 8^3 voxels, so
/// that neighbours in the cloud are mostly neighbours in a part.
///
/// Source: Shatdal, Kant, Naughton, "Cache conscious algorithms for relational query processing", VLDB 1994
/// (partitioning before hashing).
template <std::floating_point S, bool Colored>
class voxel_parts {
  using fold_type = centroid_fold<Colored>;
  using table_type = voxel_table<typename fold_type::record>;

 public:
  voxel_parts(const basic_point_view<S>& points, double size)
      : points_{points},
        size_{size},
        count_{points.size()},
        bits_{std::clamp(std::bit_width(count_ / points_of_part), std::size_t{4}, std::size_t{11})},
        starts_((std::size_t{1} << bits_) + 1),
        part_of_{std::make_unique_for_overwrite<std::uint16_t[]>(count_)} {}

  template <execution_policy Policy>
  void fold(const Policy& policy, fold_type& fold) {
    distribute(policy);
    std::unique_ptr<rgb8[]> colors;
    if constexpr (Colored) colors = std::make_unique_for_overwrite<rgb8[]>(starts_.back());
    std::vector<std::uint32_t> voxels(parts());
    // Use few chunks, because each has its own table.
    const std::size_t chunks = policy.threads() <= 1 ? 1 : std::size_t{8} * policy.threads();
    const std::size_t width = std::max<std::size_t>(1, parts() / chunks);
    for_each_chunk(policy, parts(), width, [&](std::size_t begin, std::size_t end) {
      table_type table{fold.empty};
      point_block<S> block{size_};
      for (std::size_t part = begin; part != end; ++part) {
        table.clear(std::min<std::size_t>(starts_[part + 1] - starts_[part], usual_voxels));
        fill(table, block, part, fold);
        std::size_t at = starts_[part];
        for (const auto& row : table.rows()) {  // the summaries overwrite the points
          const voxel_summary summary = fold.summary(row.record);
          if constexpr (Colored) colors[at] = summary.color;
          entries_[at++] = {std::bit_cast<std::array<std::uint32_t, 3>>(summary.position), row.first};
          part_of_[row.first] = first_of_voxel;
        }
        voxels[part] = static_cast<std::uint32_t>(table.rows().size());
      }
    });
    const first_points firsts{policy, part_of_.get(), count_};
    fold.resize(firsts.count());
    for_each_index(policy, parts(), 8, [&](std::size_t part) {
      for (std::size_t at = starts_[part]; at != starts_[part] + voxels[part]; ++at)
        fold.put(firsts.voxel_number(entries_[at].index),
                 {std::bit_cast<std::array<float, 3>>(entries_[at].words), Colored ? colors[at] : rgb8{}});
    });
  }

 private:
  static constexpr std::size_t points_of_part = 2048;
  static constexpr std::size_t usual_voxels = 2 * points_of_part;  ///< usual maximum number of voxels of a part
  static constexpr std::size_t grain = std::size_t{1} << 15U;
  static constexpr std::uint16_t no_part = 0xffff;
  static constexpr std::uint16_t first_of_voxel = 0xfffe;
  static constexpr bool keeps_coordinates = std::is_same_v<S, float>;

  /// First a point: its coordinates (if float) or its voxel key (if double), and its index. After its part has been
  /// accumulated, a voxel: its centroid and the index of its first point.
  struct entry {
    std::array<std::uint32_t, 3> words;
    std::uint32_t index;
  };

  /// Assigns indices to voxels in the order of their first points.
  class first_points {
   public:
    template <execution_policy Policy>
    first_points(const Policy& policy, const std::uint16_t* marks, std::size_t count)
        : words_((count + 63) / 64), before_(words_.size() + 1) {
      for_each_index(policy, words_.size(), 1024, [&](std::size_t w) {
        std::uint64_t word = 0;
        const std::size_t end = std::min<std::size_t>(64, count - 64 * w);
        for (std::size_t i = 0; i != end; ++i) word |= std::uint64_t{marks[64 * w + i] == first_of_voxel} << i;
        words_[w] = word;
      });
      for (std::size_t w = 0; w != words_.size(); ++w) before_[w + 1] = before_[w] + count_ones(words_[w]);
    }
    [[nodiscard]] std::size_t count() const noexcept { return before_.back(); }
    [[nodiscard]] std::uint32_t voxel_number(std::uint32_t first) const noexcept {
      const std::uint64_t below = (std::uint64_t{1} << (first % 64)) - 1;
      return before_[first / 64] + count_ones(words_[first / 64] & below);
    }

   private:
    std::vector<std::uint64_t> words_;
    std::vector<std::uint32_t> before_;
  };

  [[nodiscard]] std::size_t parts() const noexcept { return starts_.size() - 1; }

  template <execution_policy Policy>
  void distribute(const Policy& policy) {
    // Count the points of each piece of the cloud for each part, then compute the offsets.
    std::vector<std::uint32_t> at((count_ + grain - 1) / grain * parts());
    for_each_chunk(policy, count_, grain, [&](std::size_t begin, std::size_t end) {
      const auto counts = at.begin() + static_cast<std::ptrdiff_t>(begin / grain * parts());
      point_block<S, 3> block{size_};
      for_each_block(block, points_, begin, end, [&](std::size_t from, std::size_t taken) {
        for (std::size_t i = 0; i != taken; ++i) {
          std::uint16_t& part = part_of_[from + i];
          part = is_cell(block.key(i)) ? static_cast<std::uint16_t>(block.hash(i) >> (32 - bits_)) : no_part;
          if (part != no_part) ++counts[part];
        }
      });
    });
    std::uint32_t sum = 0;
    for (std::size_t part = 0; part != parts(); ++part) {
      starts_[part] = sum;
      for (std::size_t i = part; i < at.size(); i += parts()) sum += std::exchange(at[i], sum);
    }
    starts_[parts()] = sum;

    memory_ = table_memory<entry>{sum};
    entries_ = memory_.values().data();
    for_each_chunk(policy, count_, grain, [&](std::size_t begin, std::size_t end) {
      const auto next = at.begin() + static_cast<std::ptrdiff_t>(begin / grain * parts());
      if constexpr (keeps_coordinates) {
        for (std::size_t i = begin; i != end; ++i) {
          if (part_of_[i] == no_part) continue;
          const auto p = points_[i];
          entries_[next[part_of_[i]]++] = {std::bit_cast<std::array<std::uint32_t, 3>>(p),
                                           static_cast<std::uint32_t>(i)};
        }
      } else {
        point_block<S> block{size_};
        for_each_block(block, points_, begin, end, [&](std::size_t from, std::size_t taken) {
          for (std::size_t i = 0; i != taken; ++i) {
            const std::uint16_t part = part_of_[from + i];
            if (part == no_part) continue;
            entries_[next[part]++] = {std::bit_cast<std::array<std::uint32_t, 3>>(block.key(i)),
                                      static_cast<std::uint32_t>(from + i)};
          }
        });
      }
    });
  }

  void fill(table_type& table, point_block<S>& block, std::size_t part, const fold_type& fold) const {
    const std::size_t end = starts_[part + 1];
    const auto add = [&](const voxel_key& key, std::uint32_t hash, std::uint32_t index,
                         const std::array<double, 3>& p) {
      table.update(key, hash, index, [&](auto& record) { fold.add(record, index, p); });
    };
    if constexpr (keeps_coordinates) {
      for (std::size_t from = starts_[part]; from != end;) {
        const std::size_t count = std::min<std::size_t>(end - from, block.capacity);
        block.assign(count,
                     [&](std::size_t i) { return std::bit_cast<std::array<float, 3>>(entries_[from + i].words); });
        table.reserve_more(count, end - starts_[part]);
        table.expect(block.hashes(count));
        for (std::size_t i = 0; i != count; ++i)
          add(block.key(i), block.hash(i), entries_[from + i].index, block.point(i));
        from += count;
      }
    } else {
      for (std::size_t at = starts_[part]; at != end; ++at) {
        const auto key = std::bit_cast<voxel_key>(entries_[at].words);
        const std::uint32_t index = entries_[at].index;
        table.reserve_more(1, end - starts_[part]);
        add(key, mixed_key(key), index, coordinates<double>(points_[index]));
      }
    }
  }

  const basic_point_view<S>& points_;
  double size_;
  std::size_t count_;
  std::size_t bits_;
  std::vector<std::uint32_t> starts_;  ///< start of each part in the entries, and the end
  std::unique_ptr<std::uint16_t[]>
      part_of_;  ///< part of each point; later, `first_of_voxel` for the first point of each voxel
  table_memory<entry> memory_;
  entry* entries_ = nullptr;
};

/// Estimates the number of occupied voxels from a sample of the points, erring on the high side, but at most the number
/// of points. If the sample contains f1 voxels once and f2 voxels twice, it misses at least f1^2 / (2 f2) voxels, and
/// about twice that number if the numbers of points per voxel vary. @pre the cloud is not empty
///
/// Source: A. Chao, "Nonparametric estimation of the number of classes in a population", Scandinavian Journal of
/// Statistics 11, 1984.
template <std::floating_point S>
[[nodiscard]] std::size_t estimated_voxels(const basic_point_view<S>& points, double size) {
  const std::size_t count = points.size();
  const std::size_t sample = std::min<std::size_t>(4096, count / 64 + 1), stretch = count / sample;
  struct times {
    std::uint32_t n;
  };
  voxel_table<times> table{{}};
  table.clear(sample);
  point_block<S> block{size};
  for (std::size_t from = 0; from != sample;) {
    const std::size_t taken = std::min<std::size_t>(sample - from, block.capacity);
    block.assign(taken, [&](std::size_t i) {
      const std::size_t at = (from + i) * stretch + mix64(from + i) % stretch;
      return points[at];
    });
    for (std::size_t i = 0; i != taken; ++i)
      if (is_cell(block.key(i))) table.update(block.key(i), block.hash(i), 0, [](times& t) { ++t.n; });
    from += taken;
  }
  std::size_t in_voxels = 0, once = 0, twice = 0;
  for (const auto& row : table.rows()) {
    in_voxels += row.record.n;
    once += row.record.n == 1;
    twice += row.record.n == 2;
  }
  const std::size_t at_most = std::min(count, in_voxels * stretch + count / 16);  // some points have no voxel
  return twice == 0 ? at_most : std::min(at_most, 2 * table.rows().size() + once * once / twice);
}

/// Accumulates the points of every voxel, see `centroid_fold`; the same result for every policy. Skips points without a
/// cell. O(n). Memory: for at most 2^17 points on one thread, one table; otherwise 20 bytes per point, 25 with colours,
/// and temporarily a table that turns out to be too small or the table of the largest part.
/// @pre size > 0, fewer than 2^32 - 1 points
template <execution_policy Policy, std::floating_point S, bool Colored>
void fold_voxels(const Policy& policy, const basic_point_view<S>& points, double size, centroid_fold<Colored> fold) {
  constexpr std::size_t small = std::size_t{1} << 12U, medium = std::size_t{1} << 17U;
  const std::size_t count = points.size();
  if (count <= small || policy.threads() <= 1) {
    const std::size_t expected = count <= small ? count : estimated_voxels(points, size);
    if ((count <= medium || expected <= medium / 2) && fold_in_one_table(points, size, expected, medium, fold)) return;
  }
  voxel_parts<S, Colored>{points, size}.fold(policy, fold);
}

}  // namespace orbis::cloud::detail

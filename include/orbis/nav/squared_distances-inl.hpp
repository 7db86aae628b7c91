// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of squared_distances.hpp.
#pragma once

#include <cmath>
#include <functional>
#include <type_traits>

#include <orbis/core/inline.hpp>
#include <orbis/nav/detail/field/slice_kernels.hpp>
#include <orbis/nav/squared_distances.hpp>

namespace orbis::nav {

ORBIS_LAZY_INLINE squared_distances::squared_distances(int reach, std::uint32_t cells, bool elsewhere_is_obstacle)
    : squared_distance_view{reach, cells, elsewhere_is_obstacle},
      kernels_{detail::best_slice_code()},
      bricks_in_reach_{(reach + 7) / 8},
      squares_pad_{8 * bricks_in_reach_ + 16},
      squares_(static_cast<std::size_t>(8 * (2 * squares_pad_ + 8))) {
  assert(1 <= reach && reach <= detail::max_reach && cells % 8 == 0);
  for (int d = -squares_pad_; d != squares_pad_ + 8; ++d) {
    const int square = std::min(d * d, int{detail::far_away});
    std::fill_n(squares_.data() + 8 * (d + squares_pad_), 8, static_cast<std::uint16_t>(square));
  }
  for (std::size_t bits = 0; bits != nearest_bit_.size(); ++bits)
    for (int x = 0; x != 8; ++x) {
      int best = far_along;
      for (int b = 0; b != 8; ++b)
        if ((bits >> b & 1U) != 0) best = std::min(best, std::abs(b - x));
      nearest_bit_[bits][static_cast<std::size_t>(x)] = static_cast<std::uint8_t>(best);
    }
}

ORBIS_LAZY_INLINE std::uint64_t squared_distances::max_added_bricks(const voxel_cube& cube) const noexcept {
  const auto volume = [](std::int64_t edge) { return edge <= 0 ? 0 : static_cast<std::uint64_t>(edge * edge * edge); };
  const std::int64_t edge = std::int64_t{octree::node_cells(cube.level)} / 8, reach = bricks_in_reach_;
  return elsewhere_ == 0 ? volume(edge) - volume(edge - 2 * reach) : volume(edge + 2 * reach) - volume(edge);
}

ORBIS_LAZY_INLINE void squared_distances::begin(std::span<const voxel_cube> cubes) {
  assert(stages_.empty() && !has_cubes());
  begin_update();
  for (const voxel_cube& c : cubes) directory_.add_cube(place_of(octree::node_key(c.low, c.level)), c.level - 3);
  // Bricks near a face are computed, except bricks full of obstacles: their voxels have one value, so they are not
  // stored.
  const auto work_out = [&](const detail::brick_place& p) {
    const std::uint32_t found = directory_.find(p);
    if (!directory_.is_inside(p) || is_brick(found) || is_full(found)) return;
    const std::uint32_t i = make(p);
    stages_[i].stale_plane = stages_[i].stale_space = 0xff;
    stale_plane_.push_back(i);
    stale_space_.push_back(i);
    for (std::size_t row = 0; row != 64; ++row) list_row(p, row);
  };
  for (const voxel_cube& c : cubes) {
    const detail::brick_place low = place_of(octree::node_key(c.low, c.level));
    const int edge = static_cast<int>(octree::node_cells(c.level) / 8), reach = bricks_in_reach_;
    const int first = elsewhere_ == 0 ? 0 : -reach, last = elsewhere_ == 0 ? edge - 1 : edge + reach - 1;
    const auto is_near = [&](int i) { return i < first + reach || i > last - reach; };
    for (int z = first; z <= last; ++z)
      for (int y = first; y <= last; ++y)
        for (int x = first; x <= last; ++x) {
          // Skip the bricks between the faces.
          if (x == first + reach && !is_near(x) && !is_near(y) && !is_near(z)) x = last - reach + 1;
          work_out({low.x + x, low.y + y, low.z + z});
        }
  }
  finish_update();
}

ORBIS_LAZY_INLINE void squared_distances::update(std::span<const octant_obstacles> octants) {
  begin_update();
  set_obstacles(octants);
  finish_update();
}

ORBIS_LAZY_INLINE void squared_distances::begin_update() {
  rows_.clear();
  along_.clear();
  stale_plane_.clear();
  stale_space_.clear();
  needless_.clear();
  used_kept_ = 0;
}

ORBIS_LAZY_INLINE void squared_distances::finish_update() {
  std::sort(rows_.begin(), rows_.end());
  rows_.erase(std::unique(rows_.begin(), rows_.end()), rows_.end());
  update_rows();
  spread_along_y();
  spread_along_z();
  for (std::size_t i = 0; i != used_kept_; ++i) stages_[kept_[i].brick].kept = none;
  remove_needless();
  // Keep buffers large enough for typical updates, so that they allocate nothing.
  constexpr std::size_t few = std::size_t{1} << 20U;
  const std::size_t field = stages_.size() * (sizeof(stages) + sizeof(brick_values));
  if (buffer_bytes() > std::max(few, field / 8)) release_buffers();
}

ORBIS_LAZY_INLINE std::uint32_t squared_distances::make(const detail::brick_place& p) {
  const std::uint32_t found = directory_.find(p);
  if (is_brick(found)) return found;
  const std::uint16_t value = value_without_brick(found);
  const auto number = static_cast<std::uint32_t>(stages_.size());
  directory_.set(p, number);
  stages& s = stages_.emplace_back();
  s.plane.fill(value);
  s.along.fill(value == 0 ? std::uint8_t{0} : far_along);
  s.obstacles.fill(row_bits(found));
  s.octants.fill(value == 0 ? ~std::uint64_t{0} : 0);
  s.plane_top.fill(value);
  s.space_top.fill(value);
  brick_values values;
  values.fill(value);
  values_.push_back(values);
  places_.push_back(p);
  return number;
}

/// Returns true if removing a brick would not change any value. It is sufficient to compare the distances with the
/// value that the brick has when it is not stored: if they are all 0, all voxels are obstacles; if they are all far, so
/// are the other stages, whose values are never less than the distances.
ORBIS_LAZY_INLINE bool squared_distances::is_needless(std::uint32_t brick) const {
  const std::uint16_t without = value_without_brick(directory_.without_number(places_[brick]));
  const stages& s = stages_[brick];
  for (const std::uint16_t top : s.space_top)
    if (top != without) return false;
  const brick_values& values = values_[brick];
  return std::all_of(values.begin(), values.end(), [&](std::uint16_t v) { return v == without; });
}

ORBIS_LAZY_INLINE void squared_distances::remove_needless() {
  needless_.insert(needless_.end(), stale_space_.begin(), stale_space_.end());
  std::erase_if(needless_, [&](std::uint32_t i) { return !is_needless(i); });
  // Remove in descending order, so that the index of the brick that replaces a removed one stays valid.
  std::sort(needless_.begin(), needless_.end(), std::greater{});
  needless_.erase(std::unique(needless_.begin(), needless_.end()), needless_.end());
  for (const std::uint32_t i : needless_) remove(i);
}

/// Moves the last brick to the index of the removed one.
ORBIS_LAZY_INLINE void squared_distances::remove(std::uint32_t brick) {
  const auto last = static_cast<std::uint32_t>(stages_.size() - 1);
  directory_.erase(places_[brick]);
  if (brick != last) {
    directory_.set(places_[last], brick);
    stages_[brick] = stages_[last];
    values_.writable(brick) = values_[last];
    places_.writable(brick) = places_[last];
  }
  stages_.pop_back();
  values_.resize(last);
  places_.resize(last);
}

ORBIS_LAZY_INLINE std::size_t squared_distances::buffer_bytes() const noexcept {
  return kept_.memory_bytes() + rows_.capacity() * sizeof(std::uint64_t) + along_.capacity() * sizeof(along_change) +
         (stale_plane_.capacity() + stale_space_.capacity() + needless_.capacity() + line_.capacity()) *
             sizeof(std::uint32_t) +
         line_bits_.capacity() + left_.capacity() + right_.capacity();
}

ORBIS_LAZY_INLINE void squared_distances::release_buffers() {
  const auto release = [](auto&... buffers) { ((buffers = std::remove_cvref_t<decltype(buffers)>()), ...); };
  release(rows_, along_, kept_, stale_plane_, stale_space_, needless_, line_, line_bits_, left_, right_);
}

ORBIS_LAZY_INLINE int squared_distances::offer_reach(std::uint16_t least) const noexcept {
  const int left = bound() - least;
  if (left < 0) return -1;
  int r = static_cast<int>(std::sqrt(static_cast<float>(left)));
  while (r * r > left) --r;
  while ((r + 1) * (r + 1) <= left) ++r;
  return r;
}

// -- the obstacles

/// Copies the masks, and lists the rows of eight voxels that changed.
ORBIS_LAZY_INLINE void squared_distances::set_obstacles(std::span<const octant_obstacles> octants) {
  detail::brick_place last{-1, -1, -1};
  std::uint32_t number = none;
  for (const octant_obstacles& o : octants) {
    const detail::brick_place p = place_of(o.octant);
    assert(directory_.is_inside(p));
    if (p != last) number = directory_.find(last = p);
    if (!is_brick(number)) {
      if (o.mask == (is_full(number) ? ~std::uint64_t{0} : 0)) continue;
      number = make(p);
    }
    std::uint64_t& known =
        stages_[number].octants[(o.octant.x >> 2U & 1U) | (o.octant.y >> 1U & 2U) | (o.octant.z & 4U)];
    if (known == o.mask) continue;
    known = o.mask;
    std::array<std::uint8_t, 64>& rows = stages_[number].obstacles;
    const std::uint32_t x = o.octant.x & 4U, y = o.octant.y & 4U, z = o.octant.z & 4U;
    for (std::uint32_t i = 0; i != 16; ++i) {
      // In a Morton code, x has bits 0 and 3, y bits 1 and 4, z bits 2 and 5.
      const std::uint32_t row_y = i & 3U, row_z = i >> 2U;
      const std::uint32_t low = (row_y & 1U) << 1U | (row_y & 2U) << 3U | (row_z & 1U) << 2U | (row_z & 2U) << 4U;
      const auto four = static_cast<std::uint8_t>((o.mask >> low & 3U) | (o.mask >> (low + 8) & 3U) << 2U);
      const std::uint32_t at = (z + row_z) * 8 + y + row_y;
      const auto now = static_cast<std::uint8_t>((rows[at] & ~(15U << x)) | static_cast<unsigned>(four << x));
      if (now == rows[at]) continue;
      rows[at] = now;
      list_row(p, at);
    }
  }
}

/// `row`: z * 8 + y in the brick.
ORBIS_LAZY_INLINE void squared_distances::list_row(const detail::brick_place& p, std::size_t row) {
  // Voxel coordinates have at most 21 bits, brick coordinates 18.
  rows_.push_back(static_cast<std::uint64_t>(p.z * 8 + static_cast<int>(row >> 3U)) << 39U |
                  static_cast<std::uint64_t>(p.y * 8 + static_cast<int>(row & 7U)) << 18U |
                  static_cast<std::uint64_t>(p.x));
}

// -- along x

ORBIS_LAZY_INLINE void squared_distances::update_rows() {
  const std::span<const std::uint64_t> rows{rows_};
  for (std::size_t first = 0; first != rows.size();) {
    // Rows of a line whose distances may depend on each other are computed together.
    std::size_t last = first + 1;
    while (last != rows.size() && rows[last] - rows[last - 1] <= static_cast<std::uint64_t>(2 * bricks_in_reach_ + 1) &&
           rows[last] >> 18U == rows[first] >> 18U)
      ++last;
    update_line(rows.subspan(first, last - first));
    first = last;
  }
}

ORBIS_LAZY_INLINE void squared_distances::update_line(std::span<const std::uint64_t> rows) {
  const auto brick_x = [](std::uint64_t row) { return static_cast<int>(row & 0x3ffffU); };
  const auto y = static_cast<int>(rows.front() >> 18U & 0x1fffffU), z = static_cast<int>(rows.front() >> 39U);
  const int first = brick_x(rows.front()) - bricks_in_reach_, last = brick_x(rows.back()) + bricks_in_reach_;
  const int from = first - bricks_in_reach_;  // first of the rows within reach of `first`
  const auto count = static_cast<std::size_t>(last + bricks_in_reach_ - from + 1);
  const auto row = static_cast<std::uint32_t>((z & 7) * 8 + (y & 7));
  line_.resize(count);
  line_bits_.resize(count);
  left_.resize(count);
  right_.resize(count);
  detail::brick_directory::cursor bricks{directory_};
  for (std::size_t i = 0; i != count; ++i) {
    line_[i] = bricks.find({from + static_cast<int>(i), y >> 3, z >> 3});
    line_bits_[i] = is_brick(line_[i]) ? stages_[line_[i]].obstacles[row] : row_bits(line_[i]);
  }
  // For each group of eight voxels, the distance from the voxel before (or after) it to the nearest obstacle on that
  // side.
  constexpr int beyond = far_along - 1;
  int d = beyond;
  for (std::size_t i = 0; i != count; ++i) {
    left_[i] = static_cast<std::uint8_t>(d);
    d = line_bits_[i] != 0 ? std::countl_zero(line_bits_[i]) : std::min(d + 8, beyond);
  }
  d = beyond;
  for (std::size_t i = count; i-- != 0;) {
    right_[i] = static_cast<std::uint8_t>(d);
    d = line_bits_[i] != 0 ? std::countr_zero(line_bits_[i]) : std::min(d + 8, beyond);
  }
  for (int at = first; at <= last; ++at) {
    const auto i = static_cast<std::size_t>(at - from);
    std::array<std::uint8_t, 8> now = nearest_bit_[line_bits_[i]];
    for (int x = 0; x != 8; ++x) {
      std::uint8_t& v = now[static_cast<std::size_t>(x)];
      const int nearest = std::min({int{v}, left_[i] + 1 + x, right_[i] + 8 - x});
      v = nearest <= reach_ ? static_cast<std::uint8_t>(nearest) : far_along;
    }
    const auto after = std::bit_cast<std::uint64_t>(now);
    std::uint32_t number = line_[i];
    if (!is_brick(number)) {
      const detail::brick_place p{at, y >> 3, z >> 3};
      if (is_full(number) || after == ~std::uint64_t{0} || !directory_.is_inside(p)) continue;
      number = make(p);
    }
    std::uint8_t* const stored = stages_[number].along.data() + 8 * row;
    std::uint64_t before = 0;
    std::memcpy(&before, stored, 8);
    if (before == after) continue;
    std::memcpy(stored, &after, 8);
    along_.push_back({number, row, before, after});
  }
}

// -- along y

namespace detail {

/// Sets each of the eight rows of the offer to the squares of the distances along x in `from` where they are less than
/// in `other`, and to `no_offer` elsewhere.
inline void offer_row(std::uint64_t from, std::uint64_t other, slice_offer& out) noexcept {
  const auto a = std::bit_cast<std::array<std::uint8_t, 8>>(from);
  const auto b = std::bit_cast<std::array<std::uint8_t, 8>>(other);
  std::array<std::uint16_t, 8> row;
  out.least = no_offer;
  for (std::size_t x = 0; x != 8; ++x) {
    row[x] = a[x] < b[x] ? static_cast<std::uint16_t>(a[x] * a[x]) : no_offer;
    out.least = std::min(out.least, row[x]);
  }
  for (std::size_t y = 0; y != 8; ++y) std::copy(row.begin(), row.end(), out.value.begin() + std::ptrdiff_t(8 * y));
}

}  // namespace detail

ORBIS_LAZY_INLINE void squared_distances::keep_plane(std::uint32_t brick, unsigned changed) {
  stages& s = stages_[brick];
  if (s.kept == none) {
    if (used_kept_ == kept_.size()) kept_.emplace_back();
    kept_[used_kept_].brick = brick;
    kept_[used_kept_].changed = 0;
    s.kept = static_cast<std::uint32_t>(used_kept_++);
  }
  kept_plane& kept = kept_[s.kept];
  for (unsigned fresh = changed & ~unsigned{kept.changed}; fresh != 0; fresh &= fresh - 1) {
    const int z = std::countr_zero(fresh);
    std::copy_n(s.plane.begin() + 64 * z, 64, kept.plane.begin() + 64 * z);
  }
  kept.changed |= static_cast<std::uint8_t>(changed);
}

ORBIS_LAZY_INLINE void squared_distances::spread_along_y() {
  detail::slice_offer offer;
  // Calls visit(position of a target brick, z in the brick, squares, the smallest square) for the slices within reach
  // of the row.
  const auto for_each_target = [&](const along_change& c, auto&& visit) {
    const int range = offer_reach(offer.least);
    const detail::brick_place p = places_[c.brick];
    const int z = static_cast<int>(c.row >> 3U), y = p.y * 8 + static_cast<int>(c.row & 7U);
    for (int by = (y - range) >> 3; by <= (y + range) >> 3; ++by) {
      const int gap = std::max({by * 8 - y, y - by * 8 - 7, 0});
      visit(detail::brick_place{p.x, by, p.z}, z, squares(by * 8 - y), gap * gap);
    }
  };
  std::optional<detail::brick_directory::cursor> bricks{directory_};
  for (const along_change& c : along_) {  // distances that increased
    detail::offer_row(c.before, c.after, offer);
    if (offer.least == detail::no_offer) continue;
    for_each_target(c, [&](const detail::brick_place& p, int z, const std::uint16_t* squares, int gap) {
      const std::uint32_t i = bricks->find(p);
      if (!is_brick(i)) return;
      stages& s = stages_[i];
      if ((s.stale_plane >> z & 1) != 0 || offer.least + gap > s.plane_top[static_cast<std::size_t>(z)] ||
          !kernels_.equal_rows(s.plane.data() + 64 * z, &offer, squares))
        return;
      if (s.stale_plane == 0) stale_plane_.push_back(i);
      s.stale_plane |= static_cast<std::uint8_t>(1U << z);
    });
  }
  for (const std::uint32_t i : stale_plane_) {
    keep_plane(i, stages_[i].stale_plane);
    for (int z = 0; z != 8; ++z)
      if ((stages_[i].stale_plane >> z & 1) != 0) make_plane(i, z);
  }
  for (const along_change& c : along_) {  // distances that decreased
    detail::offer_row(c.after, c.before, offer);
    if (offer.least == detail::no_offer) continue;
    for_each_target(c, [&](const detail::brick_place& p, int z, const std::uint16_t* squares, int gap) {
      std::uint32_t i = bricks->find(p);
      if (!is_brick(i)) {
        if (is_full(i) || !directory_.is_inside(p)) return;
        i = make(p);
        bricks.emplace(directory_);
      }
      stages& s = stages_[i];
      std::uint16_t& top = s.plane_top[static_cast<std::size_t>(z)];
      if ((s.stale_plane >> z & 1) != 0 || offer.least + gap >= top) return;
      alignas(64) detail::slice lowered;
      if (!kernels_.lower_rows(s.plane.data() + 64 * z, &offer, squares, bound(), lowered.data(), &top)) return;
      keep_plane(i, 1U << static_cast<unsigned>(z));
      std::copy(lowered.begin(), lowered.end(), s.plane.begin() + 64 * z);
    });
  }
  for (const std::uint32_t i : stale_plane_) stages_[i].stale_plane = 0;
}

/// Computes a slice of `plane` from the rows within reach.
ORBIS_LAZY_INLINE void squared_distances::make_plane(std::uint32_t brick, int z) {
  const detail::brick_place p = places_[brick];
  alignas(64) detail::slice best;
  best.fill(detail::far_away);
  std::uint16_t top = kernels_.add_rows(best.data(), stages_[brick].along.data() + 64 * z, squares(0));
  for (int side = -1; side <= 1; side += 2) {
    for (int step = 1; step <= bricks_in_reach_; ++step) {
      const int gap = 8 * step - 7;
      if (gap * gap >= top) break;
      const std::uint32_t other = directory_.find({p.x, p.y + side * step, p.z});
      if (is_brick(other)) {
        top = kernels_.add_rows(best.data(), stages_[other].along.data() + 64 * z, squares(-8 * side * step));
      } else if (is_full(other)) {  // all voxels are obstacles, starting with the nearest row
        static constexpr std::array<std::uint8_t, 64> all{};
        top = kernels_.add_rows(best.data(), all.data(), squares(-8 * side * step));
        break;
      }
    }
  }
  stages& s = stages_[brick];
  // Combine as a slice without neighbours, to apply the bound.
  s.plane_top[static_cast<std::size_t>(z)] =
      kernels_.combine_slices(best.data(), nullptr, nullptr, 0, bound(), s.plane.data() + 64 * z);
}

// -- along z

ORBIS_LAZY_INLINE void squared_distances::spread_along_z() {
  detail::slice_offer offer;
  // Calls visit(position of a target brick, source position relative to its slices, first and last slice within reach).
  const auto for_each_target = [&](const detail::brick_place& p, int z, auto&& visit) {
    const int range = offer_reach(offer.least), at = p.z * 8 + z;
    for (int bz = (at - range) >> 3; bz <= (at + range) >> 3; ++bz)
      visit(detail::brick_place{p.x, p.y, bz}, at - bz * 8, std::max(at - range - bz * 8, 0),
            std::min(at + range - bz * 8, 7));
  };
  const auto for_each_change = [&](auto&& visit) {
    for (std::size_t k = 0; k != used_kept_; ++k) {
      const kept_plane& kept = kept_[k];
      const detail::brick_place p = places_[kept.brick];
      const std::uint16_t* const now = stages_[kept.brick].plane.data();
      for (unsigned changed = kept.changed; changed != 0; changed &= changed - 1) {
        const int z = std::countr_zero(changed);
        visit(p, z, kept.plane.data() + 64 * z, now + 64 * z);
      }
    }
  };
  std::optional<detail::brick_directory::cursor> bricks{directory_};
  for_each_change([&](const detail::brick_place& p, int z, const std::uint16_t* before, const std::uint16_t* after) {
    kernels_.choose_offer(before, after, &offer);
    if (offer.least == detail::no_offer) return;
    for_each_target(p, z, [&](const detail::brick_place& target, int from, int first, int last) {
      const std::uint32_t i = bricks->find(target);
      if (!is_brick(i)) return;
      stages& s = stages_[i];
      const unsigned stale =
          kernels_.equal_slices(values_[i].data(), s.space_top.data(), &offer, from, first, last, s.stale_space);
      if (stale == 0) return;
      if (s.stale_space == 0) stale_space_.push_back(i);
      s.stale_space |= static_cast<std::uint8_t>(stale);
    });
  });
  for (const std::uint32_t i : stale_space_) make_space(i, stages_[i].stale_space);
  for_each_change([&](const detail::brick_place& p, int z, const std::uint16_t* before, const std::uint16_t* after) {
    kernels_.choose_offer(after, before, &offer);
    if (offer.least == detail::no_offer) return;
    for_each_target(p, z, [&](const detail::brick_place& target, int from, int first, int last) {
      std::uint32_t i = bricks->find(target);
      if (!is_brick(i)) {
        if (is_full(i) || !directory_.is_inside(target)) return;
        i = make(target);
        bricks.emplace(directory_);
      }
      stages& s = stages_[i];
      const int nearest = from < first ? first - from : from > last ? from - last : 0;
      const std::uint16_t highest = *std::max_element(s.space_top.begin() + first, s.space_top.begin() + last + 1);
      if (offer.least + nearest * nearest >= highest) return;
      kernels_.lower_slices(values_.writable(i).data(), s.space_top.data(), &offer, from, first, last, s.stale_space,
                            bound());
      if ((elsewhere_ == 0 || has_cubes()) &&
          std::all_of(s.space_top.begin(), s.space_top.end(), [](auto t) { return t == 0; }))
        needless_.push_back(i);
    });
  });
  for (const std::uint32_t i : stale_space_) stages_[i].stale_space = 0;
}

/// Computes slices of the result from the planes within reach.
ORBIS_LAZY_INLINE void squared_distances::make_space(std::uint32_t brick, unsigned slices) {
  static constexpr detail::slice obstacles{};
  const detail::brick_place p = places_[brick];
  // The planes above and below the brick, from the nearest to the farthest.
  std::array<const std::uint16_t*, detail::max_reach + 8> above, below;
  for (int step = 1; step <= bricks_in_reach_; ++step) {
    const std::uint32_t up = directory_.find({p.x, p.y, p.z + step});
    const std::uint32_t down = directory_.find({p.x, p.y, p.z - step});
    for (int i = 0; i != 8; ++i) {
      const auto at = static_cast<std::size_t>(8 * (step - 1) + i);
      const auto without = [&](std::uint32_t found) { return is_full(found) ? obstacles.data() : nullptr; };
      above[at] = is_brick(up) ? stages_[up].plane.data() + 64 * i : without(up);
      below[at] = is_brick(down) ? stages_[down].plane.data() + 64 * (7 - i) : without(down);
    }
  }
  std::array<const std::uint16_t*, detail::max_reach + 1> before, behind;
  stages& s = stages_[brick];
  std::uint16_t* const values = values_.writable(brick).data();
  for (int z = 0; z != 8; ++z) {
    if ((slices >> z & 1U) == 0) continue;
    for (int d = 1; d <= reach_; ++d) {
      const auto i = static_cast<std::size_t>(d - 1);
      before[i] = z - d >= 0 ? s.plane.data() + 64 * (z - d) : below[static_cast<std::size_t>(d - z - 1)];
      behind[i] = z + d <= 7 ? s.plane.data() + 64 * (z + d) : above[static_cast<std::size_t>(z + d - 8)];
    }
    s.space_top[static_cast<std::size_t>(z)] = kernels_.combine_slices(s.plane.data() + 64 * z, before.data(),
                                                                       behind.data(), reach_, bound(), values + 64 * z);
  }
}

// -- queries

ORBIS_LAZY_INLINE std::optional<octree::voxel_key> squared_distances::nearest(const octree::voxel_key& k) const {
  const int target = squared(k);
  if (target == far) return std::nullopt;
  const auto x = static_cast<int>(k.x), y = static_cast<int>(k.y), z = static_cast<int>(k.z);
  const auto number_at = [&](int j, int l) { return directory_.find({x >> 3, j >> 3, l >> 3}); };
  for (int dz = 0; dz * dz <= target; ++dz)
    for (const int l : {z - dz, z + dz}) {
      const std::uint32_t n = number_at(y, l);
      const int plane = is_brick(n)
                            ? int{stages_[n].plane[static_cast<std::size_t>((l & 7) * 64 + (y & 7) * 8 + (x & 7))]}
                            : int{value_without_brick(n)};
      if (plane + dz * dz != target) continue;
      for (int dy = 0; dy * dy <= plane; ++dy)
        for (const int j : {y - dy, y + dy}) {
          const std::uint32_t m = number_at(j, l);
          const auto at = static_cast<std::size_t>((l & 7) * 64 + (j & 7) * 8 + (x & 7));
          const int along = is_brick(m) ? int{stages_[m].along[at]} : is_full(m) ? 0 : int{far_along};
          if (along == far_along || along * along + dy * dy != plane) continue;
          for (const int i : {x - along, x + along}) {
            const std::uint32_t b = directory_.find({i >> 3, j >> 3, l >> 3});
            const std::uint8_t bits =
                is_brick(b) ? stages_[b].obstacles[static_cast<std::size_t>((l & 7) * 8 + (j & 7))] : row_bits(b);
            if ((bits >> (i & 7) & 1) != 0)
              return octree::voxel_key{static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j),
                                       static_cast<std::uint32_t>(l)};
          }
        }
    }
  return std::nullopt;
}

ORBIS_LAZY_INLINE std::size_t squared_distances::memory_bytes() const noexcept {
  return directory_.memory_bytes() + values_.memory_bytes() + places_.memory_bytes() + stages_.memory_bytes() +
         squares_.capacity() * sizeof(std::uint16_t) + buffer_bytes();
}

}  // namespace orbis::nav

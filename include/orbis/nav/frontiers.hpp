// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The frontier of a map: the boundary between known free and unknown space, for exploration.
///
/// B. Yamauchi, "A frontier-based approach for autonomous exploration", CIRA 1997.
///
/// @code
///   map.track_changes();
///   orbis::nav::frontiers frontiers{map};
///   ...
///   map.integrate(depth, camera, T_world_camera);
///   frontiers.update(map);                                        // changes since the last update
///   for (const orbis::nav::frontier_cluster& c : frontiers.clusters({.min_size = 20})) consider(c.center);
/// @endcode
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/hash_index.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/detail/frontier/octant_bits.hpp>
#include <orbis/nav/detail/map_follower.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/octree/change_log.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/octants.hpp>

namespace orbis::nav {

/// Frontier voxels in an octant of 4x4x4 voxels: bit i is the voxel at index i of the Morton curve.
struct frontier_octant {
  octree::voxel_key octant;  ///< lowest voxel of the octant
  std::uint64_t mask = 0;
  friend bool operator==(const frontier_octant&, const frontier_octant&) = default;
};

/// A connected set of frontier voxels (26-connectivity).
struct frontier_cluster {
  std::size_t size = 0;                    ///< voxels
  vec3 center = zeros<vec3>();             ///< mean of the voxels' centres, metres
  octree::voxel_key voxel;                 ///< the frontier voxel whose centre is nearest to `center`
  std::vector<frontier_octant> octants{};  ///< all of its voxels, in Morton order
};

struct frontier_options {
  /// Maximum number of octants to examine on the faces of leaves of the map that are larger than 8x8x8 voxels: a file
  /// of a few bytes can describe a leaf as large as the grid, whose faces have 1.6e9 octants. Octants beyond the limit
  /// are omitted, see `is_complete`.
  std::size_t max_octants = std::size_t{1} << 24U;
};

struct cluster_options {
  std::size_t min_size = 1;  ///< minimum size of a cluster, voxels
};

/// The frontier of a map: the free voxels with an unknown voxel among their six face neighbours. Space outside the
/// grid does not count as unknown, because it cannot be observed. The frontier depends only on the current map, not on
/// the order of changes.
///
/// Octants are bit masks, so that a few bit operations compute the frontier of 64 voxels. Only nonempty masks are
/// stored, at 48 to 64 bytes each. Not thread-safe.
class frontiers {
 public:
  /// The frontier of an empty map.
  explicit frontiers(const octree::voxel_grid& grid, const frontier_options& options = {})
      : grid_{grid},
        last_{octree::morton_code({grid.cells() - 1, grid.cells() - 1, grid.cells() - 1}) >> 6U},
        options_{options} {}
  /// The frontier of `map`.
  template <planning_map Map>
  explicit frontiers(const Map& map, const frontier_options& options = {})
      : frontiers{map_access<Map>::grid(map), options} {
    update(map);
  }

  /// Updates the frontier from the map's change log, as distance_field::update does. O(octants that changed) on
  /// average; if the log does not reach back far enough, O(octants of the map + octants on the faces of its larger
  /// leaves). @pre every call passes the same map, with the same grid
  template <planning_map Map>
  void update(const Map& map) {
    assert(map_access<Map>::grid(map) == grid_);
    follower_.follow(map, changed_in(map), [&] { rebuild(map); });
  }
  /// Updates the frontier from a copy of the map, as distance_field::update does.
  /// @pre revision <= log.revision(); every call passes a copy of the same map, with the same grid
  template <planning_map Map>
  void update(const Map& copy, const octree::change_log& log, std::uint64_t revision) {
    assert(map_access<Map>::grid(copy) == grid_);
    follower_.follow(log, revision, changed_in(copy), [&] { rebuild(copy); });
  }
  /// Updates the frontier from the whole map, without the log.
  template <planning_map Map>
  void update_all(const Map& map) {
    assert(map_access<Map>::grid(map) == grid_);
    rebuild(map);
    follower_.mark_read(map);
  }

  /// Number of frontier voxels. O(1)
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  /// Returns false if leaves of the map were omitted because of `max_octants`: frontier voxels on their faces are
  /// missing, except next to later changes.
  [[nodiscard]] bool is_complete() const noexcept { return is_complete_; }
  /// Returns true if the voxel belongs to the frontier; false outside the grid. O(1)
  [[nodiscard]] bool contains(const octree::voxel_key& k) const noexcept {
    if (std::max({k.x, k.y, k.z}) >= grid_.cells()) return false;
    const std::uint64_t code = octree::morton_code(k);
    const std::uint32_t i = index_.find(code >> 6U);
    return i != hash_index::none && (found_[i].mask >> (code & 63U) & 1U) != 0;
  }
  /// All octants that contain a frontier voxel, in Morton order. O(n log n)
  [[nodiscard]] std::vector<frontier_octant> octants() const {
    std::vector<std::uint32_t> order(found_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), [&](auto a, auto b) { return found_[a].name < found_[b].name; });
    std::vector<frontier_octant> out;
    out.reserve(order.size());
    for (const std::uint32_t i : order) out.push_back({octree::morton_key(found_[i].name << 6U), found_[i].mask});
    return out;
  }
  /// The connected components of the frontier, the largest cluster first; clusters of equal size are in the order of
  /// their first voxels along the Morton curve. O(n log n)
  [[nodiscard]] std::vector<frontier_cluster> clusters(const cluster_options& options = {}) const;

  [[nodiscard]] const octree::voxel_grid& grid() const noexcept { return grid_; }
  /// Heap memory in bytes.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return index_.memory_bytes() + found_.capacity() * sizeof(entry) + stale_.capacity() * sizeof(std::uint64_t);
  }

 private:
  struct entry {
    std::uint64_t name;  ///< Morton code of the octant
    std::uint64_t mask;
  };

  /// Direct-mapped cache of a map's octants, addressed by the low bits of the Morton code, so that the octants of an
  /// aligned block do not evict each other.
  template <class Octants>
  class octant_cache {
   public:
    explicit octant_cache(Octants octants) : octants_{std::move(octants)} { names_.fill(~std::uint64_t{0}); }
    [[nodiscard]] const octree::octant_states& operator()(std::uint64_t name) {
      const auto i = static_cast<std::size_t>(name & (names_.size() - 1));
      if (names_[i] != name) {
        names_[i] = name;
        states_[i] = octants_(octree::morton_key(name << 6U));
      }
      return states_[i];
    }

   private:
    Octants octants_;
    std::array<std::uint64_t, 1024> names_;
    std::array<octree::octant_states, 1024> states_;
  };

  /// Calls `visit(code, is_above)` for the two octants beside the one with Morton code `name` along the axis, if they
  /// lie in the grid. `is_above`: std::true_type for the upper one, otherwise std::false_type.
  template <unsigned Axis, class Visit>
  void for_each_beside(std::uint64_t name, Visit&& visit) const {
    constexpr std::uint64_t one = std::uint64_t{1} << Axis, along = 0x1249249249249249U << Axis;
    const std::uint64_t here = name & along, others = name & ~along;
    if (here != 0) visit(others | ((here - one) & along), std::false_type{});
    if (here != (last_ & along)) visit(others | (((here | ~along) + one) & along), std::true_type{});
  }
  /// The frontier in an octant. `octants`: reader of the map.
  template <class Octants>
  [[nodiscard]] std::uint64_t frontier_in(Octants& octants, std::uint64_t name) const {
    const octree::octant_states here = octants(name);
    const std::uint64_t free = here.free();
    if (free == 0) return 0;
    std::uint64_t found = 0;  // voxels with an unknown neighbour
    const auto look = [&]<unsigned Axis>(std::integral_constant<unsigned, Axis>) {
      found |= detail::moved_up(~here.known, Axis) | detail::moved_down(~here.known, Axis);
      for_each_beside<Axis>(name, [&](std::uint64_t beside, auto is_above) {
        const std::uint64_t layer = free & (is_above ? detail::highest_layer(Axis) : detail::lowest_layer(Axis));
        if ((layer & ~found) == 0) return;
        const std::uint64_t unknown = ~octants(beside).known;
        found |= is_above ? detail::spilled_down(unknown, Axis) : detail::spilled_up(unknown, Axis);
      });
    };
    look(std::integral_constant<unsigned, 0>{});
    look(std::integral_constant<unsigned, 1>{});
    look(std::integral_constant<unsigned, 2>{});
    return free & found;
  }

  template <class Map>
  [[nodiscard]] auto changed_in(const Map& map) {
    return [this, &map](const octree::change_log& log, std::uint64_t since) {
      stale_.clear();
      log.for_each_since(since, [&](const octree::voxel_key& k, std::uint64_t mask) {
        const std::uint64_t name = octree::morton_code(k) >> 6U;
        stale_.push_back(name);
        const auto add = [&]<unsigned Axis>(std::integral_constant<unsigned, Axis>) {
          for_each_beside<Axis>(name, [&](std::uint64_t beside, auto is_above) {
            if ((mask & (is_above ? detail::highest_layer(Axis) : detail::lowest_layer(Axis))) != 0)
              stale_.push_back(beside);
          });
        };
        add(std::integral_constant<unsigned, 0>{});
        add(std::integral_constant<unsigned, 1>{});
        add(std::integral_constant<unsigned, 2>{});
      });
      std::sort(stale_.begin(), stale_.end());
      stale_.erase(std::unique(stale_.begin(), stale_.end()), stale_.end());
      octant_cache octants{map_access<Map>::octants(map)};
      for (const std::uint64_t name : stale_) set(name, frontier_in(octants, name));
      // Keep the capacity that typical updates need, so that they allocate nothing.
      constexpr std::size_t few = (std::size_t{1} << 20U) / sizeof(std::uint64_t);
      if (stale_.capacity() > std::max(few, 8 * found_.size())) stale_ = {};
    };
  }
  template <class Map>
  void rebuild(const Map& map) {
    index_.clear();
    found_.clear();
    size_ = 0;
    is_complete_ = true;
    std::uint64_t on_faces = 0;
    octant_cache octants{map_access<Map>::octants(map)};
    map_access<Map>::for_each_octant(map, [&](const octree::voxel_key& low, int level, const octree::octant_states& s) {
      if (s.free() == 0) return;
      const std::uint32_t cells = octree::node_cells(level);
      // All octants of a larger cube are equal: if all voxels are known, only its outermost octants can have frontier
      // voxels.
      const bool is_hollow = ~s.known == 0;
      if (level > 3) {
        const std::uint64_t n = cells / 4, inner = is_hollow ? n - 2 : 0;
        const std::uint64_t more = n * n * n - inner * inner * inner;
        if (on_faces + more > options_.max_octants) {
          is_complete_ = false;
          return;
        }
        on_faces += more;
      }
      const auto find_in = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
        const std::uint64_t name = octree::morton_code({low.x + x, low.y + y, low.z + z}) >> 6U;
        set(name, frontier_in(octants, name));
      };
      for (std::uint32_t z = 0; z != cells; z += 4)
        for (std::uint32_t y = 0; y != cells; y += 4) {
          const bool is_outermost = z == 0 || y == 0 || z + 4 == cells || y + 4 == cells;
          const std::uint32_t step = is_hollow && !is_outermost && cells > 4 ? cells - 4 : 4;
          for (std::uint32_t x = 0; x < cells; x += step) find_in(x, y, z);
        }
    });
  }
  void set(std::uint64_t name, std::uint64_t mask) {
    const std::uint32_t i = index_.find(name);
    if (i == hash_index::none) {
      if (mask == 0) return;
      index_.set(name, static_cast<std::uint32_t>(found_.size()));
      found_.push_back({name, mask});
    } else {
      size_ -= static_cast<std::size_t>(std::popcount(found_[i].mask));
      found_[i].mask = mask;
      if (mask == 0) {
        index_.erase(name);
        if (i + 1 != found_.size()) {
          found_[i] = found_.back();
          index_.set(found_[i].name, i);
        }
        found_.pop_back();
      }
    }
    size_ += static_cast<std::size_t>(std::popcount(mask));
  }

  octree::voxel_grid grid_;
  std::uint64_t last_;  ///< the Morton code of the grid's last octant
  frontier_options options_;
  bool is_complete_ = true;
  detail::map_follower follower_;
  hash_index index_;  ///< indices into found_
  std::vector<entry> found_;
  std::size_t size_ = 0;
  std::vector<std::uint64_t> stale_;
};

inline std::vector<frontier_cluster> frontiers::clusters(const cluster_options& options) const {
  // Finds the connected pieces within each octant, then joins the pieces that touch.
  struct piece {
    std::uint32_t octant;
    std::uint64_t mask;
    std::uint32_t parent;
  };
  const std::vector<frontier_octant> all = octants();
  std::vector<piece> pieces;
  std::vector<std::uint32_t> first(all.size() + 1);
  hash_index places;
  for (std::uint32_t i = 0; i != all.size(); ++i) {
    places.set(octree::morton_code(all[i].octant) >> 6U, i);
    for (std::uint64_t rest = all[i].mask; rest != 0;) {
      std::uint64_t grown = rest & (~rest + 1), before = 0;
      while (grown != before) before = std::exchange(grown, detail::dilated(grown, {0, 0, 0}) & rest);
      rest &= ~grown;
      const auto n = static_cast<std::uint32_t>(pieces.size());
      pieces.push_back({i, grown, n});
    }
    first[i + 1] = static_cast<std::uint32_t>(pieces.size());
  }
  const auto root = [&](std::uint32_t p) {
    while (pieces[p].parent != p) p = pieces[p].parent = pieces[pieces[p].parent].parent;
    return p;
  };
  for (std::uint32_t i = 0; i != all.size(); ++i)
    for (int direction = 14; direction != 27;
         ++direction) {  // 13 of the 26 directions; the opposite ones are tested from the neighbour
      const std::array<int, 3> offset{direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1};
      if (detail::dilated(all[i].mask, offset) == 0) continue;
      const auto along = [](std::uint32_t c, int by) { return c + static_cast<std::uint32_t>(4 * by); };
      const octree::voxel_key k{along(all[i].octant.x, offset[0]), along(all[i].octant.y, offset[1]),
                                along(all[i].octant.z, offset[2])};
      const bool is_inside = std::max({k.x, k.y, k.z}) < grid_.cells();  // coordinates below 0 wrap around
      const std::uint32_t other = is_inside ? places.find(octree::morton_code(k) >> 6U) : hash_index::none;
      if (other == hash_index::none) continue;
      for (std::uint32_t a = first[i]; a != first[i + 1]; ++a)
        for (std::uint32_t b = first[other]; b != first[other + 1]; ++b)
          if ((detail::dilated(pieces[a].mask, offset) & pieces[b].mask) != 0) {
            const std::uint32_t ra = root(a), rb = root(b);
            pieces[std::max(ra, rb)].parent = std::min(ra, rb);  // the root is the first piece
          }
    }

  std::vector<frontier_cluster> out;
  std::vector<std::uint32_t> number(pieces.size());
  for (std::uint32_t p = 0; p != pieces.size(); ++p) {
    const std::uint32_t r = root(p);
    if (r == p) {
      number[p] = static_cast<std::uint32_t>(out.size());
      out.emplace_back();
    }
    frontier_cluster& c = out[number[r]];
    c.size += static_cast<std::size_t>(std::popcount(pieces[p].mask));
    if (const octree::voxel_key& k = all[pieces[p].octant].octant; !c.octants.empty() && c.octants.back().octant == k)
      c.octants.back().mask |= pieces[p].mask;
    else
      c.octants.push_back({k, pieces[p].mask});
  }
  std::erase_if(out, [&](const frontier_cluster& c) { return c.size < options.min_size; });
  for (frontier_cluster& c : out) {
    const auto for_each_voxel = [&](auto&& visit) {
      for (const frontier_octant& o : c.octants)
        for (std::uint64_t rest = o.mask; rest != 0; rest &= rest - 1) {
          const octree::voxel_key in = octree::morton_key(static_cast<std::uint64_t>(std::countr_zero(rest)));
          visit(octree::voxel_key{o.octant.x + in.x, o.octant.y + in.y, o.octant.z + in.z});
        }
    };
    for_each_voxel([&](const octree::voxel_key& k) { c.center += grid_.center(k); });
    c.center /= static_cast<double>(c.size);
    double nearest = std::numeric_limits<double>::infinity();
    for_each_voxel([&](const octree::voxel_key& k) {
      const double away = squared_norm(grid_.center(k) - c.center);
      if (away < nearest) nearest = away, c.voxel = k;
    });
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const frontier_cluster& a, const frontier_cluster& b) { return a.size > b.size; });
  return out;
}

}  // namespace orbis::nav

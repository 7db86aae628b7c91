// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a few changes to a map: nodes, edits, transformations, evictions, scans, files. After
// each the map must be what the same changes make of a plain array of voxels, in all that can be asked of it,
// and a mirror that follows its log of changes must be able to keep up.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/decay.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/overlap.hpp>

#include "fuzz/octree.hpp"
#include "fuzz/source.hpp"

namespace {

using namespace orbis;
using fuzz::leaves_of;
using fuzz::map;
using fuzz::require;
using fuzz::source;
using fuzz::tree_leaf;
using octree::block;
using octree::voxel_key;
using model = map::model;
using voxel = std::optional<float>;

constexpr double resolution = 0.1;
constexpr int most_changes = 10;

/// The node at a level of the grid in which everything happens: all of it, or a small part.
struct window {
  int tree_depth;
  int level;
  voxel_key low;

  [[nodiscard]] std::uint32_t edge() const { return octree::node_cells(level); }
};

/// What a map is to be: every voxel of the window, octant by octant in Morton order, so that nodes are consecutive, and
/// the tree above, made of nothing but them. An octant whose voxels are all alike has one value, and the tree is
/// brought up to date only above octants that were changed: a window has more voxels than an input can change.
class voxels {
 public:
  enum class kind : std::uint8_t { none, leaf, inner };
  struct node {
    voxels::kind kind = voxels::kind::none;
    float value = 0.0F;  ///< of a leaf
    friend bool operator==(const node&, const node&) = default;
  };

  explicit voxels(const window& w) { start(w); }
  /// Unknown everywhere.
  void start(const window& w) {
    window_ = w;
    constexpr node none;
    octants_ = std::size_t{1} << 3 * (w.level - octant_level);
    alike_.assign(octants_, voxel{});
    is_mixed_.assign(octants_, 0);
    if (mixed_.size() < 64 * octants_) mixed_.resize(64 * octants_);
    inner_in_.assign(octants_, 0);
    is_dirty_.assign(octants_, 0);
    dirty_.clear();
    inner_ = 0;
    levels_.resize(static_cast<std::size_t>(w.level - octant_level + 1));
    for (std::size_t i = 0; i != levels_.size(); ++i) levels_[i].assign(octants_ >> 3 * i, none);
  }

  /// Becomes a copy, with the voxels of mixed octants only.
  void become(const voxels& other) {
    start(other.window_);
    alike_ = other.alike_;
    is_mixed_ = other.is_mixed_;
    for (std::size_t o = 0; o != octants_; ++o)
      if (is_mixed_[o] != 0) std::copy_n(&other.mixed_[64 * o], 64, &mixed_[64 * o]);
    for (std::size_t o = 0; o != octants_; ++o)
      if (is_mixed_[o] != 0 || alike_[o]) mark(o);
  }

  [[nodiscard]] const window& where() const { return window_; }
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(64 * octants_); }
  [[nodiscard]] const voxel& operator[](const voxel_key& k) const { return at(place(k)); }
  [[nodiscard]] voxel_key key(std::size_t i) const {
    const voxel_key k = octree::morton_key(i);
    return {window_.low.x + k.x, window_.low.y + k.y, window_.low.z + k.z};
  }

  /// Every voxel of a node becomes what `change` makes of its value.
  template <class Change>
  void change(const voxel_key& k, int level, Change&& change) {
    const std::size_t first = place(k);
    if (level < octant_level) {
      mix(first / 64);
      for (std::size_t i = first; i != first + (std::size_t{1} << 3 * level); ++i) mixed_[i] = change(mixed_[i]);
      return;
    }
    for (std::size_t i = first / 64; i != first / 64 + (std::size_t{1} << 3 * (level - octant_level)); ++i)
      change_octant(i, change);
  }
  void fill(const voxel_key& k, int level, const voxel& value) {
    change(k, level, [&](const voxel&) { return value; });
  }
  /// Every known voxel becomes what `change` makes of its value.
  template <class Change>
  void change_known(Change&& change) {
    for (std::size_t i = 0; i != octants_; ++i)
      if (is_mixed_[i] != 0 || alike_[i])
        change_octant(i, [&](const voxel& v) { return v ? voxel{change(*v)} : voxel{}; });
  }
  template <class Holds>
  [[nodiscard]] bool all_of(const voxel_key& k, int level, Holds&& holds) const {
    const std::size_t first = place(k), end = first + (std::size_t{1} << 3 * level);
    for (std::size_t i = first; i != end; i += is_mixed_[i / 64] == 0 && level >= octant_level ? 64 : 1)
      if (!holds(at(i))) return false;
    return true;
  }
  /// The voxels of an octant, which change.
  [[nodiscard]] std::span<voxel, 64> octant(const voxel_key& k) {
    const std::size_t i = place(k) / 64;
    mix(i);
    return std::span<voxel, 64>{mixed_.data() + 64 * i, 64};
  }

  friend bool operator==(const voxels& a, const voxels& b) {
    if (a.octants_ != b.octants_) return false;
    for (std::size_t o = 0; o != a.octants_; ++o) {
      const bool alike = a.is_mixed_[o] == 0 && b.is_mixed_[o] == 0;
      for (std::size_t i = 64 * o; i != 64 * o + (alike ? 1U : 64U); ++i)
        if (a.at(i) != b.at(i)) return false;
    }
    return true;
  }

  // -- the tree; bring_up_to_date() precedes what is asked of it

  void bring_up_to_date() {
    std::vector<std::size_t>& changed = changed_;
    changed.clear();
    for (const std::size_t o : dirty_) {
      is_dirty_[o] = 0;
      if (set(0, o, node_of_octant(o))) changed.push_back(o);
    }
    dirty_.clear();
    for (std::size_t level = 1; level != levels_.size() && !changed.empty(); ++level) {
      for (std::size_t& i : changed) i /= 8;
      std::ranges::sort(changed);
      changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
      std::erase_if(changed, [&](std::size_t i) { return !set(level, i, node_above(&levels_[level - 1][8 * i])); });
    }
  }
  [[nodiscard]] node top() const { return levels_.back()[0]; }
  /// The leaves in Morton order. Eight equal children of the tree's root are no leaf, unless the root was made one.
  void leaves(bool root_may_be_leaf, std::vector<tree_leaf>& found) const {
    found.clear();
    add(0, window_.level, window_.level == window_.tree_depth && !root_may_be_leaf, found);
  }
  [[nodiscard]] std::size_t inner_nodes(bool root_may_be_leaf) const {
    if (top().kind == kind::none) return 0;
    const bool root_has_to = window_.level == window_.tree_depth && !root_may_be_leaf && top().kind == kind::leaf;
    return static_cast<std::size_t>(window_.tree_depth - window_.level) + inner_ + (root_has_to ? 1 : 0);
  }

 private:
  static constexpr int octant_level = octree::detail::octant_level;

  [[nodiscard]] std::size_t place(const voxel_key& k) const {
    return octree::morton_code({k.x - window_.low.x, k.y - window_.low.y, k.z - window_.low.z});
  }
  [[nodiscard]] const voxel& at(std::size_t i) const { return is_mixed_[i / 64] != 0 ? mixed_[i] : alike_[i / 64]; }
  void mark(std::size_t octant) {
    if (is_dirty_[octant] == 0) dirty_.push_back(octant);
    is_dirty_[octant] = 1;
  }
  void mix(std::size_t octant) {
    mark(octant);
    if (is_mixed_[octant] == 0)
      std::fill_n(mixed_.begin() + static_cast<std::ptrdiff_t>(64 * octant), 64, alike_[octant]);
    is_mixed_[octant] = 1;
  }
  template <class Change>
  void change_octant(std::size_t octant, Change&& change) {
    mark(octant);
    if (is_mixed_[octant] == 0)
      alike_[octant] = change(alike_[octant]);
    else
      for (std::size_t i = 64 * octant; i != 64 * octant + 64; ++i) mixed_[i] = change(mixed_[i]);
  }

  [[nodiscard]] static node leaf_of(const voxel& v) { return v ? node{kind::leaf, *v} : node{}; }
  [[nodiscard]] static node node_above(const node* eight) {
    bool same = eight[0].kind == kind::leaf, known = false;
    for (const node* n = eight; n != eight + 8; ++n) {
      same = same && n->kind == kind::leaf && n->value == eight[0].value;
      known = known || n->kind != kind::none;
    }
    if (!known) return {};
    return same ? eight[0] : node{kind::inner};
  }
  /// One of the nodes of eight voxels in a mixed octant.
  [[nodiscard]] node small_node(std::size_t first) const {
    std::array<node, 8> eight;
    for (std::size_t i = 0; i != 8; ++i) eight[i] = leaf_of(mixed_[first + i]);
    return node_above(eight.data());
  }
  [[nodiscard]] node node_of_octant(std::size_t octant) {
    inner_ -= std::exchange(inner_in_[octant], std::uint8_t{0});
    if (is_mixed_[octant] == 0) return leaf_of(alike_[octant]);
    std::array<node, 8> eight;
    std::uint8_t inner = 0;
    for (std::size_t i = 0; i != 8; ++i) {
      eight[i] = small_node(64 * octant + 8 * i);
      inner = static_cast<std::uint8_t>(inner + (eight[i].kind == kind::inner ? 1 : 0));
    }
    const node n = node_above(eight.data());
    inner_in_[octant] = inner;
    inner_ += inner;
    if (n.kind != kind::inner) {
      is_mixed_[octant] = 0;
      alike_[octant] = mixed_[64 * octant];
    }
    return n;
  }
  /// False if it is so already.
  bool set(std::size_t level, std::size_t i, const node& n) {
    node& before = levels_[level][i];
    if (before == n) return false;
    inner_ -= before.kind == kind::inner ? 1 : 0;
    inner_ += n.kind == kind::inner ? 1 : 0;
    before = n;
    return true;
  }
  void add(std::size_t i, int level, bool has_to_have_children, std::vector<tree_leaf>& found) const {
    const bool is_mixed = level < octant_level;
    const node n = level == 0 ? leaf_of(mixed_[i])
                   : is_mixed ? small_node(8 * i)
                              : levels_[static_cast<std::size_t>(level - octant_level)][i];
    if (n.kind == kind::none) return;
    if (n.kind == kind::leaf && !has_to_have_children) {
      found.push_back({key(i << 3 * level), level, n.value});
      return;
    }
    for (std::size_t child = 0; child != 8; ++child) add(8 * i + child, level - 1, false, found);
  }

  window window_{};
  std::size_t octants_ = 0;
  std::vector<voxel> alike_;               ///< by octant, unless it is mixed
  std::vector<std::uint8_t> is_mixed_;     ///< by octant
  std::vector<voxel> mixed_;               ///< voxels of mixed octants
  std::vector<std::vector<node>> levels_;  ///< from the octants up
  std::vector<std::uint8_t> inner_in_;     ///< by octant, inner nodes below it
  std::size_t inner_ = 0;                  ///< inner nodes up to the window's
  std::vector<std::uint8_t> is_dirty_;     ///< by octant, whether the tree does not know it
  std::vector<std::size_t> dirty_, changed_;
};

/// Questions about boxes: whether something is in the way.
void check_box(const map& m, const voxels& v, random_bits& random) {
  const window& w = v.where();
  octree::key_box box;
  const auto axis = [&](std::uint32_t from, std::uint32_t& low, std::uint32_t& high) {
    low = from + random.below(w.edge());
    high = std::min(low + random.below(10), from + w.edge() - 1);
  };
  axis(w.low.x, box.low.x, box.high.x);
  axis(w.low.y, box.low.y, box.high.y);
  axis(w.low.z, box.low.z, box.high.z);

  bool occupied = false, unknown = false;
  for (std::uint32_t z = box.low.z; z <= box.high.z; ++z)
    for (std::uint32_t y = box.low.y; y <= box.high.y; ++y)
      for (std::uint32_t x = box.low.x; x <= box.high.x; ++x) {
        const voxel& at = v[{x, y, z}];
        unknown = unknown || !at;
        occupied = occupied || (at && octree::is_occupied<model>(*at));
      }
  const octree::bounding_box metres{m.grid().center(box.low).array() - 0.2 * resolution,
                                    m.grid().center(box.high).array() + 0.2 * resolution};
  require(overlaps(m, metres) == occupied, "a box overlaps what is occupied");
  require(overlaps(m, metres, {.unknown = octree::occupancy::occupied}) == (occupied || unknown),
          "a box overlaps what is occupied or unknown");
}

/// Everything that a map says is what the voxels say.
void check(const map& m, voxels& v, random_bits& random) {
  v.bring_up_to_date();
  const std::vector<tree_leaf> leaves = leaves_of(m);
  const bool root_is_leaf = leaves.size() == 1 && leaves[0].level == m.tree_depth();
  static std::vector<tree_leaf> expected;
  v.leaves(root_is_leaf, expected);
  require(leaves == expected, "the leaves are those of the voxels");

  const octree::octree_counts counts = m.counts();
  const auto occupied = std::count_if(leaves.begin(), leaves.end(),
                                      [](const tree_leaf& n) { return octree::is_occupied<model>(n.value); });
  require(counts.leaves == leaves.size() && counts.occupied_leaves == static_cast<std::size_t>(occupied) &&
              counts.free_leaves == leaves.size() - counts.occupied_leaves &&
              counts.nodes == leaves.size() + v.inner_nodes(root_is_leaf),
          "nodes and leaves are counted");
  require(m.empty() == leaves.empty(), "a map is empty if, and only if, it has no leaves");

  auto near = m.accessor();
  for (int i = 0; i != 16; ++i) {
    const voxel_key k = v.key(random.below(v.size()));
    require(m.value(k) == v[k] && near.value(k) == v[k], "a voxel has its value");
    require(m.value(m.grid().center(k)) == v[k] && near.state(k) == m.state(k), "and so has its centre");
  }
  check_box(m, v, random);
}

/// The same map, built anew of nothing but its leaves.
[[nodiscard]] map rebuilt(const map& m) {
  map fresh{resolution, m.tree_depth()};
  m.for_each_leaf([&](const map::leaf& l) { fresh.set_unknown_node(l.key, l.depth, l.log_odds + 0.0F); });
  return fresh;
}

/// A copy elsewhere, kept up to date by the log of changes.
class mirror {
 public:
  explicit mirror(voxels& use) : voxels_{use} {}

  /// Asks for what has changed since the last time, or for everything where the log cannot tell.
  void follow(const map& m) {
    const octree::change_log& log = m.changes();
    if (is_new_ || log.complete_since() > seen_) {
      voxels_.start(voxels_.where());
      m.for_each_leaf([&](const map::leaf& l) { voxels_.fill(l.key, m.tree_depth() - l.depth, l.log_odds); });
    } else {
      log.for_each_since(seen_, [&](const voxel_key& octant, std::uint64_t mask) {
        const auto voxels = voxels_.octant(octant);
        for (std::uint32_t i = 0; i != 64; ++i)
          if ((mask >> i & 1U) != 0) voxels[i] = m.value(octree::detail::voxel_in_octant(octant, i));
      });
    }
    seen_ = log.revision();
    is_new_ = false;
  }
  void start_anew() { is_new_ = true; }
  [[nodiscard]] std::uint64_t seen() const { return seen_; }
  [[nodiscard]] const voxels& content() const { return voxels_; }

 private:
  voxels& voxels_;
  std::uint64_t seen_ = 0;
  bool is_new_ = true;
};

/// A map and what it is to be, and the changes that bytes stand for.
class session {
 public:
  session(source& from, const window& w)
      : from_{from}, map_{resolution, w.tree_depth}, expected_{kept(0, w)}, mirror_{kept(1, w)}, copied_{kept(2, w)} {}

  void change() {
    switch (const unsigned what = from_.byte(); what % 16) {
      case 0:
      case 1:
      case 2: set_node(); break;
      case 3:
      case 4: edit_octant(); break;
      case 5: transform(); break;
      case 6: evict(); break;
      case 7:
      case 8:
      case 9:
      case 10: integrate(); break;
      case 11: through_file(); break;
      case 12: copy(); break;
      case 13: clear(); break;
      default: track(); break;
    }
    random_bits random{mix64(++changes_)};
    check(map_, expected_, random);
  }
  void finish() {
    follow();
    if (copy_) {
      random_bits random{0};
      check(*copy_, copied_, random);
    }
    const bool root_is_full = expected_.top().kind == voxels::kind::leaf;
    require(root_is_full || leaves_of(rebuilt(map_)) == leaves_of(map_), "a map does not remember how it came about");
    if (map_.tree_depth() == octree::default_tree_depth) fuzz::check_map(map_);
  }

 private:
  /// Voxels that outlive a session, as it takes longer to allocate them than to change them.
  [[nodiscard]] static voxels& kept(std::size_t which, const window& w) {
    static std::array<voxels, 3> all{voxels{w}, voxels{w}, voxels{w}};
    all[which].start(w);
    return all[which];
  }

  // -- choices

  [[nodiscard]] const window& where() const { return expected_.where(); }
  [[nodiscard]] voxel_key key() {
    const auto one = [&](std::uint32_t low) { return low + from_.byte() % where().edge(); };
    const std::uint32_t x = one(where().low.x), y = one(where().low.y);
    return {x, y, one(where().low.z)};
  }
  [[nodiscard]] float value() {
    return from_.one_of({model::clamp_min, model::miss, model::hit, model::clamp_max, 0.0F, -0.0F, 2 * model::miss});
  }
  [[nodiscard]] int level() { return static_cast<int>(from_.byte()) % (where().level + 1); }
  /// The voxels of one scan.
  [[nodiscard]] std::vector<vec3f> points() {
    std::vector<vec3f> points(from_.byte() % 12);
    for (vec3f& p : points) p = map_.grid().center(key()).cast<float>();
    return points;
  }
  struct scan {
    std::vector<vec3f> points;
    vec3f origin;
    octree::integration_options options;
    map& alone;  ///< a map that has seen nothing else
  };
  /// Empty, but with the memory of the scan before.
  [[nodiscard]] static map& empty_map(int depth) {
    static std::array<map, 3> all{map{resolution, 5}, map{resolution, 6}, map{resolution}};
    map& m = all[depth == 5 ? 0 : depth == 6 ? 1 : 2];
    m.clear();
    return m;
  }
  [[nodiscard]] scan next_scan() {
    const unsigned flags = from_.byte();
    const vec3f origin = map_.grid().center(key()).cast<float>();
    scan s{points(), origin, {}, empty_map(where().tree_depth)};
    s.options.mode = (flags & 1U) != 0 ? octree::ray_mode::discretized : octree::ray_mode::every_ray;
    if ((flags & 2U) != 0) s.options.max_range = 9.25 * resolution;
    // Many long rays through large leaves make more nodes than can be looked at in a second.
    for (vec3f& p : s.points) {
      const double length = std::min(static_cast<double>((p - origin).norm()), s.options.max_range);
      if (!rays_.take(length, resolution)) p = origin;
    }
    s.alone.integrate(s.points, s.origin, s.options);
    return s;
  }

  // -- changes

  void set_node() {
    const int at = level();
    const voxel_key k = octree::node_key(key(), at);
    if (!expected_.all_of(k, at, [](const voxel& v) { return !v; })) return;
    const float v = value();
    map_.set_unknown_node(k, where().tree_depth - at, v);
    expected_.fill(k, at, v);
  }
  void edit_octant() {
    const voxel_key k = octree::node_key(key(), octree::detail::octant_level);
    const unsigned kind = from_.byte() % 8;
    const float v = value();
    const unsigned number = from_.byte();
    const std::uint64_t one = std::uint64_t{1} << number % 64, some = mix64(number);
    const std::uint64_t mask = kind % 2 == 0 ? one : some;
    const auto edit = [&](block<float>& b) {
      switch (kind) {
        case 0:
        case 1: b.known |= mask; break;
        case 2:
        case 3: b.known &= ~mask; break;
        case 4: b.known = 0; break;
        case 5: b.known = ~std::uint64_t{0}; break;
        default: break;  // what is known changes its value, if anything
      }
      for (unsigned i = 0; i != 64; ++i) {
        if (kind == 6) {  // more values than fit a palette
          b.value[i] = static_cast<float>(i + number) * 0.01F;
        } else if ((mask >> i & 1U) != 0 || kind == 5) {
          b.value[i] = v;
        }
        if ((b.known >> i & 1U) == 0) b.value[i] = 0.0F;
      }
    };
    map_.edit_octant(k, edit);
    block<float> expected;
    const auto voxels = expected_.octant(k);
    for (unsigned i = 0; i != 64; ++i) {
      expected.value[i] = voxels[i].value_or(0.0F);
      expected.known |= std::uint64_t{voxels[i].has_value()} << i;
    }
    edit(expected);
    for (unsigned i = 0; i != 64; ++i)
      voxels[i] = (expected.known >> i & 1U) != 0 ? voxel{expected.value[i]} : std::nullopt;
  }
  template <class Change>
  void transform_by(Change&& change) {
    map_.transform(change);
    expected_.change_known(change);
  }
  void transform() {
    const unsigned kind = from_.byte() % 8;
    const float some = value();
    switch (kind) {
      case 0: transform_by([&](float v) { return v == some ? std::nullopt : voxel{v}; }); break;
      case 1: transform_by([&](float v) { return v == some ? std::nullopt : voxel{0.5F * v}; }); break;
      case 2: transform_by([&](float v) { return voxel{v == 0.0F ? some : v}; }); break;
      case 3: transform_by([&](float v) { return voxel{std::copysign(v, some)}; }); break;
      case 4: transform_by([&](float v) { return voxel{0.0F * v}; }); break;
      case 5: transform_by([](float) { return voxel{}; }); break;
      case 6:
        transform_by([](float v) {
          const float later = octree::exponential_decay<>{1.0, 0.75}(v);
          return v < 0.0F || later > 0.6F ? voxel{later} : voxel{};
        });
        break;
      default:
        transform_by(
            [](float v) { return voxel{octree::is_occupied<model>(v) ? model::clamp_max : model::clamp_min}; });
    }
  }
  void evict() {
    const vec3 center = map_.grid().center(key());
    const vec3 half = vec3::Constant(resolution * static_cast<double>(from_.byte() % 32));
    const bool comes_back = (from_.byte() & 1U) != 0;
    const octree::bounding_box box{center - half, center + half};
    const auto is_outside = [&](const map::leaf& l, double edge, double nearly) {
      const double d = (l.center - center).cwiseAbs().maxCoeff();
      return d + nearly > half.x() + 0.5 * edge;
    };
    std::vector<map::leaf> gone;
    map_.evict_outside(box, [&](const map::leaf& l) { gone.push_back(l); });
    for (const map::leaf& l : gone) {
      const int at = where().tree_depth - l.depth;
      require(expected_.all_of(l.key, at, [&](const voxel& v) { return v == l.log_odds; }),
              "what is evicted was in the map");
      require(is_outside(l, l.size, 1e-6), "what is evicted lies outside the box");
      expected_.fill(l.key, at, voxel{});
    }
    const double brick = map_.grid().node_size(octree::detail::brick_level);
    map_.for_each_leaf([&](const map::leaf& l) {
      map::leaf around = l;
      const int at = std::max(where().tree_depth - l.depth, octree::detail::brick_level);
      around.center = map_.grid().center(octree::node_key(l.key, at), at);
      require(!is_outside(around, std::max(l.size, brick), -1e-6), "what stays touches the box, or its brick does");
    });
    if (!comes_back) return;
    for (const map::leaf& l : gone) {
      map_.set_unknown_node(l.key, l.depth, l.log_odds);
      expected_.fill(l.key, where().tree_depth - l.depth, l.log_odds);
    }
  }
  void integrate() {
    const scan s = next_scan();
    map_.integrate(s.points, s.origin, s.options);
    s.alone.for_each_leaf([&](const map::leaf& l) {
      expected_.change(l.key, where().tree_depth - l.depth, [&](const voxel& v) -> voxel {
        const float before = v.value_or(0.0F);
        return l.log_odds > 0.0F ? octree::after_hit<model>(before) : octree::after_miss<model>(before);
      });
    });
  }
  void through_file() {
    if (map_.tree_depth() == octree::default_tree_depth) {
      const std::string bytes = octree::ot_bytes(map_);
      auto read = octree::read_ot(fuzz::bytes_of(bytes));
      require(read.has_value(), "a file can be read");
      map_ = *std::move(read);
    } else {
      map_ = rebuilt(map_);
    }
    is_tracked_ = false;
    mirror_.start_anew();
  }
  void copy() {
    if (copy_) {
      random_bits random{mix64(changes_)};
      check(*copy_, copied_, random);
    }
    copy_ = map_;
    copied_.become(expected_);
  }
  void clear() {
    map_.clear();
    expected_.start(where());
  }
  void track() {
    octree::change_log& log = map_.changes();
    switch (const unsigned what = from_.byte(); what % 8) {
      case 0: map_.track_changes(is_tracked_ = false); break;
      case 1:
        map_.track_changes(false);
        map_.track_changes(is_tracked_ = true);
        break;
      case 2: log.forget_before(mirror_.seen()); break;
      case 3: log.forget_before(log.revision()); break;
      case 4: log.set_capacity(what >> 3U); break;
      case 5: follow(); break;
      default: map_.track_changes(is_tracked_ = true); break;
    }
  }
  void follow() {
    if (!is_tracked_) return;
    mirror_.follow(map_);
    require(mirror_.content() == expected_, "a mirror that follows the log of changes keeps up");
  }

  source& from_;
  map map_;
  voxels& expected_;
  mirror mirror_;
  bool is_tracked_ = false;
  std::optional<map> copy_;
  voxels& copied_;
  std::uint64_t changes_ = 0;
  fuzz::ray_budget rays_{1500.0};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  orbis::fuzz::accept();  // any bytes mean something
  constexpr window windows[] = {{5, 5, {}},
                                {16, 5, {32768, 32768 - 32, 32768}},
                                {6, 6, {}},
                                {5, 5, {}},
                                {16, 5, {0, 65536 - 32, 0}},
                                {16, 6, {32768 - 64, 32768, 32768 - 64}},
                                {5, 5, {}},
                                {16, 5, {32768 - 32, 32768 - 32, 32768}}};
  source from{{data, size}};
  session s{from, from.one_of(windows)};
  for (int changes = 0; changes != most_changes && !from.empty(); ++changes) s.change();
  s.finish();
  return 0;
}

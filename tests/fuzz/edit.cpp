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

/// What a map is to be: every voxel of the window, in Morton order, so that nodes are consecutive.
class voxels {
 public:
  explicit voxels(const window& w) : window_{w}, at_(std::size_t{1} << 3 * w.level) {}

  [[nodiscard]] const window& where() const { return window_; }
  [[nodiscard]] std::span<voxel> all() { return at_; }
  [[nodiscard]] std::span<const voxel> all() const { return at_; }
  [[nodiscard]] std::span<voxel> node(const voxel_key& k, int level) {
    return std::span{at_}.subspan(place(k), std::size_t{1} << 3 * level);
  }
  [[nodiscard]] const voxel& operator[](const voxel_key& k) const { return at_[place(k)]; }
  [[nodiscard]] bool is_inside(const voxel_key& k) const {
    const auto within = [&](std::uint32_t c, std::uint32_t low) { return c - low < window_.edge(); };
    return within(k.x, window_.low.x) && within(k.y, window_.low.y) && within(k.z, window_.low.z);
  }
  [[nodiscard]] voxel_key key(std::size_t i) const {
    const voxel_key k = octree::morton_key(i);
    return {window_.low.x + k.x, window_.low.y + k.y, window_.low.z + k.z};
  }
  friend bool operator==(const voxels& a, const voxels& b) { return a.at_ == b.at_; }

 private:
  [[nodiscard]] std::size_t place(const voxel_key& k) const {
    return octree::morton_code({k.x - window_.low.x, k.y - window_.low.y, k.z - window_.low.z});
  }

  window window_;
  std::vector<voxel> at_;
};

/// The tree above voxels, made of nothing but them.
class reference_tree {
 public:
  enum class kind { none, leaf, inner };
  struct node {
    reference_tree::kind kind = kind::none;
    float value = 0.0F;  ///< of a leaf
  };

  explicit reference_tree(const voxels& of) : of_{of}, levels_(static_cast<std::size_t>(of.where().level)) {
    for (std::size_t level = 0; level != levels_.size(); ++level) {
      levels_[level].resize(of.all().size() >> 3 * (level + 1));
      for (std::size_t i = 0; i != levels_[level].size(); ++i) levels_[level][i] = parent(level, 8 * i);
    }
  }
  [[nodiscard]] node top() const { return at(0, levels_.size()); }
  /// The leaves in Morton order. Eight equal children of the tree's root are no leaf, unless the root was made one.
  [[nodiscard]] std::vector<tree_leaf> leaves(bool root_may_be_leaf) const {
    std::vector<tree_leaf> found;
    const window& w = of_.where();
    add(0, levels_.size(), w.level == w.tree_depth && !root_may_be_leaf, found);
    return found;
  }
  [[nodiscard]] std::size_t inner_nodes(bool root_may_be_leaf) const {
    const window& w = of_.where();
    if (top().kind == kind::none) return 0;
    std::size_t inner = static_cast<std::size_t>(w.tree_depth - w.level);
    for (const auto& level : levels_)
      inner +=
          static_cast<std::size_t>(std::ranges::count_if(level, [](const node& n) { return n.kind == kind::inner; }));
    const bool root_has_to = w.level == w.tree_depth && !root_may_be_leaf && top().kind == kind::leaf;
    return inner + (root_has_to ? 1 : 0);
  }

 private:
  [[nodiscard]] node at(std::size_t i, std::size_t level) const {
    if (level != 0) return levels_[level - 1][i];
    const voxel& v = of_.all()[i];
    return v ? node{kind::leaf, *v} : node{};
  }
  [[nodiscard]] node parent(std::size_t level, std::size_t first) const {
    const node one = at(first, level);
    bool same = one.kind == kind::leaf, known = false;
    for (std::size_t i = first; i != first + 8; ++i) {
      const node n = at(i, level);
      same = same && n.kind == kind::leaf && n.value == one.value;
      known = known || n.kind != kind::none;
    }
    if (!known) return {};
    return same ? one : node{kind::inner};
  }
  void add(std::size_t i, std::size_t level, bool has_to_have_children, std::vector<tree_leaf>& found) const {
    const node n = at(i, level);
    if (n.kind == kind::none) return;
    if (n.kind == kind::leaf && !has_to_have_children) {
      found.push_back({of_.key(i << 3 * level), static_cast<int>(level), n.value});
      return;
    }
    for (std::size_t child = 0; child != 8; ++child) add(8 * i + child, level - 1, false, found);
  }

  const voxels& of_;
  std::vector<std::vector<node>> levels_;  ///< from level 1 on
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
void check(const map& m, const voxels& v, random_bits& random) {
  const reference_tree tree{v};
  const std::vector<tree_leaf> leaves = leaves_of(m);
  const bool root_is_leaf = leaves.size() == 1 && leaves[0].level == m.tree_depth();
  require(leaves == tree.leaves(root_is_leaf), "the leaves are those of the voxels");

  const octree::octree_counts counts = m.counts();
  const auto occupied = std::count_if(leaves.begin(), leaves.end(),
                                      [](const tree_leaf& n) { return octree::is_occupied<model>(n.value); });
  require(counts.leaves == leaves.size() && counts.occupied_leaves == static_cast<std::size_t>(occupied) &&
              counts.free_leaves == leaves.size() - counts.occupied_leaves &&
              counts.nodes == leaves.size() + tree.inner_nodes(root_is_leaf),
          "nodes and leaves are counted");
  require(m.empty() == leaves.empty(), "a map is empty if, and only if, it has no leaves");

  auto near = m.accessor();
  for (int i = 0; i != 64; ++i) {
    const voxel_key k = v.key(random.below(static_cast<std::uint32_t>(v.all().size())));
    require(m.value(k) == v[k] && near.value(k) == v[k], "a voxel has its value");
    require(m.value(m.grid().center(k)) == v[k] && near.state(k) == m.state(k), "and so has its centre");
  }
  for (int i = 0; i != 2; ++i) check_box(m, v, random);
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
  explicit mirror(const window& w) : voxels_{w} {}

  /// Asks for what has changed since the last time, or for everything where the log cannot tell.
  void follow(const map& m) {
    const octree::change_log& log = m.changes();
    if (is_new_ || log.complete_since() > seen_) {
      for (voxel& v : voxels_.all()) v.reset();
      m.for_each_leaf([&](const map::leaf& l) {
        std::ranges::fill(voxels_.node(l.key, m.tree_depth() - l.depth), voxel{l.log_odds});
      });
    } else {
      log.for_each_since(seen_, [&](const voxel_key& octant, std::uint64_t mask) {
        const auto voxels = voxels_.node(octant, octree::detail::octant_level);
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
  voxels voxels_;
  std::uint64_t seen_ = 0;
  bool is_new_ = true;
};

/// A map and what it is to be, and the changes that bytes stand for.
class session {
 public:
  session(source& from, const window& w) : from_{from}, map_{resolution, w.tree_depth}, expected_{w}, mirror_{w} {}

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
      check(*copy_, *copied_, random);
    }
    const bool root_is_full = reference_tree{expected_}.top().kind == reference_tree::kind::leaf;
    require(root_is_full || leaves_of(rebuilt(map_)) == leaves_of(map_), "a map does not remember how it came about");
    if (map_.tree_depth() == octree::default_tree_depth) fuzz::check_map(map_);
  }

 private:
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
    map alone;  ///< a map that has seen nothing else
  };
  [[nodiscard]] scan next_scan() {
    const unsigned flags = from_.byte();
    const vec3f origin = map_.grid().center(key()).cast<float>();
    scan s{points(), origin, {}, map{resolution, where().tree_depth}};
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
  /// Calls `use(voxel, value in m)` for every voxel that is known to `m`.
  template <class Use>
  void for_each_known_in(const map& m, Use&& use) {
    m.for_each_leaf([&](const map::leaf& l) {
      for (voxel& v : expected_.node(l.key, m.tree_depth() - l.depth)) use(v, l.log_odds);
    });
  }

  // -- changes

  void set_node() {
    const int at = level();
    const voxel_key k = octree::node_key(key(), at);
    const auto inside = expected_.node(k, at);
    if (std::ranges::any_of(inside, [](const voxel& v) { return v.has_value(); })) return;
    const float v = value();
    map_.set_unknown_node(k, where().tree_depth - at, v);
    std::ranges::fill(inside, voxel{v});
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
    const auto voxels = expected_.node(k, octree::detail::octant_level);
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
    for (voxel& v : expected_.all())
      if (v) v = change(*v);
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
      const auto inside = expected_.node(l.key, at);
      require(std::ranges::all_of(inside, [&](const voxel& v) { return v == l.log_odds; }),
              "what is evicted was in the map");
      require(is_outside(l, l.size, 1e-6), "what is evicted lies outside the box");
      std::ranges::fill(inside, voxel{});
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
      std::ranges::fill(expected_.node(l.key, where().tree_depth - l.depth), voxel{l.log_odds});
    }
  }
  void integrate() {
    const scan s = next_scan();
    map_.integrate(s.points, s.origin, s.options);
    for_each_known_in(s.alone, [](voxel& v, float once) {
      const float before = v.value_or(0.0F);
      v = once > 0.0F ? octree::after_hit<model>(before) : octree::after_miss<model>(before);
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
      check(*copy_, *copied_, random);
    }
    copy_ = map_;
    copied_ = expected_;
  }
  void clear() {
    map_.clear();
    for (voxel& v : expected_.all()) v.reset();
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
  voxels expected_;
  mirror mirror_;
  bool is_tracked_ = false;
  std::optional<map> copy_;
  std::optional<voxels> copied_;
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

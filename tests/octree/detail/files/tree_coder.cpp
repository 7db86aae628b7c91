// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/files/tree_coder.hpp>
#include <orbis/octree/key.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

struct level {
  std::vector<std::uint64_t> parents;
  std::vector<child_states> children;
};
/// Levels of children, the root's last.
using tree = std::vector<level>;

/// `state(code, level)`: what a node is.
template <class State>
[[nodiscard]] tree make_tree(int root_level, State&& state) {
  tree t(static_cast<std::size_t>(root_level));
  std::vector<std::uint64_t> parents{0};
  for (int l = root_level - 1; l >= 0; --l) {
    std::vector<std::uint64_t> inner;
    for (const std::uint64_t parent : parents) {
      child_states c;
      for (unsigned i = 0; i != 8; ++i) {
        const coded_state s = state(parent << 3U | i, l);
        c.set(i, s);
        CHECK(c[i] == s);
        if (s == coded_state::inner) inner.push_back(parent << 3U | i);
      }
      t[static_cast<std::size_t>(l)].parents.push_back(parent);
      t[static_cast<std::size_t>(l)].children.push_back(c);
    }
    parents = inner;
  }
  return t;
}
[[nodiscard]] std::string encoded(const tree& t) {
  range_encoder encoder;
  tree_coder<range_encoder> coder{encoder, static_cast<int>(t.size())};
  for (std::size_t l = t.size(); l-- != 0;) {
    coder.begin_level(static_cast<int>(l), t[l].parents);
    for (std::size_t i = 0; i != t[l].parents.size(); ++i) coder.code(t[l].parents[i], t[l].children[i]);
  }
  return encoder.finish();
}
void check_decoded(const tree& t, const std::string& coded) {
  range_decoder decoder{std::as_bytes(std::span{coded})};
  tree_coder<range_decoder> coder{decoder, static_cast<int>(t.size())};
  std::vector<std::uint64_t> parents{0};
  for (std::size_t l = t.size(); l-- != 0;) {
    REQUIRE(parents == t[l].parents);
    coder.begin_level(static_cast<int>(l), parents);
    std::vector<std::uint64_t> inner;
    for (std::size_t i = 0; i != parents.size(); ++i) {
      const child_states c = coder.code(parents[i], {});
      REQUIRE(c == t[l].children[i]);
      for (unsigned k = 0; k != 8; ++k)
        if (c[k] == coded_state::inner) inner.push_back(parents[i] << 3U | k);
    }
    parents = inner;
  }
}

}  // namespace

TEST_CASE("Random trees of any depth come back") {
  for (const int depth : {1, 2, 3, 5, 9, 21}) {
    random_bits random{84};
    const tree t = make_tree(depth, [&](std::uint64_t, int l) {
      const std::uint32_t inner = l > 6 ? 6 : 2;  // deep ones are thin at first
      const std::uint32_t r = random.below(16);
      return l != 0 && r < inner && random.below(l > 6 ? 3 : 1) == 0 ? coded_state::inner
             : r < 10                                                ? coded_state::free
             : r < 13                                                ? coded_state::occupied
                                                                     : coded_state::unknown;
    });
    check_decoded(t, encoded(t));
  }
}

TEST_CASE("A wall through space takes a fraction of a bit for each voxel") {
  // Free below a plane, occupied on it, unknown above: the states follow from the neighbours.
  constexpr int depth = 7;
  const auto side = [](const voxel_key& k) {
    const auto d = static_cast<int>(3 * k.x + 2 * k.y + 6 * k.z) - 600;
    return d < 0 ? coded_state::free : d < 8 ? coded_state::occupied : coded_state::unknown;
  };
  std::size_t nodes = 0;
  const tree t = make_tree(depth, [&](std::uint64_t code, int l) {
    const voxel_key low = morton_key(code << (3 * static_cast<unsigned>(l)));
    const std::uint32_t last = node_cells(l) - 1;
    ++nodes;
    const coded_state first = side(low), end = side({low.x + last, low.y + last, low.z + last});
    return first == end ? first : coded_state::inner;
  });
  const std::string coded = encoded(t);
  check_decoded(t, coded);
  CHECK(nodes > 20000);
  CHECK(8 * coded.size() < nodes * 6 / 10);
}

TEST_CASE("What is known of a place is that of the smallest node around it") {
  // One inner child, the others leaves; of its children one is inner again.
  range_encoder encoder;
  tree_coder<range_encoder> coder{encoder, 4};
  child_states top{0xfe, 0x0f};  // inner, three occupied, four free
  coder.begin_level(3, std::vector<std::uint64_t>{0});
  coder.code(0, top);
  child_states next{0x7f, 0x80 | 0x03};  // two occupied, five free, the last inner
  coder.begin_level(2, std::vector<std::uint64_t>{0});
  coder.code(0, next);
  coder.begin_level(1, std::vector<std::uint64_t>{7});
  // Level 1 nodes in the inner node at level 3: its children in bytes of eight, the inner one open.
  const auto inside = coder.state_of(0);
  CHECK(inside.known == 0x00ffffffffffffffULL);
  CHECK(inside.occupied == 0xff0000000000ffffULL);
  // In a leaf at level 3.
  CHECK(coder.state_of(1).known == ~std::uint64_t{0});
  CHECK(coder.state_of(1).occupied == ~std::uint64_t{0});
  CHECK(coder.state_of(5).known == ~std::uint64_t{0});
  CHECK(coder.state_of(5).occupied == 0);
}

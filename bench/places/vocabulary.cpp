// SPDX-License-Identifier: BSD-3-Clause
//
// Places: descriptors to words in trees of ten thousand to a million words, beside a tree of nodes on the heap that is
// walked pointer by pointer, as the first vocabularies were made; loading; queries among many keyframes.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/places.hpp>

namespace {

using namespace orbis;
using namespace orbis::places;
using descriptor = bit_words<256>;

const std::array<std::pair<const char*, simd::level>, 3> levels{
    {{"portable", simd::level::portable}, {"popcnt", simd::level::popcnt}, {"avx2", simd::level::avx2}}};

descriptor noisy(descriptor d, int flips, random_bits& random) {
  for (int i = 0; i != flips; ++i) {
    const std::uint32_t bit = random.below(256);
    d[bit / 64] ^= std::uint64_t{1} << (bit % 64);
  }
  return d;
}

/// Ten children for each node, each like its parent but for some bits.
vocabulary complete_tree(std::uint32_t depth) {
  constexpr std::uint32_t branching = 10;
  std::uint32_t nodes = 1, inner = 0, level = 1;
  for (std::uint32_t l = 0; l != depth; ++l) {
    inner += level;
    level *= branching;
    nodes += level;
  }
  vocabulary_tree<256> tree;
  tree.resize(nodes);
  random_bits random{1};
  const auto all = tree.descriptors.values();
  for (std::uint32_t i = 1; i != nodes; ++i) {
    const std::uint32_t parent = (i - 1) / branching;
    all[i - 1] = parent == 0 ? noisy({}, 180, random) : noisy(all[parent - 1], 40, random);
  }
  for (std::uint32_t w = 0; w != level; ++w) tree.weights.push_back(static_cast<float>(random.uniform(1.0, 9.0)));
  static_cast<void>(connect_tree(tree, std::vector<std::uint16_t>(inner, branching)));
  return vocabulary{std::move(tree)};
}
const vocabulary& tree_of(std::uint32_t depth) {
  static std::map<std::uint32_t, vocabulary> made;
  auto& words = made[depth];
  if (words.empty()) words = complete_tree(depth);
  return words;
}

/// Images of a thousand descriptors: words with noise.
std::vector<std::vector<descriptor>> images_of(const vocabulary& words, std::size_t count) {
  random_bits random{2};
  const auto all = words.tree().descriptors.values();
  std::vector<std::vector<descriptor>> images(count);
  for (auto& image : images)
    for (int i = 0; i != 1000; ++i)
      image.push_back(noisy(all[all.size() - 1 - random.below(static_cast<std::uint32_t>(words.size()))], 20, random));
  return images;
}

/// A node as a textbook has it: everything about it in one place, children and descriptor on the heap.
struct plain_node {
  double weight = 0.0;
  std::uint32_t word = 0;
  std::vector<unsigned char> bits;
  std::vector<std::unique_ptr<plain_node>> children;
};

std::unique_ptr<plain_node> plain_tree(const vocabulary& words, std::uint32_t node) {
  const auto& tree = words.tree();
  auto made = std::make_unique<plain_node>();
  if (node != 0) {
    const auto* const bytes = reinterpret_cast<const unsigned char*>(&tree.descriptors.values()[node - 1]);
    made->bits.assign(bytes, bytes + 32);
  }
  if (tree.is_leaf(node)) {
    made->word = tree.word_of_leaf(node);
    made->weight = static_cast<double>(words.weight(made->word));
    return made;
  }
  for (std::uint32_t c = tree.nodes[node].first_child; c != tree.nodes[node + 1].first_child; ++c)
    made->children.push_back(plain_tree(words, c));
  return made;
}

/// The bit-twiddling that everybody has: 32 bits at a time.
int plain_distance(const unsigned char* a, const unsigned char* b) {
  int sum = 0;
  for (int i = 0; i != 8; ++i) {
    std::uint32_t x, y;
    std::memcpy(&x, a + 4 * i, 4);
    std::memcpy(&y, b + 4 * i, 4);
    std::uint32_t v = x ^ y;
    v -= (v >> 1U) & 0x55555555U;
    v = (v & 0x33333333U) + ((v >> 2U) & 0x33333333U);
    sum += static_cast<int>((((v + (v >> 4U)) & 0xf0f0f0fU) * 0x1010101U) >> 24U);
  }
  return sum;
}

std::map<std::uint32_t, double> plain_transform(const plain_node& root, const std::vector<descriptor>& image) {
  std::map<std::uint32_t, double> bag;
  for (const descriptor& d : image) {
    const plain_node* at = &root;
    while (!at->children.empty()) {
      const plain_node* nearest = nullptr;
      int least = 1 << 30;
      for (const auto& child : at->children) {
        const int distance = plain_distance(reinterpret_cast<const unsigned char*>(d.data()), child->bits.data());
        if (distance < least) {
          least = distance;
          nearest = child.get();
        }
      }
      at = nearest;
    }
    bag[at->word] += at->weight;
  }
  double sum = 0.0;
  for (const auto& [word, value] : bag) sum += value;
  for (auto& [word, value] : bag) value /= sum;
  return bag;
}

template <class Function>
void add_row(const std::string& name, Function function) {
  benchmark::RegisterBenchmark(name.c_str(), function)->Unit(benchmark::kMicrosecond);
}

void add_transforms(std::uint32_t depth, const std::string& words_name) {
  const std::string group = "places/transform/1000_in_" + words_name + "_words/";
  for (const auto& [name, level] : levels)
    add_row(group + "orbis_" + name, [depth, level = level](benchmark::State& state) {
      const simd::level_limit limit{level};
      const vocabulary& words = tree_of(depth);
      const auto images = images_of(words, 40);
      bag_of_words bag;
      transform_workspace memory;
      std::size_t next = 0;
      for (auto _ : state) {
        words.transform(images[next++ % images.size()], bag, memory);
        benchmark::DoNotOptimize(bag.words.data());
      }
    });
  add_row(group + "pointer_walk", [depth](benchmark::State& state) {
    const vocabulary& words = tree_of(depth);
    static std::map<std::uint32_t, std::unique_ptr<plain_node>> made;
    auto& root = made[depth];
    if (!root) root = plain_tree(words, 0);
    const auto images = images_of(words, 40);
    std::size_t next = 0;
    for (auto _ : state) benchmark::DoNotOptimize(plain_transform(*root, images[next++ % images.size()]));
    const auto plain = plain_transform(*root, images[0]);
    const bag_of_words bag = words.transform(images[0]);
    bool same = bag.size() == plain.size();
    for (const auto& [word, value] : bag.words) same = same && plain.contains(word);
    if (!same) state.SkipWithError("the two find other words");
  });
}

void add_loading(std::uint32_t depth, const std::string& words_name) {
  add_row("places/load/" + words_name + "_words/orbis", [depth](benchmark::State& state) {
    const auto path = std::filesystem::temp_directory_path() / "orbis_bench_words.voc";
    if (!write_vocabulary(path, tree_of(depth))) state.SkipWithError("no place to write to");
    for (auto _ : state) benchmark::DoNotOptimize(read_vocabulary(path));
    std::filesystem::remove(path);
  });
}

/// Keyframes along a way on which each sees some of the words of the one before.
std::vector<bag_of_words> way(std::size_t keyframes, std::uint32_t words) {
  random_bits random{3};
  std::vector<bag_of_words> bags(keyframes);
  std::vector<std::uint32_t> seen(700);
  for (auto& w : seen) w = random.below(words);
  for (bag_of_words& bag : bags) {
    for (auto& w : seen)
      if (random.below(4) == 0) w = random.below(words);
    std::map<std::uint32_t, float> values;
    for (const std::uint32_t w : seen) values[w] += 1.0F;
    for (const auto& [word, value] : values) bag.words.push_back({word, value});
    normalize(bag);
  }
  return bags;
}

void add_queries(std::size_t keyframes) {
  const std::string group = "places/database/" + std::to_string(keyframes) + "_keyframes/";
  const auto filled = [keyframes] {
    static std::map<std::size_t, std::pair<std::vector<bag_of_words>, keyframe_database>> made;
    auto& [bags, database] = made[keyframes];
    if (bags.empty()) {
      bags = way(keyframes, 10'000);
      for (std::uint32_t i = 0; i != bags.size(); ++i) database.add(i, bags[i]);
    }
    return &made[keyframes];
  };
  add_row(group + "query/orbis", [filled](benchmark::State& state) {
    const auto& [bags, database] = *filled();
    std::vector<keyframe_database::candidate> found;
    keyframe_database::workspace memory;
    const auto neighbors = [](std::uint32_t i) { return std::array<std::uint32_t, 4>{i - 2, i - 1, i + 1, i + 2}; };
    std::size_t next = 0;
    for (auto _ : state) {
      const std::size_t q = (next++ * 37) % bags.size();
      database.query(
          bags[q], found, memory, {}, [&](std::uint32_t i) { return i + 10 > q && i < q + 10; }, neighbors);
      benchmark::DoNotOptimize(found.data());
    }
    state.counters["KB_per_keyframe"] =
        static_cast<double>(database.memory()) / 1024.0 / static_cast<double>(bags.size());
  });
  // The same scores by a look at every keyframe.
  add_row(group + "query/all_scores", [filled](benchmark::State& state) {
    const auto& [bags, database] = *filled();
    std::size_t next = 0;
    for (auto _ : state) {
      const std::size_t q = (next++ * 37) % bags.size();
      double best = 0.0;
      for (const bag_of_words& bag : bags) best = std::max(best, similarity(bags[q], bag));
      benchmark::DoNotOptimize(best);
    }
  });
  add_row(group + "erase_and_add/orbis", [filled](benchmark::State& state) {
    auto& [bags, database] = *filled();
    std::uint32_t next = 0;
    for (auto _ : state) {
      const auto i = static_cast<std::uint32_t>((next++ * 37) % bags.size());
      database.erase(i);
      database.add(i, bags[i]);
    }
  });
}

const bool registered = [] {
  add_transforms(4, "10k");
  add_transforms(6, "1M");
  add_loading(6, "1M");
  add_row("places/load/default/orbis", [](benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(default_vocabulary());
  });
  for (const std::size_t keyframes : {std::size_t{100}, std::size_t{1000}, std::size_t{10'000}}) add_queries(keyframes);
  return true;
}();

}  // namespace

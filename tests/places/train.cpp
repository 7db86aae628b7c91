// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <set>
#include <vector>

#include <orbis/places/train.hpp>
#include <orbis/places/vocabulary_file.hpp>

#include "places/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;

TEST_CASE("training is the same for every policy and level, and another one for another seed") {
  const auto images = test::make_images(300, 300, 1, 5000);  // enough for more than one piece of work
  const training_options options{.branching = 7, .depth = 4};
  const auto words = train(seq, images, options).value();
  CHECK(words.size() > 1500);
  CHECK(words.depth() == 4);
  CHECK(words.branching() == 7);
  CHECK(vocabulary_bytes(train(par.with(3), images, options).value()) == vocabulary_bytes(words));
  {
    const simd::level_limit limit{simd::level::portable};
    CHECK(train(par.with(2), images, options).value() == words);
  }
  auto other = options;
  other.seed = 2;
  CHECK(train(seq, images, other).value() != words);
}

TEST_CASE("the weight of a word is the logarithm of how rare it is among the images that taught it") {
  const auto images = test::make_images(50, 40, 1);
  const auto words = train(seq, images, {.branching = 8, .depth = 3}).value();
  std::vector<std::set<std::size_t>> with(words.size());
  for (std::size_t i = 0; i != images.size(); ++i)
    for (const auto& d : images[i]) with[words.find_word(d)].insert(i);
  for (std::uint32_t w = 0; w != words.size(); ++w) {
    REQUIRE_FALSE(with[w].empty());  // each is the nearest of what it was made of
    CHECK(words.weight(w) == Approx(std::log(50.0 / static_cast<double>(with[w].size()))).margin(1e-6));
  }
}

TEST_CASE("what is clearly apart becomes words of its own") {
  const auto images = test::make_images(60, 50, 1, 40, 6);
  const auto words = train(seq, images, {.branching = 10, .depth = 3}).value();
  const auto again = test::make_images(5, 100, 77, 40, 6);
  random_bits kinds{99};
  // Noise of a few bits seldom changes the word.
  std::size_t same = 0, all = 0;
  for (int thing = 0; thing != 40; ++thing) {
    const auto prototype = test::random_descriptor(kinds);
    random_bits random{static_cast<std::uint64_t>(thing)};
    for (int i = 0; i != 20; ++i, ++all)
      same += words.find_word(test::noisy(prototype, 3, random)) == words.find_word(prototype) ? 1 : 0;
  }
  CHECK(same * 10 > all * 8);
  CHECK_FALSE(words.transform(again[0]).empty());
}

TEST_CASE("training on what teaches nothing says so, or ends early") {
  using image = test::descriptors<>;
  const auto none = train(seq, std::vector<image>{});
  REQUIRE_FALSE(none);
  CHECK(none.error().code == errc::no_data);
  CHECK(train(seq, std::vector<image>(3)).error().code == errc::no_data);
  const auto one = test::make_images(1, 50, 1);
  CHECK(train(seq, one).error().code == errc::invalid_argument);
  CHECK(train(seq, one, {.weighting = weighting::binary}).has_value());

  random_bits random{1};
  const auto d = test::random_descriptor(random);
  const auto same = train(seq, std::vector<image>{{d, d, d}, {d}}, {.branching = 3, .depth = 5}).value();
  CHECK(same.size() == 1);  // the root is the only word
  CHECK(same.find_word(d) == 0);
  CHECK(same.transform(image{d}).empty());  // it is in every image and tells nothing
  const auto e = test::random_descriptor(random);
  const auto two = train(seq, std::vector<image>{{d, d, e}, {d}}, {.branching = 3, .depth = 5}).value();
  CHECK(two.size() == 2);
  CHECK(two.find_word(d) != two.find_word(e));
}

TEST_CASE("training reports how far it is, and stops when asked to") {
  const auto images = test::make_images(40, 50, 1);
  std::size_t calls = 0, last = 0, total = 0;
  const auto report = [&](std::size_t done, std::size_t of) {
    ++calls;
    CHECK(done >= last);
    CHECK(done <= of);
    last = done;
    total = of;
    return true;
  };
  REQUIRE(train(par.with(2), images, {.branching = 6, .depth = 3}, report));
  CHECK(calls >= 3);
  CHECK(total == 40 * 50 * 3);
  CHECK(last == total);
  const auto stop = [](std::size_t, std::size_t) { return false; };
  const auto stopped = train(seq, images, {}, stop);
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().code == errc::cancelled);
}

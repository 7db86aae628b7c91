// SPDX-License-Identifier: BSD-3-Clause
#include "train_vocabulary/dbow_text.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "places/images.hpp"
#include "places/train_vocabulary/foreign_files.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;
using dbow::parse_dbow_text;
using orbis::test::byte_list;

TEST_CASE("a vocabulary in DBoW2's text gives the same words and bags, whatever the order of its nodes") {
  const auto words = test::small_vocabulary(5, 3);
  for (const bool depth_first : {false, true}) {
    const auto read = parse_dbow_text(test::dbow_text_of(words, depth_first));
    REQUIRE(read);
    CHECK(*read == words);  // our order is by level, whatever the file's
    const auto image = test::make_images(1, 300, 4)[0];
    CHECK(read->transform(image) == words.transform(image));
  }
  const std::string text = test::dbow_text_of(words, true);
  CHECK(parse_dbow_text(text + "\n  \n").value() == words);
  std::string windows;
  for (const char c : text) windows += c == '\n' ? "\r\n" : std::string(1, c);
  CHECK(parse_dbow_text(windows).value() == words);
  CHECK(parse_dbow_text("10 6 0 1\n").value().weighting() == weighting::tf);
}

TEST_CASE("what is wrong with a vocabulary in text is said with its line") {
  const std::string bytes = byte_list(32);
  const std::string good = "10 6 0 0\n0 0 " + bytes + "0\n1 1 " + bytes + "1.5\n1 1 " + bytes + "2.5e-1\n";
  REQUIRE(parse_dbow_text(good).value().size() == 2);
  const auto where = [](const std::string& text) {
    const auto read = parse_dbow_text(text, "words.txt");
    REQUIRE_FALSE(read);
    CHECK(read.error().code == errc::malformed);
    CHECK_FALSE(read.error().message.empty());
    return read.error().where;
  };
  CHECK(where("") == "words.txt:1");
  CHECK(where("ten 6 0 0\n") == "words.txt:1");
  CHECK(where("10 6 0\n") == "words.txt:1");
  CHECK(where("10 6 0 0 9\n") == "words.txt:1");
  CHECK(where("10 6 6 0\n") == "words.txt:1");
  CHECK(where("10 6 0 4\n") == "words.txt:1");
  CHECK(where(good + "9 1 " + bytes + "1\n") == "words.txt:5");  // a parent that comes later
  CHECK(where(good + "-1 1 " + bytes + "1\n") == "words.txt:5");
  CHECK(where(good + "0 2 " + bytes + "1\n") == "words.txt:5");  // neither a word nor an inner node
  CHECK(where(good + "0 1 " + byte_list(31) + "1\n") == "words.txt:5");
  CHECK(where(good + "0 1 " + byte_list(33) + "1\n") == "words.txt:5");
  CHECK(where(good + "0 1 256 " + byte_list(31) + "1\n") == "words.txt:5");
  CHECK(where(good + "0 1 " + bytes + "-1\n") == "words.txt:5");
  CHECK(where(good + "0 1 " + bytes + "nan\n") == "words.txt:5");
  CHECK(where(good + "0 1 " + bytes + "1e300\n") == "words.txt:5");
  CHECK(where(good + "\n0 1 " + bytes + "1\n") == "words.txt:5");
  CHECK(where(good + "0 1") == "words.txt:5");
  CHECK(where(good + "0 0 " + bytes + "0\n") == "words.txt:5");  // an inner node without children
  CHECK(where(good + "2 1 " + bytes + "0\n") == "words.txt:3");  // a word with a child
}

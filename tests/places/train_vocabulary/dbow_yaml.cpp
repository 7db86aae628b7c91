// SPDX-License-Identifier: BSD-3-Clause
#include "train_vocabulary/dbow_yaml.hpp"

#include <string>

#include "places/images.hpp"
#include "places/train_vocabulary/foreign_files.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;
using dbow::parse_dbow_yaml;
using orbis::test::byte_list;

TEST_CASE("a vocabulary in YAML gives the same words and bags, in each way that descriptors are written") {
  const auto words = test::small_vocabulary(5, 3);
  const auto image = test::make_images(1, 300, 4)[0];
  for (const bool depth_first : {false, true})
    for (const std::string before : {"", "0 32 ", "dbw3 0 32 "})
      for (const std::string quote : {"", "\""}) {
        const auto read = parse_dbow_yaml(test::dbow_yaml_of(words, depth_first, before, quote));
        REQUIRE(read);
        CHECK(*read == words);
        CHECK(read->transform(image) == words.transform(image));
      }
  std::string text = test::dbow_yaml_of(words, true, "", "\"");
  CHECK(parse_dbow_yaml(text.substr(0, text.find("   words:"))).value() == words);  // leaves are words all the same
}

TEST_CASE("what is wrong with a vocabulary in YAML is said with its line") {
  const std::string head =
      "%YAML:1.0\nvocabulary:\n   k: 2\n   L: 1\n   scoringType: 0\n   weightingType: 0\n   nodes:\n";
  const auto node = [](int id, int parent, const std::string& descriptor, const std::string& weight = "1.5") {
    return "      - { nodeId:" + std::to_string(id) + ", parentId:" + std::to_string(parent) + ", weight:" + weight +
           ", descriptor:\"" + descriptor + "\" }\n";
  };
  const std::string bytes = byte_list(32);
  const std::string good = head + node(1, 0, bytes) + node(2, 0, "dbw3 0 32 " + bytes, "0.");
  REQUIRE(parse_dbow_yaml(good).value().size() == 2);
  const auto error_of = [](const std::string& text) {
    const auto read = parse_dbow_yaml(text, "words.yml");
    REQUIRE_FALSE(read);
    CHECK_FALSE(read.error().message.empty());
    return read.error();
  };
  CHECK(error_of("").where == "words.yml:1");
  CHECK(error_of("%YAML:1.0\n---\ncamera:\n").where == "words.yml:3");
  CHECK(error_of("vocabulary:\n   k: 2\n").where == "words.yml:3");
  CHECK(error_of("vocabulary:\n   k: two\n").code == errc::malformed);
  CHECK(error_of("vocabulary:\n   weightingType: 4\n").code == errc::malformed);
  CHECK(error_of(good + node(4, 0, bytes)).where == "words.yml:10");  // an id beyond their number
  CHECK(error_of(good + node(2, 0, bytes)).where == "words.yml:10");  // there already
  CHECK(error_of(good + node(3, 3, bytes)).where == "words.yml:10");  // its own parent
  CHECK(error_of(good + node(3, 7, bytes)).where == "words.yml:10");
  CHECK(error_of(good + node(3, 0, byte_list(31))).code == errc::unsupported);
  CHECK(error_of(good + node(3, 0, byte_list(35))).code == errc::unsupported);
  CHECK(error_of(good + node(3, 0, "dbw3 5 32 " + bytes)).code == errc::unsupported);
  CHECK(error_of(good + node(3, 0, "0.5 " + byte_list(31))).code == errc::unsupported);
  CHECK(error_of(good + node(3, 0, "300 " + byte_list(31))).where == "words.yml:10");
  CHECK(error_of(good + node(3, 0, bytes, "-1")).where == "words.yml:10");
  CHECK(error_of(good + node(3, 0, bytes, ".Nan")).where == "words.yml:10");
  CHECK(error_of(good + "      - { nodeId:3, parentId:0, weight:1. }\n").where == "words.yml:10");
  CHECK(error_of(good + "      - { nodeId:3, parentId:0").where == "words.yml:10");
  CHECK(error_of(good + "      - nodeId:3\n").where == "words.yml:10");
  CHECK(error_of(good + "   words:\n      - { wordId:0, nodeId:9 }\n").where == "words.yml:11");
  CHECK(error_of(good + "   words:\n      - { wordId:0, nodeId:1 }\n").where == "words.yml:9");  // 2 is none, nor inner
  CHECK(error_of(good + "   words:\n      - { wordId:0 }\n").where == "words.yml:11");
}

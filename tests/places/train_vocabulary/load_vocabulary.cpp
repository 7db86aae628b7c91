// SPDX-License-Identifier: BSD-3-Clause
#include "train_vocabulary/load_vocabulary.hpp"

#include <orbis/places/vocabulary_file.hpp>

#include "support/temporary_folder.hpp"
#include "places/images.hpp"
#include "places/train_vocabulary/foreign_files.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;
using dbow::load_vocabulary;

TEST_CASE("a vocabulary is loaded from each known format") {
  const test::temporary_folder folder;
  const auto words = test::small_vocabulary(6, 4);
  REQUIRE(write_vocabulary(folder / "words.voc", words));
  CHECK(load_vocabulary(folder / "words.voc").value() == words);
  CHECK(load_vocabulary(folder.write("full.txt", test::dbow_text_of(words, true))).value() == words);
  CHECK(load_vocabulary(folder.write("full.yml", test::dbow_yaml_of(words, true, "", "\""))).value() == words);
  CHECK(load_vocabulary(folder.write("words.txt", "10 6 0 0\n")).value().empty());
  CHECK(load_vocabulary(folder.write("words.yml", "%YAML:1.0\nvocabulary:\n   nodes: []\n")).value().empty());
}

TEST_CASE("files that do not exist, are no files or are compressed are refused") {
  const test::temporary_folder folder;
  CHECK(load_vocabulary(folder / "none").error().code == errc::not_found);
  CHECK(load_vocabulary(folder.path()).error().code == errc::unreadable);
  const auto zipped = load_vocabulary(folder.write("words.yml.gz", "\x1f\x8b\x08"));
  CHECK(zipped.error().code == errc::unsupported);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/random.hpp>
#include <orbis/places/vocabulary_file-inl.hpp>

#include "places/images.hpp"
#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

using namespace orbis;
using namespace orbis::places;

namespace {

[[nodiscard]] auto parse(const std::string& bytes) { return parse_vocabulary(std::as_bytes(std::span{bytes})); }

void reseal(std::string& bytes) {
  const std::uint32_t sum = crc32c(std::as_bytes(std::span{bytes}).subspan(16));
  for (unsigned i = 0; i != 4; ++i) bytes[12 + i] = static_cast<char>((sum >> (8 * i)) & 0xffU);
}

}  // namespace

TEST_CASE("a vocabulary comes back from a file as it was, of every weighting and length of descriptors") {
  const test::temporary_folder folder;
  for (const weighting kind : {weighting::tf_idf, weighting::tf, weighting::idf, weighting::binary}) {
    const auto words = test::small_vocabulary(6, 4, kind);
    REQUIRE(write_vocabulary(folder / "words.voc", words));
    {
      const auto again = read_vocabulary(folder / "words.voc");
      REQUIRE(again);
      CHECK(*again == words);
      CHECK(again->depth() == words.depth());
      CHECK(again->branching() == words.branching());
      const auto image = test::make_images(1, 200, 4)[0];
      CHECK(again->transform(image) == words.transform(image));
      CHECK(vocabulary_bytes(*again) == vocabulary_bytes(words));
    }
  }
  const auto wide = test::small_vocabulary<512>(4, 3);
  REQUIRE(write_vocabulary(folder / "wide.voc", wide));
  CHECK(read_vocabulary<512>(folder / "wide.voc").value() == wide);
  CHECK(read_vocabulary<256>(folder / "wide.voc").error().code == errc::unsupported);
  const vocabulary none;
  CHECK(parse(vocabulary_bytes(none)).value() == none);
}

TEST_CASE("the bytes of a file are fixed") {
  vocabulary_tree<256> tree;
  tree.resize(3);
  tree.descriptors.values()[0] = {0x0706050403020100ULL, 1, 2, 3};
  tree.descriptors.values()[1] = {4, 5, 6, ~std::uint64_t{0}};
  tree.weights = {1.0F, 0.5F};
  tree.weights_are = weighting::idf;
  REQUIRE(connect_tree(tree, std::array<std::uint16_t, 1>{2}).empty());
  const std::string bytes = vocabulary_bytes(vocabulary{std::move(tree)});
  REQUIRE(bytes.size() == 64 + 2 * 32 + 2 * 4 + 2);
  CHECK(bytes.substr(0, 12) == std::string("orbisvoc\1\0\0\0", 12));
  CHECK(bytes.substr(16, 20) == std::string("\0\1\0\0\2\0\0\0\3\0\0\0\1\0\0\0\2\0\0\0", 20));
  CHECK(bytes.substr(64, 9) == std::string("\0\1\2\3\4\5\6\7\1", 9));
  CHECK(bytes.substr(128) == std::string("\0\0\x80\x3f\0\0\0\x3f\2\0", 10));
  CHECK(parse(bytes).value().weighting() == weighting::idf);
}

TEST_CASE("a file that is cut short or has any bit turned over is refused") {
  const std::string bytes = vocabulary_bytes(test::small_vocabulary(4, 2));
  for (std::size_t length = 0; length < bytes.size(); length += 1 + length / 16) {
    const auto cut = parse(bytes.substr(0, length));
    REQUIRE_FALSE(cut);
    CHECK(cut.error().code == errc::malformed);
  }
  CHECK_FALSE(parse(bytes + '\0'));
  random_bits random{1};
  for (int i = 0; i != 400; ++i) {
    std::string damaged = bytes;
    const std::size_t at =
        i < 64 ? static_cast<std::size_t>(i) : random.below(static_cast<std::uint32_t>(bytes.size()));
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random.below(8)));
    const auto result = parse(damaged);
    REQUIRE_FALSE(result);
    CHECK((result.error().code == errc::malformed || result.error().code == errc::unsupported));
    CHECK_FALSE(result.error().message.empty());
  }
}

TEST_CASE("what a file with the right checksum declares is checked all the same") {
  const std::string bytes = vocabulary_bytes(test::small_vocabulary(4, 2));
  const auto message_of = [&](std::size_t at, std::string_view change) {
    std::string changed = bytes;
    changed.replace(at, change.size(), change);
    reseal(changed);
    const auto result = parse(changed);
    REQUIRE_FALSE(result);
    return result.error().message;
  };
  using std::string_view_literals::operator""sv;
  CHECK(message_of(8, "\2"sv) == "version 2; only version 1 is supported");
  CHECK(message_of(16, "\0\2"sv) == "descriptors have 512 bits, expected 256");
  CHECK(message_of(20, "\7"sv).starts_with("weighting 7"));
  CHECK(message_of(24, "\xff\xff\xff\xff"sv).find("but the header requires") != std::string::npos);
  CHECK(message_of(24, "\0\0\0\0"sv).starts_with("more inner nodes"));
  CHECK(message_of(bytes.size() - 2, "\0\0"sv).find("no parent") != std::string::npos);
  CHECK(message_of(bytes.size() - 2, "\xff\xff"sv).find("children") != std::string::npos);
}

TEST_CASE("files that do not exist or are no files are refused") {
  const test::temporary_folder folder;
  CHECK(read_vocabulary(folder / "none").error().code == errc::not_found);
  CHECK(read_vocabulary(folder.path()).error().code == errc::unreadable);
  CHECK_FALSE(write_vocabulary(folder / "no" / "such" / "folder", vocabulary{}));
}

// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a vocabulary, of descriptors of 64 and of 256 bits: our own format as it is and with its checksum put
// right, and the formats of others.
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/places/vocabulary_file-inl.hpp>

#include "fuzz/target.hpp"
#include "train_vocabulary/dbow_text.hpp"
#include "train_vocabulary/dbow_yaml.hpp"

namespace {

using namespace orbis;
using namespace orbis::places;

template <std::size_t Bits>
void use(const basic_vocabulary<Bits>& read) {
  fuzz::accept();
  const std::string bytes = vocabulary_bytes(read);
  const auto again = parse_vocabulary<Bits>(std::as_bytes(std::span{bytes}));
  fuzz::require(again && *again == read, "what was read can be written and read again");
  fuzz::require(vocabulary_bytes(*again) == bytes, "to the same bytes");
  std::vector<std::array<std::uint64_t, Bits / 64>> image(40);
  std::uint64_t number = 0;
  for (auto& descriptor : image)
    for (std::uint64_t& part : descriptor) part = number++ * 0x9e3779b97f4a7c15ULL;
  bag_of_words bag;
  transform_workspace memory;
  read.transform(image, bag, memory);
  for (const word_value& w : bag.words) fuzz::require(w.word < read.size(), "words are words");
  const bag_of_words with = bag;
  const simd::level_limit limit{simd::level::portable};
  read.transform(image, bag, memory);
  fuzz::require(bag == with, "levels make no difference");
}

template <std::size_t Bits, class Parse>
void check(Parse&& parse, std::size_t size, std::size_t times) {
  std::optional<result<basic_vocabulary<Bits>>> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(parse()); });
  fuzz::require(peak <= times * size + 8192, "memory in proportion to the file");
  if (*got) return use(**got);
  const error& e = got->error();
  fuzz::require(e.code == errc::malformed || e.code == errc::unsupported, "a damaged file is malformed or unsupported");
  fuzz::require(!e.message.empty() && e.to_string().size() < 300, "the reason is given, and short");
}

// Of short descriptors there are more nodes in as many bytes; those of 256 bits are what is used.
template <std::size_t Bits>
void check_all(std::string bytes) {
  const std::size_t size = bytes.size();
  check<Bits>([&] { return dbow::parse_dbow_text<Bits>(bytes); }, size, 16);
  check<Bits>([&] { return dbow::parse_dbow_yaml<Bits>(bytes); }, size, 16);
  check<Bits>([&] { return parse_vocabulary<Bits>(std::as_bytes(std::span{bytes})); }, size, 8);
  if (size < 16) return;
  const std::uint32_t sum = crc32c(std::as_bytes(std::span{bytes}).subspan(16));
  for (unsigned i = 0; i != 4; ++i) bytes[12 + i] = static_cast<char>((sum >> (8 * i)) & 0xffU);
  check<Bits>([&] { return parse_vocabulary<Bits>(std::as_bytes(std::span{bytes})); }, size, 8);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes{reinterpret_cast<const char*>(data), size};
  check_all<64>(bytes);
  check_all<256>(bytes);
  return 0;
}

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of vocabulary_file.hpp.
#pragma once

#include <array>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <ostream>
#include <system_error>
#include <utility>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/vocabulary-inl.hpp>
#include <orbis/places/vocabulary_file.hpp>
#include <orbis/places/vocabulary_tree.hpp>

namespace orbis::places {

namespace detail {

inline constexpr std::uint32_t vocabulary_version = 1;
inline constexpr std::size_t vocabulary_header = 64, vocabulary_checked_from = 16;

/// The words of all descriptors, concatenated.
template <std::size_t Bits>
[[nodiscard]] std::span<std::uint64_t> all_words(std::span<bit_words<Bits>> descriptors) noexcept {
  return descriptors.empty() ? std::span<std::uint64_t>{}
                             : std::span{descriptors.front().data(), descriptors.size() * (Bits / 64)};
}

/// Reads a vocabulary of `size` bytes with `read(span)`, which fills the span or returns an error.
template <std::size_t Bits, class Read>
[[nodiscard]] result<basic_vocabulary<Bits>> read_vocabulary_by(Read&& read, std::uint64_t size,
                                                                const std::string& where) {
  const auto bad = [&](std::string why) { return fail(errc::malformed, where, std::move(why)); };
  std::array<char, vocabulary_header> header{};
  if (size < header.size()) return bad("too short for a vocabulary");
  if (auto done = read(std::as_writable_bytes(std::span{header})); !done) return fail(done.error());
  if (std::memcmp(header.data(), vocabulary_magic.data(), vocabulary_magic.size()) != 0)
    return bad("not an orbis vocabulary: it does not begin with \"orbisvoc\"");
  const auto field = [&](std::size_t at) { return load_number<std::uint32_t>(header.data() + at); };
  if (field(8) != vocabulary_version)
    return fail(errc::unsupported, where, "version " + std::to_string(field(8)) + "; only version 1 is supported");
  if (field(16) != Bits)
    return fail(errc::unsupported, where,
                "descriptors have " + std::to_string(field(16)) + " bits, expected " + std::to_string(Bits));
  const std::uint32_t nodes = field(24), inner_end = field(28), words = field(32);
  if (field(20) > 3) return bad("weighting " + std::to_string(field(20)) + ", must be 0 to 3");
  if (nodes == 0 || inner_end > nodes || words > nodes) return bad("more inner nodes or words than nodes");
  const std::uint64_t expected =
      header.size() + std::uint64_t{nodes - 1} * (Bits / 8) + std::uint64_t{words} * 4 + std::uint64_t{inner_end} * 2;
  if (size != expected)
    return bad(std::to_string(size) + " bytes, but the header requires " + std::to_string(expected));

  vocabulary_tree<Bits> tree;
  tree.resize(nodes);
  tree.weights_are = static_cast<weighting>(field(20));
  std::uint32_t sum = crc32c(std::as_bytes(std::span{header}).subspan(vocabulary_checked_from));
  const auto read_all = [&]<class T>(std::span<T> values) -> result<void> {
    const auto bytes = std::as_writable_bytes(values);
    if (auto done = read(bytes); !done) return done;
    sum = crc32c(bytes, sum);
    if constexpr (std::endian::native != std::endian::little)
      for (T& value : values) value = load_number<T>(reinterpret_cast<const char*>(&value));
    return {};
  };
  if (auto done = read_all(all_words<Bits>(tree.descriptors.values())); !done) return fail(done.error());
  tree.weights.resize(words);
  if (auto done = read_all(std::span{tree.weights}); !done) return fail(done.error());
  std::vector<std::uint16_t> child_counts(inner_end);
  if (auto done = read_all(std::span{child_counts}); !done) return fail(done.error());
  if (sum != field(12)) return bad("checksum mismatch: the file is damaged");
  if (std::string problem = connect_tree(tree, child_counts); !problem.empty()) return bad(std::move(problem));
  return basic_vocabulary<Bits>{std::move(tree)};
}

}  // namespace detail

template <std::size_t Bits>
std::string vocabulary_bytes(const basic_vocabulary<Bits>& vocabulary) {
  const auto& tree = vocabulary.tree();
  std::string bytes(vocabulary_magic);
  for (const std::uint32_t field :
       {detail::vocabulary_version, 0U, static_cast<std::uint32_t>(Bits), static_cast<std::uint32_t>(tree.weights_are),
        tree.node_count, tree.inner_end(), tree.word_count()})
    append_little_endian(bytes, field);
  bytes.resize(detail::vocabulary_header);
  for (const auto& descriptor : tree.descriptors.values())
    for (const std::uint64_t word : descriptor) append_little_endian(bytes, word);
  for (const float weight : tree.weights) append_little_endian(bytes, weight);
  for (std::size_t i = 0; i + 1 < tree.nodes.size(); ++i)
    append_little_endian(bytes, static_cast<std::uint16_t>(tree.nodes[i + 1].first_child - tree.nodes[i].first_child));
  std::string sum;
  append_little_endian(sum, crc32c(std::as_bytes(std::span{bytes}).subspan(detail::vocabulary_checked_from)));
  bytes.replace(12, sum.size(), sum);
  return bytes;
}

template <std::size_t Bits>
result<basic_vocabulary<Bits>> parse_vocabulary(std::span<const std::byte> bytes, const std::string& where) {
  std::size_t at = 0;
  const auto read = [&](std::span<std::byte> to) -> result<void> {
    if (!to.empty()) std::memcpy(to.data(), bytes.data() + at, to.size());
    at += to.size();
    return {};
  };
  return detail::read_vocabulary_by<Bits>(read, bytes.size(), where);
}

template <std::size_t Bits>
result<basic_vocabulary<Bits>> read_vocabulary(const std::filesystem::path& path) {
  std::error_code ec;
  const auto status = std::filesystem::status(path, ec);
  if (status.type() == std::filesystem::file_type::not_found)
    return fail(errc::not_found, path.string(), "no such file");
  if (!std::filesystem::is_regular_file(status)) return fail(errc::unreadable, path.string(), "is not a regular file");
  std::ifstream in{path, std::ios::binary};
  if (!in) return fail(errc::unreadable, path.string(), "cannot be opened: " + std::generic_category().message(errno));
  const auto size = std::filesystem::file_size(path, ec);
  if (ec) return fail(errc::unreadable, path.string(), "cannot determine the size: " + ec.message());
  const auto read = [&](std::span<std::byte> to) -> result<void> {
    if (in.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(to.size()))) return {};
    return fail(errc::unreadable, path.string(), "is shorter than its reported size");
  };
  return detail::read_vocabulary_by<Bits>(read, size, path.string());
}

template <std::size_t Bits>
result<void> write_vocabulary(const std::filesystem::path& path, const basic_vocabulary<Bits>& vocabulary) {
  const std::string bytes = vocabulary_bytes(vocabulary);
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}

}  // namespace orbis::places

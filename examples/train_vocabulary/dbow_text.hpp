// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Vocabularies in the text format of DBoW2, the format of ORB-SLAM's vocabulary.
///
/// The first line contains the branching factor, the depth, the type of score (0 to 5; ignored, because orbis does not
/// store it) and the weighting (0 tf-idf, 1 tf, 2 idf, 3 binary). Each subsequent line is a node; nodes are numbered
/// from 1. A line contains the index of the parent (0: the root), 1 for a word or 0 for an inner node, the bytes of the
/// descriptor, and the weight.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <orbis/core/bits.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/places/vocabulary_tree.hpp>

#include "parent_list.hpp"

namespace dbow {

using namespace orbis;
using namespace orbis::places;

[[nodiscard]] constexpr bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/// Removes the next field, which ends at a blank, and returns it.
[[nodiscard]] inline std::string_view take_field(std::string_view& text) noexcept {
  std::size_t begin = 0;
  while (begin != text.size() && is_blank(text[begin])) ++begin;
  std::size_t end = begin;
  while (end != text.size() && !is_blank(text[end])) ++end;
  const std::string_view field = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return field;
}

/// Removes a number from the front of `text`; returns false if there is none.
template <class T>
[[nodiscard]] bool take_number(std::string_view& text, T& value) noexcept {
  const std::string_view field = take_field(text);
  const auto [end, failure] = std::from_chars(field.data(), field.data() + field.size(), value);
  return failure == std::errc{} && end == field.data() + field.size() && !field.empty();
}

/// Sets byte `i` of a descriptor, in OpenCV's order.
template <std::size_t Bits>
constexpr void set_byte(bit_words<Bits>& descriptor, std::size_t i, std::uint8_t byte) noexcept {
  descriptor[i / 8] |= std::uint64_t{byte} << (8 * (i % 8));
}

/// Returns true if the weight is valid for a word.
[[nodiscard]] inline bool good_weight(double weight) noexcept {
  return weight >= 0.0 && weight <= static_cast<double>(largest_weight);
}

/// Parses the vocabulary in `text`; `where` names the source in errors. Words are renumbered; bags of words and scores
/// are the same as in DBoW2. Errors (with the line number): malformed.
template <std::size_t Bits = 256>
[[nodiscard]] result<basic_vocabulary<Bits>> parse_dbow_text(std::string_view text, const std::string& where = "text") {
  std::size_t line_number = 0;
  const auto bad = [&](std::size_t line, std::string why) {
    return fail(errc::malformed, where + ":" + std::to_string(line), std::move(why));
  };
  const auto next_line = [&] {
    ++line_number;
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    return line;
  };

  std::string_view head = next_line();
  std::int64_t branching = 0, depth = 0, score = 0, weights_are = 0;
  if (!take_number(head, branching) || !take_number(head, depth) || !take_number(head, score) ||
      !take_number(head, weights_are) || !take_field(head).empty())
    return bad(1, "the first line must contain branching, depth, score and weighting");
  if (branching < 1 || depth < 1) return bad(1, "branching and depth must be at least 1");
  if (score < 0 || score > 5) return bad(1, "the score must be between 0 and 5");
  if (weights_are < 0 || weights_are > 3) return bad(1, "the weighting must be between 0 and 3");

  parent_list<Bits> list;
  std::vector<bool> is_word{false};
  while (!text.empty()) {
    std::string_view line = next_line();
    std::uint32_t parent = 0;
    int leaf = 0;
    double weight = 0.0;
    if (std::string_view rest = line; take_field(rest).empty()) {
      if (take_field(text).empty()) break;  // trailing blank lines
      return bad(line_number, "a blank line between nodes");
    }
    if (!take_number(line, parent)) return bad(line_number, "does not begin with the index of the parent");
    if (parent > list.size()) return bad(line_number, "the parent must precede its child");
    if (!take_number(line, leaf) || leaf < 0 || leaf > 1)
      return bad(line_number, "the second field must be 1 (word) or 0 (inner node)");
    bit_words<Bits> descriptor{};
    for (std::size_t i = 0; i != Bits / 8; ++i) {
      std::uint8_t byte = 0;
      if (!take_number(line, byte))
        return bad(line_number, "the descriptor has fewer than " + std::to_string(Bits / 8) + " bytes from 0 to 255");
      set_byte<Bits>(descriptor, i, byte);
    }
    if (!take_number(line, weight) || !good_weight(weight))
      return bad(line_number, "expected a weight from 0 to 1e20 after " + std::to_string(Bits / 8) + " bytes");
    if (!take_field(line).empty()) return bad(line_number, "extra text after the node");
    list.parents.push_back(parent);
    list.descriptors.push_back(descriptor);
    list.weights.push_back(static_cast<float>(weight));
    is_word.push_back(leaf == 1);
  }

  vocabulary_tree<Bits> tree;
  tree.weights_are = static_cast<weighting>(weights_are);
  const auto problem = order_by_level(
      list, [&](std::uint32_t node) { return is_word[node]; }, tree);
  if (!problem.what.empty())  // node i is on line i + 1
    return bad(problem.node + 1, "node " + std::to_string(problem.node) + " " + problem.what);
  return basic_vocabulary<Bits>{std::move(tree)};
}

/// Reads a file. Errors: not_found, unreadable, malformed.
template <std::size_t Bits = 256>
[[nodiscard]] result<basic_vocabulary<Bits>> read_dbow_text(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_dbow_text<Bits>(*text, path.string());
}

}  // namespace dbow

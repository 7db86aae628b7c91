// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Vocabularies in the YAML format of DBoW2 and DBoW3, as OpenCV's FileStorage writes it:
///
///     %YAML:1.0
///     vocabulary:
///        k: 10
///        L: 5
///        scoringType: 0
///        weightingType: 0
///        nodes:
///           - { nodeId:1, parentId:0, weight:0., descriptor:"dbw3 0 32 27 159 ..." }
///        words:
///           - { wordId:0, nodeId:31 }
///
/// DBoW3 writes OpenCV's type (0: bytes) and the number of columns before the bytes of a descriptor; newer versions
/// write "dbw3" before these numbers. DBoW2 writes only the bytes. The parser supports only this subset of YAML.
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <orbis/core/file.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/core/result.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/places/vocabulary_tree.hpp>

#include "dbow_text.hpp"
#include "parent_list.hpp"

namespace dbow {

using namespace orbis;
using namespace orbis::places;

/// A scanner that counts lines.
class yaml_scanner {
 public:
  explicit yaml_scanner(std::string_view text) : text_{text} {}

  [[nodiscard]] std::size_t line() const noexcept { return line_; }
  [[nodiscard]] bool at_end() const noexcept { return text_.empty(); }
  void skip_blanks() noexcept {
    while (!text_.empty() && is_blank(text_.front())) drop();
  }
  void skip_line() noexcept {
    while (!text_.empty() && text_.front() != '\n') drop();
  }
  /// Skips blanks and then `c`; returns false if another character follows.
  [[nodiscard]] bool take(char c) noexcept {
    skip_blanks();
    if (text_.empty() || text_.front() != c) return false;
    drop();
    return true;
  }
  [[nodiscard]] bool comes(char c) noexcept {
    skip_blanks();
    return !text_.empty() && text_.front() == c;
  }
  /// Reads a name and the colon after it; empty if anything else follows.
  [[nodiscard]] std::string_view take_key() noexcept {
    skip_blanks();
    const std::size_t end = text_.find_first_of(":,{}\n\"");
    if (end == std::string_view::npos || text_[end] != ':') return {};
    const std::string_view key = text_.substr(0, end);
    text_.remove_prefix(end + 1);
    return key;
  }
  /// Reads the value of a key: in quotes, or up to a comma, a brace or (outside braces) the end of the line.
  [[nodiscard]] std::string_view take_value(bool in_braces) noexcept {
    while (!text_.empty() && (text_.front() == ' ' || text_.front() == '\t' || (in_braces && is_blank(text_.front()))))
      drop();
    if (!text_.empty() && text_.front() == '"') {
      drop();
      const std::string_view value = take_until("\"");
      if (!text_.empty()) drop();
      return value;
    }
    return take_until(in_braces ? ",}" : "\n");
  }

 private:
  void drop() noexcept {
    if (text_.front() == '\n') ++line_;
    text_.remove_prefix(1);
  }
  [[nodiscard]] std::string_view take_until(std::string_view ends) noexcept {
    const std::string_view all = text_;
    while (!text_.empty() && ends.find(text_.front()) == std::string_view::npos) drop();
    return all.substr(0, all.size() - text_.size());
  }

  std::string_view text_;
  std::size_t line_ = 1;
};

template <std::size_t Bits>
class dbow_yaml_parser {
 public:
  dbow_yaml_parser(std::string_view text, const std::string& where) : scan_{text}, where_{where} {}

  [[nodiscard]] result<basic_vocabulary<Bits>> parse() {
    if (!read_head() || !read_entries() || !order()) return fail(code_, where_ + ":" + std::to_string(line_), problem_);
    return basic_vocabulary<Bits>{std::move(tree_)};
  }

 private:
  struct node {
    std::uint32_t id = 0, parent = 0;
    std::size_t line = 0;
  };

  bool reject(std::string why, errc code = errc::malformed) {
    problem_ = std::move(why);
    code_ = code;
    line_ = scan_.line();
    return false;
  }
  bool reject(std::string why, std::size_t line) {
    reject(std::move(why));
    line_ = line;
    return false;
  }

  /// Skips the text up to and including "vocabulary:".
  bool read_head() {
    for (;;) {
      scan_.skip_blanks();
      if (scan_.at_end()) return reject("has no \"vocabulary:\"");
      if (scan_.comes('%') || scan_.comes('-') || scan_.comes('#')) {
        scan_.skip_line();
        continue;
      }
      if (scan_.take_key() == "vocabulary") return true;
      return reject("expected \"vocabulary:\"");
    }
  }

  bool read_entries() {
    bool nodes = false;
    for (;;) {
      scan_.skip_blanks();
      if (scan_.at_end()) break;
      const std::string_view key = scan_.take_key();
      if (key.empty()) return reject("expected an entry of the vocabulary");
      if (key == "nodes") {
        nodes = true;
        if (!read_list([&] { return read_node(); })) return false;
      } else if (key == "words") {
        if (!read_list([&] { return read_word(); })) return false;
      } else {
        const std::string_view value = scan_.take_value(false);
        if (key == "weightingType") {
          if (!number(value, weights_are_) || weights_are_ > 3) return reject("the weighting must be between 0 and 3");
        } else if (key == "k" || key == "L" || key == "scoringType") {
          std::uint32_t ignored = 0;  // the depth follows from the tree; orbis stores no score
          if (!number(value, ignored)) return reject(orbis::in_quotes(key) + " is not a number");
        }
      }
    }
    return nodes || reject("has no nodes");
  }

  template <class Read>
  bool read_list(Read&& read) {
    if (scan_.take('[')) return scan_.take(']') || reject("lists in brackets are not supported");
    while (scan_.take('-'))
      if (!read()) return false;
    return true;
  }

  /// Calls `use(key, value)` for each entry in braces.
  template <class Use>
  bool read_braces(Use&& use) {
    if (!scan_.take('{')) return reject("an item of a list does not begin with a brace");
    while (!scan_.take('}')) {
      const std::string_view key = scan_.take_key();
      if (key.empty()) return reject("expected a key");
      if (!use(key, scan_.take_value(true))) return false;
      if (!scan_.take(',') && !scan_.comes('}')) return reject("expected a comma or a brace after a value");
    }
    return true;
  }

  bool read_node() {
    node n{.line = scan_.line()};
    std::optional<bit_words<Bits>> descriptor;
    double weight = -1.0;
    bool parent = false;
    const bool read = read_braces([&](std::string_view key, std::string_view value) {
      if (key == "nodeId") return number(value, n.id) || reject("the id of a node is not a number");
      if (key == "parentId") return (parent = number(value, n.parent)) || reject("the id of a parent is not a number");
      if (key == "weight")
        return (number(value, weight) && good_weight(weight)) || reject("a weight is outside 0 ... 1e20");
      if (key == "descriptor") return read_descriptor(value, descriptor);
      return true;
    });
    if (!read) return false;
    if (n.id == 0 || !parent || weight < 0.0 || !descriptor)
      return reject("a node has no id (from 1), parent, weight or descriptor", n.line);
    nodes_.push_back(n);
    list_.descriptors.push_back(*descriptor);
    list_.weights.push_back(static_cast<float>(weight));
    return true;
  }

  bool read_word() {
    std::uint32_t id = 0;
    if (!read_braces([&](std::string_view key, std::string_view value) {
          return key != "nodeId" || number(value, id) || reject("the id of a node is not a number");
        }))
      return false;
    if (id == 0) return reject("a word without a node");
    words_.push_back({id, 0, scan_.line()});
    return true;
  }

  bool read_descriptor(std::string_view value, std::optional<bit_words<Bits>>& descriptor) {
    constexpr std::size_t bytes = Bits / 8;
    std::array<std::uint32_t, bytes + 2> numbers{};
    if (std::string_view rest = value; take_field(rest) == "dbw3") value = rest;
    std::size_t count = 0;
    for (;; ++count) {
      if (std::string_view rest = value; take_field(rest).empty()) break;
      if (count == numbers.size() || !take_number(value, numbers[count]))
        return reject("a descriptor does not consist of " + std::to_string(bytes) + " integers", errc::unsupported);
    }
    std::size_t first = 0;
    if (count == bytes + 2) {
      first = 2;
      if (numbers[0] != 0 || numbers[1] != bytes)
        return reject("a descriptor does not consist of " + std::to_string(bytes) + " bytes", errc::unsupported);
    } else if (count != bytes) {
      return reject(
          "a descriptor has " + std::to_string(count) + " numbers instead of " + std::to_string(bytes) + " bytes",
          errc::unsupported);
    }
    bit_words<Bits> words{};
    for (std::size_t i = 0; i != bytes; ++i) {
      if (numbers[first + i] > 255) return reject("a byte of a descriptor is greater than 255");
      set_byte<Bits>(words, i, static_cast<std::uint8_t>(numbers[first + i]));
    }
    descriptor = words;
    return true;
  }

  template <class T>
  [[nodiscard]] static bool number(std::string_view value, T& to) noexcept {
    return take_number(value, to) && take_field(value).empty();
  }

  /// Sorts the nodes by id, and then level by level, the order of orbis. Returns false on an error.
  bool order() {
    const std::size_t n = nodes_.size();
    std::vector<std::uint32_t> entry(n + 1, 0);  // for each id: the index of its node, counted from 1; 0: none
    for (std::size_t i = 0; i != n; ++i) {
      const node& at = nodes_[i];
      if (at.id > n || at.parent > n) return reject("an id exceeds the number of nodes, " + std::to_string(n), at.line);
      if (entry[at.id] != 0) return reject("node " + std::to_string(at.id) + " is defined twice", at.line);
      entry[at.id] = static_cast<std::uint32_t>(i + 1);
    }
    parent_list<Bits> by_id;
    for (std::size_t id = 1; id <= n; ++id) {
      const std::size_t i = entry[id] - 1;
      by_id.parents.push_back(nodes_[i].parent);
      by_id.descriptors.push_back(list_.descriptors[i]);
      by_id.weights.push_back(list_.weights[i]);
    }
    std::vector<bool> is_word(n + 1, words_.empty());
    if (words_.empty()) {
      for (const node& at : nodes_) is_word[at.parent] = false;
    }
    for (const node& w : words_) {
      if (w.id > n || is_word[w.id])
        return reject("a word refers to a nonexistent node or to one with another word", w.line);
      is_word[w.id] = true;
    }
    tree_.weights_are = static_cast<weighting>(weights_are_);
    const auto problem = order_by_level(
        by_id, [&](std::uint32_t id) { return is_word[id]; }, tree_);
    if (problem.what.empty()) return true;
    return reject("node " + std::to_string(problem.node) + " " + problem.what,
                  problem.node == 0 ? 1 : nodes_[entry[problem.node] - 1].line);
  }

  yaml_scanner scan_;
  const std::string& where_;
  parent_list<Bits> list_;  // in the order of the file, without parents
  std::vector<node> nodes_, words_;
  vocabulary_tree<Bits> tree_;
  std::uint32_t weights_are_ = 0;
  std::string problem_;
  errc code_ = errc::malformed;
  std::size_t line_ = 1;
};

/// Parses the vocabulary in `text`; `where` names the source in errors. Words are renumbered. Errors (with the line
/// number): malformed, unsupported (descriptors that do not have `Bits` bits).
template <std::size_t Bits = 256>
[[nodiscard]] result<basic_vocabulary<Bits>> parse_dbow_yaml(std::string_view text, const std::string& where = "text") {
  return dbow_yaml_parser<Bits>{text, where}.parse();
}

/// Reads an uncompressed file. Errors: not_found, unreadable, malformed, unsupported.
template <std::size_t Bits = 256>
[[nodiscard]] result<basic_vocabulary<Bits>> read_dbow_yaml(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_dbow_yaml<Bits>(*text, path.string());
}

}  // namespace dbow

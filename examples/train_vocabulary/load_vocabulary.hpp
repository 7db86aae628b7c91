// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reads a vocabulary in any supported format.
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

#include <orbis/core/result.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/places/vocabulary_file-inl.hpp>

#include "dbow_text.hpp"
#include "dbow_yaml.hpp"

namespace dbow {

using namespace orbis;
using namespace orbis::places;

/// Reads a vocabulary in the format of orbis, DBoW2 (text) or DBoW3 (YAML); detects the format from the first bytes.
/// Errors: not_found, unreadable, malformed, unsupported (a file compressed with gzip, for example).
template <std::size_t Bits = 256>
[[nodiscard]] result<basic_vocabulary<Bits>> load_vocabulary(const std::filesystem::path& path) {
  if (std::error_code ignored;
      std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored))
    return fail(errc::unreadable, path.string(), "is not a regular file");  // reading a pipe may block forever
  char head[8] = {};
  std::ifstream in{path, std::ios::binary};
  in.read(head, sizeof head);
  const std::string_view begins{head, static_cast<std::size_t>(in.gcount())};
  in.close();
  if (begins.starts_with("\x1f\x8b"))
    return fail(errc::unsupported, path.string(), "is compressed: decompress it first");
  if (begins == vocabulary_magic) return read_vocabulary<Bits>(path);
  if (begins.starts_with('%') || begins.starts_with("vocab")) return read_dbow_yaml<Bits>(path);
  return read_dbow_text<Bits>(path);
}

}  // namespace dbow

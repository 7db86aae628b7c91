// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The function of default_vocabulary.hpp: inline, or, with ORBIS_COMPILED, compiled once, by
/// cmake/compiled/places.cpp, so that only that source holds the bytes.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/bytes.hpp>
#include <orbis/core/compiled_once.hpp>
#include <orbis/places/default_vocabulary.hpp>
#include <orbis/places/detail/default_vocabulary_data.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/places/vocabulary_file.hpp>

namespace orbis::places {

ORBIS_COMPILED_ONCE vocabulary default_vocabulary() {
  std::string bytes;
  bytes.reserve(detail::default_vocabulary_size + 4);
  for (const std::string_view text : detail::default_vocabulary_text)
    if (!append_base85(bytes, text)) return {};  // never: tests read it
  bytes.resize(detail::default_vocabulary_size);
  return parse_vocabulary(std::as_bytes(std::span{bytes}), "default vocabulary").value();
}

}  // namespace orbis::places

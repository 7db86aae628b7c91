// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of default_vocabulary.hpp.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <orbis/core/bytes.hpp>
#include <orbis/places/default_vocabulary.hpp>
#include <orbis/places/detail/default_vocabulary_data.hpp>
#include <orbis/places/vocabulary_file-inl.hpp>

namespace orbis::places {

template <std::size_t Bits>
requires(Bits == 256) basic_vocabulary<Bits> default_vocabulary() {
  std::string bytes;
  bytes.reserve(detail::default_vocabulary_size + 4);
  for (const std::string_view text : detail::default_vocabulary_text)
    if (!append_base85(bytes, text)) return {};  // unreachable: covered by tests
  bytes.resize(detail::default_vocabulary_size);
  return parse_vocabulary<Bits>(std::as_bytes(std::span{bytes}), "default vocabulary").value();
}

}  // namespace orbis::places

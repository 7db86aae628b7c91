// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A vocabulary to begin with, which needs no file.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/base85.hpp>
#include <orbis/places/detail/default_vocabulary_data.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/places/vocabulary_file.hpp>

namespace orbis::places {

/// Words of the descriptors of `features::orb_extractor`, learnt on pictures and rooms that were made up: nobody's
/// recordings are in it. Takes a few milliseconds: keep what it returns, whose copies cost nothing. One that is trained
/// on recordings of the places in question, or a larger one, recognises more.
///
/// `train_vocabulary` among the examples makes the data again, byte by byte: see the head of
/// default_vocabulary_data.hpp.
[[nodiscard]] inline vocabulary default_vocabulary() {
  std::string bytes;
  bytes.reserve(detail::default_vocabulary_size + 4);
  for (const std::string_view text : detail::default_vocabulary_text)
    if (!append_base85(bytes, text)) return {};  // never: tests read it
  bytes.resize(detail::default_vocabulary_size);
  return parse_vocabulary(std::as_bytes(std::span{bytes}), "default vocabulary").value();
}

}  // namespace orbis::places

// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A vocabulary for ORB descriptors that needs no file.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/bytes.hpp>
#include <orbis/places/detail/default_vocabulary_data.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/places/vocabulary_file.hpp>

namespace orbis::places {

/// A vocabulary of 10,000 words for the descriptors of `features::orb_extractor`, trained on synthetic pictures and
/// rooms. Takes a few milliseconds: keep the result, whose copies share the tree. A vocabulary that is trained on
/// recordings of your own places, or a larger one, recognises more.
///
/// The example `train_vocabulary` makes the same bytes again: see the head of default_vocabulary_data.hpp.
[[nodiscard]] inline vocabulary default_vocabulary() {
  std::string bytes;
  bytes.reserve(detail::default_vocabulary_size + 4);
  for (const std::string_view text : detail::default_vocabulary_text)
    if (!append_base85(bytes, text)) return {};  // never: tests read it
  bytes.resize(detail::default_vocabulary_size);
  return parse_vocabulary(std::as_bytes(std::span{bytes}), "default vocabulary").value();
}

}  // namespace orbis::places

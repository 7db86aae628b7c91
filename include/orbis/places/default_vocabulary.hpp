// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A built-in vocabulary for ORB descriptors.
#pragma once

#include <cstddef>

#include <orbis/places/vocabulary.hpp>

namespace orbis::places {

/// A vocabulary of 10,000 words for the descriptors of `features::orb_extractor`, trained on synthetic images of
/// textures and rooms. The call takes a few milliseconds; keep the result, whose copies share the tree. A larger
/// vocabulary, or one trained on recordings of the target environment, has a higher recall.
///
/// The example `train_vocabulary` reproduces it byte for byte; the command is in detail/default_vocabulary_data.hpp.
template <std::size_t Bits = 256>
requires(Bits == 256) [[nodiscard]] basic_vocabulary<Bits> default_vocabulary();

}  // namespace orbis::places

#ifndef ORBIS_COMPILED
#include <orbis/places/default_vocabulary-inl.hpp>
#endif

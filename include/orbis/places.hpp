// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Visual words, and keyframes found by them.
///
/// @code
///   const auto words = orbis::places::default_vocabulary();
///   orbis::places::keyframe_database seen;
///   orbis::places::bag_of_words bag;
///   orbis::places::transform_workspace memory;
///   words.transform(features.descriptors, bag, memory);
///   for (const auto& place : seen.query(bag, {.min_score = 0.02})) try_to_match(place.id);
///   seen.add(keyframe_id, bag);
/// @endcode
#pragma once

#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/bit_string.hpp>
#include <orbis/places/dbow_text.hpp>
#include <orbis/places/dbow_yaml.hpp>
#include <orbis/places/default_vocabulary.hpp>
#include <orbis/places/inverted_index.hpp>
#include <orbis/places/keyframe_database.hpp>
#include <orbis/places/load_vocabulary.hpp>
#include <orbis/places/score.hpp>
#include <orbis/places/train.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/places/vocabulary_file.hpp>

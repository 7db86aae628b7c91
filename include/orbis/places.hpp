// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Place recognition: representation of images as bags of visual words, and retrieval of similar keyframes.
///
/// | header | contents |
/// | --- | --- |
/// | `places/vocabulary.hpp` | `vocabulary`: converts descriptors to words and images to bags of words |
/// | `places/default_vocabulary.hpp` | a built-in vocabulary for ORB |
/// | `places/train.hpp` | `train`: trains a vocabulary on images |
/// | `places/vocabulary_file.hpp` | reading and writing vocabulary files |
/// | `places/vocabulary_tree.hpp` | the underlying tree, for readers of other formats |
/// | `places/bag_of_words.hpp` | `bag_of_words`: the words in an image and their values; similarity of two bags |
/// | `places/keyframe_database.hpp` | `keyframe_database`: retrieval of keyframes that may show the same place |
/// | `places/inverted_index.hpp` | index from words to images |
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
#include <orbis/places/default_vocabulary.hpp>
#include <orbis/places/inverted_index.hpp>
#include <orbis/places/keyframe_database.hpp>
#include <orbis/places/train.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/places/vocabulary_file.hpp>
#include <orbis/places/vocabulary_tree.hpp>

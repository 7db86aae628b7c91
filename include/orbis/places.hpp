// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Place recognition: images as bags of visual words, and keyframes found by them.
///
/// | header | what it is for |
/// | --- | --- |
/// | `places/vocabulary.hpp` | `vocabulary`: descriptors to words, images to bags |
/// | `places/default_vocabulary.hpp` | a vocabulary for ORB that needs no file |
/// | `places/train.hpp` | `train`: a vocabulary of your own images |
/// | `places/vocabulary_file.hpp` | vocabularies in files |
/// | `places/vocabulary_tree.hpp` | the tree inside, for readers of other formats |
/// | `places/bag_of_words.hpp` | `bag_of_words`: the words of an image and their values; how alike two are |
/// | `places/keyframe_database.hpp` | `keyframe_database`: keyframes that may show the same place |
/// | `places/inverted_index.hpp` | the images that have a word |
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

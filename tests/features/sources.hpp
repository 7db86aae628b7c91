// SPDX-License-Identifier: BSD-3-Clause
//
// Random features, and what a source must find when it may compare only some pairs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>

namespace orbis::test {

inline std::vector<features::binary_descriptor<256>> random_descriptors(std::size_t count, std::uint64_t seed) {
  random_bits random{seed};
  std::vector<features::binary_descriptor<256>> descriptors(count);
  for (features::binary_descriptor<256>& d : descriptors)
    for (auto& word : d.words) word = random();
  return descriptors;
}

/// Few random bits: many ties.
inline features::features random_features(std::size_t count, std::uint64_t seed) {
  random_bits random{seed};
  features::features f;
  for (std::size_t i = 0; i != count; ++i) {
    features::keypoint k;
    k.x = static_cast<float>(random.uniform(0.0, 640.0));
    k.y = static_cast<float>(random.uniform(0.0, 480.0));
    k.octave = static_cast<int>(random.below(8));
    f.keypoints.push_back(k);
    features::binary_descriptor<256> d;
    d.words[1] = random() & 0xff;
    d.words[3] = random() & 0xf000;
    f.descriptors.push_back(d);
  }
  return f;
}

/// The candidates that a source finds, in memory of its own.
template <class Source, class... Where>
std::vector<features::candidate> candidates_of(const Source& source,
                                               const features::feature_view<features::binary_descriptor<256>>& queries,
                                               const features::feature_view<features::binary_descriptor<256>>& trains,
                                               features::search_needs needs, const Where&... where) {
  std::vector<features::candidate> candidates;
  features::workspace_of<Source> memory;
  source.search(candidates, memory, queries, trains, needs, where...);
  return candidates;
}

/// By trying all pairs for which `may(q, t)`.
template <class May>
std::vector<features::candidate> naive_candidates(const features::features& q, const features::features& t, May&& may) {
  using features::none;
  std::vector<features::candidate> found;
  for (std::uint32_t i = 0; i != q.size(); ++i) {
    features::candidate c{i, none, none, none, none};
    for (std::uint32_t j = 0; j != t.size(); ++j) {
      if (!may(i, j)) continue;
      const auto d = features::hamming{}(q.descriptors[i], t.descriptors[j]);
      if (d < c.distance) {
        c.second_distance = c.distance;
        c.distance = d;
        c.train = j;
      } else {
        c.second_distance = std::min(c.second_distance, d);
      }
    }
    if (c.train != none) found.push_back(c);
  }
  for (features::candidate& c : found) {
    std::uint32_t nearest = none;
    for (std::uint32_t i = 0; i != q.size(); ++i) {
      const auto d = features::hamming{}(q.descriptors[i], t.descriptors[c.train]);
      if (may(i, c.train) && d < nearest) {
        nearest = d;
        c.reverse_query = i;
      }
    }
  }
  return found;
}

}  // namespace orbis::test

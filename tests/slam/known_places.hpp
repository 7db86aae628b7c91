// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Place recognition for made-up maps: every keyframe that was added is a candidate, the oldest first.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <orbis/features/descriptor.hpp>
#include <orbis/slam/ids.hpp>

namespace orbis::test {

struct known_places {
  using signature = std::size_t;  ///< the number of features
  std::vector<slam::map_keyframe> known;

  template <class D>
  [[nodiscard]] signature describe(const features::basic_features<D>& f) const {
    return f.size();
  }
  [[nodiscard]] bool contains(slam::map_keyframe k) const {
    return std::find(known.begin(), known.end(), k) != known.end();
  }
  bool add(slam::map_keyframe k, signature) {
    if (contains(k)) return false;
    known.push_back(k);
    return true;
  }
  bool erase(slam::map_keyframe k) { return std::erase(known, k) != 0; }
  bool rename(slam::map_keyframe from, slam::map_keyframe to) {
    if (!contains(from) || contains(to)) return false;
    *std::find(known.begin(), known.end(), from) = to;
    return true;
  }
  template <class Exclude, class Neighbors>
  [[nodiscard]] std::vector<slam::map_keyframe> similar(signature, std::size_t count, Exclude&& exclude, Neighbors&&) {
    std::vector<slam::map_keyframe> found;
    for (const slam::map_keyframe& k : known)
      if (found.size() < count && !exclude(k)) found.push_back(k);
    return found;
  }
};

}  // namespace orbis::test

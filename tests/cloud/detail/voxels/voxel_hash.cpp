// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <map>
#include <vector>

#include <orbis/cloud/detail/voxels/voxel_hash.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

TEST_CASE("voxels are numbered as they come and found again") {
  orbis::cloud::detail::voxel_hash hash{0.1};
  std::map<orbis::cloud::detail::voxel_key, std::uint32_t> expected;
  orbis::random_bits random{1};
  for (int i = 0; i != 20'000; ++i) {
    const orbis::cloud::detail::voxel_key key{static_cast<std::int32_t>(random.below(30)) - 15,
                                              static_cast<std::int32_t>(random.below(30)) - 15,
                                              static_cast<std::int32_t>(random.below(30)) * 70'000'000};
    const auto number = expected.try_emplace(key, static_cast<std::uint32_t>(expected.size())).first->second;
    CHECK(hash.insert(key) == number);
  }
  CHECK(hash.size() == expected.size());
  for (const auto& [key, number] : expected) CHECK(hash.find(key) == number);
  CHECK_FALSE(hash.find({16, 0, 0}).has_value());
}

TEST_CASE("the voxel of a point is found by rounding down") {
  const orbis::cloud::detail::voxel_hash hash{0.5};
  CHECK(hash.key_of(std::vector<double>{-0.1, 0.0, 1.2}) == orbis::cloud::detail::voxel_key{-1, 0, 2});
}

// SPDX-License-Identifier: BSD-3-Clause
#include <array>

#include <orbis/cloud/detail/knn/squared_distance.hpp>

#include "cloud/reference.hpp"
#include "support/catch.hpp"

TEST_CASE("squared distances round after every operation") {
  const auto a = orbis::test::uniform_cloud(20'000, 1, 3.0);
  const auto b = orbis::test::uniform_cloud(20'000, 2, 3.0);
  std::size_t different = 0;
  for (std::size_t i = 0; i != a.size(); ++i) {
    const float d =
        orbis::cloud::detail::squared_distance<float>({a[i].x(), a[i].y(), a[i].z()}, {b[i].x(), b[i].y(), b[i].z()});
    if (d != orbis::test::squared(a[i], b[i])) ++different;
  }
  CHECK(different == 0);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <vector>

#include <orbis/cloud/detail/rays/view_trust.hpp>

#include "cloud/views.hpp"
#include "support/catch.hpp"

using orbis::cloud::detail::find_distrusted_views;

TEST_CASE("a view with a wrong pose is found, and a walker makes nobody suspect") {
  const auto honest = orbis::test::walked_past_wall(true, 99);
  CHECK(find_distrusted_views(orbis::seq, honest.views(), honest.camera).distrusted.empty());
  for (const std::size_t wrong : {1U, 5U}) {
    const auto seen = orbis::test::walked_past_wall(true, wrong);
    const auto trust = find_distrusted_views(orbis::seq, seen.views(), seen.camera);
    CHECK(trust.distrusted == std::vector<std::uint32_t>{static_cast<std::uint32_t>(wrong)});
    CHECK(trust.worst_conflict > 0.3);
    CHECK(trust.usual_conflict < 0.05);
    const auto together = find_distrusted_views(orbis::par.with(3), seen.views(), seen.camera);
    CHECK(together.distrusted == trust.distrusted);
    CHECK(together.worst_conflict == trust.worst_conflict);
  }
}

TEST_CASE("too few views, or none, cannot outvote one") {
  const auto seen = orbis::test::walked_past_wall(false, 1);
  auto views = seen.views();
  views.resize(3);
  CHECK(find_distrusted_views(orbis::seq, views, seen.camera).distrusted.empty());
  views.clear();
  CHECK(find_distrusted_views(orbis::seq, views, seen.camera).distrusted.empty());
}

TEST_CASE("stray pixels are replaced and surfaces are not") {
  orbis::image<float> depth(40, 30);
  for (int y = 0; y != 30; ++y)
    for (int x = 0; x != 40; ++x) depth(x, y) = x < 20 ? 2.0F : 1.0F + 0.04F * static_cast<float>(x);  // and a slope
  depth(10, 10) = 0.7F;
  depth(30, 15) = 3.5F;
  for (int y = 5; y != 25; ++y) depth(5, y) = 1.2F;  // a pole
  depth(12, 20) = 0.0F;
  orbis::image<float> out;
  const orbis::camera::depth_view<float> view{depth};
  orbis::cloud::detail::remove_stray_pixels(orbis::seq, view, 0.02F, 0.005F, out);
  CHECK(out(10, 10) == 2.0F);
  CHECK(out(30, 15) == Approx(2.2).margin(0.05));
  CHECK(out(12, 20) == 0.0F);
  CHECK(out(5, 15) == 1.2F);
  int changed = 0;
  for (int y = 1; y != 29; ++y)
    for (int x = 1; x != 39; ++x) changed += out(x, y) != depth(x, y) ? 1 : 0;
  CHECK(changed <= 4);  // the two, and the ends of the pole
  orbis::image<float> together;
  orbis::cloud::detail::remove_stray_pixels(orbis::par.with(3), view, 0.02F, 0.005F, together);
  CHECK(together == out);
}

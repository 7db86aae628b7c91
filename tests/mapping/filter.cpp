// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/mapping/filter.hpp>
#include <orbis/mapping/keyframe.hpp>

#include "support/catch.hpp"

using namespace orbis;
using mapping::filter_kind;

namespace {

/// A wall 2 m ahead, seen by four cameras side by side, and one point in front of it that none has seen.
struct scene {
  camera::pinhole camera{80, 60, 70.0, 70.0, 39.5, 29.5};
  image<float> depth{80, 60, 2.0F};
  std::vector<mapping::keyframe<camera::depth_view<float>>> views;
  std::vector<vec3f> points;

  scene() {
    for (int i = 0; i != 4; ++i)
      views.push_back({camera::depth_view<float>{depth.view()}, {}, se3{so3{}, vec3{0.02 * i, 0, 0}}});
    for (int y = -20; y != 20; ++y)
      for (int x = -20; x != 20; ++x)
        points.emplace_back(0.02F * static_cast<float>(x), 0.02F * static_cast<float>(y), 2.0F);
    points.emplace_back(0.05F, 0.05F, 1.2F);
  }
};

}  // namespace

TEST_CASE("every filter that is asked for by name removes the point before the wall and says so") {
  const scene s;
  const auto stray = static_cast<std::uint32_t>(s.points.size() - 1);
  for (const auto& [kind, name] : {std::pair{filter_kind::statistical, std::string{"statistical"}},
                                   {filter_kind::radius, "radius"},
                                   {filter_kind::log_statistical, "log-statistical"},
                                   {filter_kind::cluster, "cluster"},
                                   {filter_kind::ray_evidence, "ray-evidence"}}) {
    INFO(name);
    mapping::filter_options options{.kind = kind};
    options.statistical = {.neighbors = 8, .sigma_multiplier = 10.0};
    const auto filtered = mapping::filter_points(par, s.points, {}, s.views, s.camera, options);
    CHECK(filtered.inliers.size() == s.points.size() - 1);
    CHECK((filtered.inliers.empty() || filtered.inliers.back() != stray));
    CHECK(filtered.report.removed == 1);
    CHECK(filtered.report.points == s.points.size());
    CHECK(to_string(filtered.report.mode) == name);
    CHECK(filtered.report.kind == kind);
    const bool by_distance = kind == filter_kind::statistical || kind == filter_kind::log_statistical;
    CHECK(filtered.report.max_mean_distance.has_value() == by_distance);
    if (by_distance) {
      CHECK(*filtered.report.max_mean_distance > 0.02);  // the spacing of the wall
      CHECK(*filtered.report.max_mean_distance < 0.8);   // the distance of the point from it
    }
    REQUIRE(filtered.report.clusters.has_value() == (kind == filter_kind::cluster));
    if (filtered.report.clusters) {
      CHECK(filtered.report.clusters->components == 2);
      CHECK(filtered.report.clusters->removed == 1);
      CHECK(filtered.report.clusters->min_size == 30);
    }
    CHECK_FALSE(filtered.report.choice.has_value());
    CHECK(mapping::filter_points(seq, s.points, {}, s.views, s.camera, options).inliers == filtered.inliers);
  }
}

TEST_CASE("rays cannot judge where there are no views, and none removes nothing") {
  const scene s;
  for (const auto kind : {filter_kind::none, filter_kind::ray_evidence}) {
    const auto filtered = mapping::filter_points(seq, s.points, {}, {.kind = kind});
    CHECK(filtered.inliers.size() == s.points.size());
    CHECK(filtered.report.removed == 0);
    CHECK(filtered.report.mode.empty());
    CHECK(filtered.report.kind == kind);
  }
}

TEST_CASE("the report of the automatic filter has the choice with its evidence") {
  const scene s;
  const auto filtered = mapping::filter_points(par, s.points, {}, s.views, s.camera);
  CHECK(filtered.report.kind == filter_kind::automatic);
  CHECK(filtered.report.removed == 1);
  REQUIRE(filtered.report.choice.has_value());
  CHECK(to_string(filtered.report.choice->chain) == to_string(filtered.report.mode));
  CHECK(filtered.report.choice->status == cloud::choice_status::complete);
  CHECK(filtered.report.choice->evidence.views == s.views.size());
}

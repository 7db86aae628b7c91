// SPDX-License-Identifier: BSD-3-Clause
#include "common/filter_text.hpp"

#include <cmath>
#include <string>

#include "common/count_text.hpp"
#include "support/catch.hpp"

using namespace orbis::cloud;
using examples::filter_text;
using orbis::mapping::filter_kind;

TEST_CASE("counts have separators") {
  CHECK(examples::count_text(0) == "0");
  CHECK(examples::count_text(999) == "999");
  CHECK(examples::count_text(1234) == "1,234");
  CHECK(examples::count_text(791647) == "791,647");
  CHECK(examples::number_text(0.01234) == "0.0123");
  CHECK(examples::number_text(999.6) == "1,000");
  CHECK(examples::number_text(12345.6) == "12,346");
  CHECK(examples::percent_text(0.1234) == "12.3 %");
}

TEST_CASE("an automatic choice is explained step by step") {
  filter_choice choice;
  choice.evidence = {.points = 20'000, .finite = 20'000, .judged = 20'000, .median_spacing = 0.0125};
  CHECK(filter_text(choice) == "no outliers found (median spacing 12.5 mm)");

  choice.evidence.range_exponent = 1.1;
  choice.evidence.density = {
      {.mode = filter_mode::range_log_statistical,
       .source = threshold_source::valley,
       .valley_ratio = 12'345.6,
       .threshold = std::log(3.0),
       .removed = 0.02},
      {.mode = filter_mode::log_statistical, .source = threshold_source::none},
      {.mode = filter_mode::local_log_statistical,
       .source = threshold_source::shoulder,
       .shoulder = 0.03,
       .threshold = std::log(2.0),
       .removed = 0.01},
  };
  choice.evidence.isolated = 0.005;
  choice.evidence.clustered = 0.25;
  choice.chain = {density_step{.mode = filter_mode::range_log_statistical},
                  density_step{.mode = filter_mode::local_log_statistical}, isolation_step{},
                  cluster_options{.min_size = 12'000, .min_gap = 4.0}};
  CHECK(filter_text(choice) ==
        "2 % of the points are more than 3 times sparser than usual for their range and not on a surface (a separate "
        "population: its peak is 12,346 times higher than the valley before it); "
        "1 % of the points are more than 2 times sparser than usual for their surroundings and not on a surface (3 % "
        "form a shoulder of the distribution, as flying pixels do); "
        "0.5 % are groups of fewer than 30 points more than 2.5 usual spacings from all others; "
        "25 % are clusters of fewer than 12,000 points at least 4 spacings from the surface "
        "(median spacing 12.5 mm, which grows with range)");
}

TEST_CASE("a choice by depth images names the images that count") {
  filter_choice choice;
  choice.evidence = {.median_spacing = 0.01, .views = 8, .worst_conflict = 0.34, .passed_through = 0.012};
  choice.chain = {ray_step{}};
  CHECK(filter_text(choice) == "the rays of 8 depth images pass through 1.2 % of the points (median spacing 10 mm)");

  choice.chain = {ray_step{.distrusted = {5}, .need_support = true}};
  choice.evidence.unsupported = 0.003;
  choice.status = choice_status::too_few_points;
  CHECK(
      filter_text(choice) ==
      "1 of 8 depth images contradicts the others (by up to 34 %) and is ignored; the rays of the other 7 depth images "
      "pass through 1.2 % of the points, and at another 0.3 % no depth image shows a surface (stray pixels and ignored "
      "images do not count)");

  choice.chain = {ray_step{.need_support = true}};
  choice.evidence.passed_through = 0;
  CHECK(filter_text(choice) == "at 0.3 % of the points no depth image shows a surface (stray pixels do not count)");
}

TEST_CASE("a choice without an analysis states why") {
  filter_choice choice{.evidence = {.judged = 49}, .status = choice_status::too_few_points};
  CHECK(filter_text(choice) == "too few points (49) to evaluate");
  choice.status = choice_status::cancelled;
  CHECK(filter_text(choice) == "cancelled");
}

TEST_CASE("the filter of a map is explained by what was requested") {
  orbis::mapping::filter_report report{.kind = filter_kind::none};
  CHECK(filter_text(report) == "requested");
  report = {
      .kind = filter_kind::statistical, .mode = {statistical_options{.neighbors = 50}}, .max_mean_distance = 0.0123};
  CHECK(filter_text(report) == "requested; mean distance to 50 neighbours at most 12.3 mm");
  report = {.kind = filter_kind::log_statistical, .mode = {density_step{.neighbors = 8}}, .max_mean_distance = 1.5};
  CHECK(filter_text(report) == "requested; mean distance to 8 neighbours at most 1,500 mm");
  report = {.kind = filter_kind::radius, .mode = {radius_options{.radius = 0.05, .min_neighbors = 3}}};
  CHECK(filter_text(report) == "requested; at least 3 neighbours within 50 mm");
  report = {.kind = filter_kind::cluster,
            .mode = {cluster_options{}},
            .clusters = {{.components = 12'345, .removed = 12'000, .min_size = 200}}};
  CHECK(filter_text(report) ==
        "requested; 12,000 of 12,345 components have fewer than 200 points and are far from the others");
  report = {.kind = filter_kind::ray_evidence, .mode = {ray_step{}}};
  CHECK(filter_text(report) == "requested; removes points that rays of other keyframes pass through");
  report.mode.clear();
  CHECK(filter_text(report) == "ray evidence was requested, but there are no depth images: every point is kept");
  report = {.kind = filter_kind::automatic, .choice = filter_choice{.evidence = {.median_spacing = 0.01}}};
  CHECK(filter_text(report) == "no outliers found (median spacing 10 mm)");
}

TEST_CASE("moved objects precede the reason") {
  CHECK(examples::moved_objects_text(0, 0).empty());
  CHECK(examples::moved_objects_text(791'647, 30) ==
        "791,647 pixels of 30 keyframes show moved objects (rays of other keyframes pass through them) and were "
        "removed; ");
  CHECK(examples::moved_objects_text(1, 1).starts_with("1 pixel of 1 keyframe shows "));
}

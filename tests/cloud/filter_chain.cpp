// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/cloud/filter_chain.hpp>

#include "support/catch.hpp"

using orbis::cloud::filter_chain;
using orbis::cloud::filter_mode;

TEST_CASE("chains have names") {
  CHECK(to_string(filter_chain{}) == "none");
  orbis::cloud::density_step density;
  density.mode = filter_mode::range_log_statistical;
  CHECK(to_string(filter_chain{density, orbis::cloud::cluster_options{}}) == "range-log-statistical+cluster");
  CHECK(step_mode(orbis::cloud::ray_step{}) == filter_mode::ray_evidence);
  CHECK(step_mode(orbis::cloud::isolation_step{}) == filter_mode::isolation);
  CHECK(step_mode(orbis::cloud::statistical_options{}) == filter_mode::statistical);
  CHECK(step_mode(orbis::cloud::radius_options{}) == filter_mode::radius);
}

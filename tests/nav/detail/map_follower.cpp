// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <stdexcept>
#include <string>

#include <orbis/nav/detail/map_follower.hpp>
#include <orbis/octree/change_log.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// What is called for the log's present revision.
std::string call(nav::detail::map_follower& follower, const octree::change_log& log, bool throws = false) {
  std::string called;
  const auto note = [&](const std::string& what) {
    called += what;
    if (throws) throw std::runtime_error{what};
  };
  follower.follow(
      log, log.revision(),
      [&](const octree::change_log&, std::uint64_t since) { note("some since " + std::to_string(since)); },
      [&] { note("all"); });
  return called;
}

}  // namespace

TEST_CASE("who follows a map looks at what changed since, or at everything where the log does not know") {
  octree::change_log log;
  nav::detail::map_follower follower;
  CHECK(call(follower, log) == "all");
  CHECK(call(follower, log) == "all");  // changes are not recorded
  log.begin_revision();
  CHECK(call(follower, log) == "some since 0");
  CHECK(call(follower, log).empty());
  log.begin_revision();
  log.begin_revision();
  CHECK(call(follower, log) == "some since 1");
  log.begin_revision();
  log.clear();
  CHECK(call(follower, log) == "all");
  CHECK(call(follower, log).empty());
}

TEST_CASE("who was interrupted by an exception looks at everything") {
  octree::change_log log;
  nav::detail::map_follower follower;
  log.begin_revision();
  CHECK(call(follower, log) == "all");
  log.begin_revision();
  CHECK_THROWS_AS(call(follower, log, true), std::runtime_error);
  CHECK(call(follower, log) == "all");
  CHECK(call(follower, log).empty());
}

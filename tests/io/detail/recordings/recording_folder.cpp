// SPDX-License-Identifier: BSD-3-Clause
#include <string>
#include <vector>

#include <orbis/io/detail/recordings/recording_folder.hpp>

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;

TEST_CASE("a folder is listed in the order of names and a missing one is empty") {
  const orbis::test::temporary_folder folder;
  for (const char* name : {"b", "a", "c/d"}) folder.write(name, "x");
  const auto paths = io::detail::list_folder(folder.path());
  REQUIRE(paths.size() == 3);
  CHECK(paths[0].filename() == "a");
  CHECK(paths[2].filename() == "c");
  CHECK(io::detail::list_folder(folder / "none").empty());
  CHECK(io::detail::present(folder / "c/d"));
  CHECK_FALSE(io::detail::present(folder / "a/b"));
}

TEST_CASE("frames without ground truth stay without and are counted") {
  io::detail::recording_index index;
  for (const double t : {0.0, 0.05, 10.0}) index.frames.push_back({t, "c", "d", {}});
  io::detail::attach_ground_truth(index, 0.02);
  CHECK(index.notes.empty());
  index.ground_truth = {{0.0, {}}, {0.1, {}}};
  io::detail::attach_ground_truth(index, 0.02);
  CHECK(index.frames[1].T_world_camera.has_value());
  CHECK_FALSE(index.frames[2].T_world_camera.has_value());
  CHECK(index.notes == std::vector<std::string>{"1 of 3 frames are outside the ground truth"});
}

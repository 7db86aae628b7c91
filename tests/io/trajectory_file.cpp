// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <string>

#include <orbis/io/trajectory_file.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;
using orbis::se3;
using orbis::so3;
using orbis::vec3;

TEST_CASE("a trajectory survives writing and reading to the promised digits") {
  const orbis::test::temporary_folder folder;
  orbis::trajectory poses;
  for (int i = 0; i != 50; ++i)
    poses.push_back({1305031102.175304 + i / 30.0,
                     se3(so3::exp(vec3(0.1 * i, -0.07 * i, 0.05)), vec3(1e-3 * i, 1e4 / (i + 1), -i / 7.0))});
  REQUIRE(io::write_trajectory(folder / "t.txt", poses));
  const auto read = io::read_trajectory(folder / "t.txt").value();
  REQUIRE(read.size() == poses.size());
  for (std::size_t i = 0; i != poses.size(); ++i) {
    CHECK(std::abs(read[i].timestamp - poses[i].timestamp) < 1e-9 + 2.5e-7);  // a double's step at 1.3e9
    const vec3 t = poses[i].T_world_camera.translation();
    CHECK((read[i].T_world_camera.translation() - t).norm() <= 1e-8 * t.norm());
    CHECK((read[i].T_world_camera.rotation().inverse() * poses[i].T_world_camera.rotation()).angle() < 1e-8);
  }
}

TEST_CASE("comments and CRLF and blank lines and order do not matter to a trajectory") {
  const auto read = io::parse_trajectory(
                        "# timestamp tx ty tz qx qy qz qw\r\n\r\n2.0 0 0 2 0 0 0 1\r\n  1.0\t0 0 1 0 0 0 "
                        "2\r\n#end\r\n3 0 0 3 0 0 0 -1")
                        .value();
  REQUIRE(read.size() == 3);
  for (std::size_t i = 0; i != 3; ++i) {
    CHECK(read[i].timestamp == static_cast<double>(i + 1));
    CHECK(read[i].T_world_camera.translation().z() == static_cast<double>(i + 1));
    CHECK(read[i].T_world_camera.rotation().angle() < 1e-12);
  }
  CHECK(io::parse_trajectory("").value().empty());
  CHECK(io::parse_trajectory("# nothing\n").value().empty());
}

TEST_CASE("quaternions are read in the order x y z w") {
  const auto pose = io::parse_trajectory("0 0 0 0 0.70710678118 0 0 0.70710678118").value()[0].T_world_camera;
  CHECK((pose * vec3(0, 1, 0) - vec3(0, 0, 1)).norm() < 1e-9);
}

TEST_CASE("a bad pose is named with its line") {
  const std::string good = "# head\n1.0 0 0 0 0 0 0 1\n";
  const auto message = [&](const char* line) {
    const auto read = io::parse_trajectory(good + line + "\n" + "2.0 0 0 0 0 0 0 1\n", "gt.txt");
    return read ? std::string{} : read.error().to_string();
  };
  CHECK(message("1.5 nan 0 0 0 0 0 1") == "gt.txt:3: a pose with NaN or infinity");
  CHECK(message("1.5 0 0 inf 0 0 0 1") == "gt.txt:3: a pose with NaN or infinity");
  CHECK(message("1.5 0 0 0 0 0 0 0") == "gt.txt:3: the quaternion is zero or too large");
  CHECK(message("1.5 0 0 0 0 0 1").find("gt.txt:3: a pose must have 8 numbers") == 0);
  CHECK(message("1.5 0 0 0 0 0 0 1 9").find("gt.txt:3: a pose must have 8 numbers") == 0);
  CHECK(message("1.5 0 0 zero 0 0 0 1") == "gt.txt:3: \"zero\" is not a number");
  CHECK(message("1.5 0 0 0 0 0 0 1").empty());
}

TEST_CASE("a missing trajectory is not found and an unwritable one is not left in part") {
  const orbis::test::temporary_folder folder;
  CHECK(io::read_trajectory(folder / "none.txt").error().code == orbis::errc::not_found);
  CHECK(io::write_trajectory(folder / "no" / "t.txt", {}).error().code == orbis::errc::write_failed);
}

TEST_CASE("real trajectories are read") {
  ORBIS_NEEDS_DATA("trajectories");
  const auto folder = orbis::test::data_dir() / "trajectories";
  CHECK(io::read_trajectory(folder / "freiburg1_xyz-groundtruth.txt").value().size() == 3000);
  const auto estimate = io::read_trajectory(folder / "freiburg1_xyz-rgbdslam.txt").value();
  REQUIRE(estimate.size() == 788);
  CHECK(estimate[0].timestamp == 1305031102.160407);
  CHECK(estimate[0].T_world_camera.translation() == vec3(1.344379, 0.627206, 1.661754));
}

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include <orbis/io/detail/files/pose_matrix.hpp>
#include <orbis/io/detail/recordings/asl.hpp>
#include <orbis/io/detail/recordings/kitti.hpp>
#include <orbis/io/detail/recordings/seven_scenes.hpp>
#include <orbis/io/detail/recordings/tum.hpp>

#include "io/recordings.hpp"
#include "support/catch.hpp"

namespace io = orbis::io;
using orbis::test::message_of;
using orbis::test::temporary_folder;

namespace {

/// Marks of a lost pose that other programs write; 0 in all places.
const std::vector<std::string> marks{"0", "nan", "NaN", "-nan", "inf", "-inf", "-INF", "-nan(ind)"};

bool has_note(const std::vector<std::string>& notes, const std::string& part) {
  return std::ranges::any_of(notes, [&](const std::string& note) { return note.find(part) != note.npos; });
}

std::string repeated(const std::string& word, int n) {
  std::string line;
  for (int i = 0; i != n; ++i) line += (i == 0 ? "" : " ") + word;
  return line;
}

/// Three frames a second apart, at 1, 2 and 3 seconds.
void write_tum(const temporary_folder& folder, const std::string& truth) {
  for (const char* kind : {"rgb", "depth"}) {
    std::string list;
    for (const char* name : {"1", "2", "3"}) {
      folder.write(std::string{kind} + "/" + name + ".png",
                   kind == std::string{"rgb"} ? orbis::test::tiny_color(1) : orbis::test::tiny_depth(1));
      list += std::string{name} + ".5 " + kind + "/" + name + ".png\n";
    }
    folder.write(std::string{kind} + ".txt", list);
  }
  folder.write("groundtruth.txt", truth);
}

}  // namespace

TEST_CASE("lost poses of a recording are left out and counted") {
  for (const std::string& mark : marks) {
    INFO(mark);
    const temporary_folder folder;
    write_tum(folder, "1.5 1 0 0 0 0 0 1\n2.5 " + repeated(mark, 7) + "\n3.5 3 0 0 0 0 0 1\n");
    const auto tum = io::detail::index_tum(folder.path()).value();
    CHECK(tum.ground_truth.size() == 2);
    CHECK_FALSE(tum.frames[1].T_world_camera.has_value());
    CHECK(tum.frames[2].T_world_camera.value().translation().x() == 3.0);
    CHECK(has_note(tum.notes, "groundtruth.txt: 1 poses with NaN, infinity or a zero quaternion are left out"));

    const std::string good = "1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n";
    for (const char* stem : {"frame-000000", "frame-000001"}) {
      folder.write(std::string{stem} + ".color.png", orbis::test::tiny_color(1));
      folder.write(std::string{stem} + ".depth.png", orbis::test::tiny_depth(1));
    }
    folder.write("frame-000000.pose.txt", good);
    const std::string row = repeated(mark, 4) + "\n";
    folder.write("frame-000001.pose.txt", row + row + row + row);
    const auto scenes = io::detail::index_seven_scenes(folder.path()).value();
    REQUIRE(scenes.frames.size() == 2);
    CHECK(scenes.frames[0].T_world_camera.has_value());
    CHECK_FALSE(scenes.frames[1].T_world_camera.has_value());
    CHECK(scenes.ground_truth.size() == 1);
    CHECK(has_note(scenes.notes, "1 of 2 frames have no pose: tracking was lost"));

    io::detail::recording_index kitti;
    folder.write("poses.txt", "1 0 0 1 0 1 0 2 0 0 1 3\n" + repeated(mark, 12) + "\n1 0 0 4 0 1 0 5 0 0 1 6\n");
    const auto poses =
        io::detail::read_kitti_poses(folder.path(), orbis::se3{{}, orbis::vec3(0.5, 0, 0)}, 3, kitti).value();
    REQUIRE(poses.size() == 3);
    CHECK_FALSE(poses[1].has_value());
    CHECK(poses[2].value().translation() == orbis::vec3(4.5, 5, 6));
    CHECK(has_note(kitti.notes, "1 of 3 frames have no pose"));
    const std::vector<double> times{0.0, 0.1, 0.2};
    for (const std::size_t i : {0U, 1U, 2U}) io::detail::add_kitti_frame(i, times, poses, {}, {}, kitti);
    CHECK(kitti.frames.size() == 3);
    CHECK(kitti.ground_truth.size() == 2);

    const auto asl = io::detail::parse_asl_poses(
        "1000000,1,2,3,1,0,0,0\n2000000,1,2,3," + mark + "," + mark + "," + mark + "," + mark + "\n", "a.csv");
    REQUIRE(asl.value().poses.size() == 1);
    CHECK(asl->poses[0].timestamp == Approx(1e-3));
    CHECK(has_note(asl->notes, "a.csv: 1 poses with NaN, infinity or a zero quaternion"));
  }
}

TEST_CASE("poses whose rotation is zero are lost ones") {
  for (const char* lost : {"0 0 0 0 0 0 0 0 0 0 0 0", "0 0 0 1 0 0 0 2 0 0 0 3", "0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 1\n",
                           "0.0 0 -0 0\n0 0 0 0\n0 0 0 0\n0 0 0 0\n", "1 0 0 nan"})
    CHECK(io::detail::is_lost_pose(lost));
  for (const char* other :
       {"", "0 0 0 0", "1 0 0 0 0 1 0 0 0 0 1 0", "0 0 0 0 0 0 0 0 0 0 x 0", "0 0 0 0\n0 0 1e-3 0\n0 0 0 0\n0 0 0 1\n"})
    CHECK_FALSE(io::detail::is_lost_pose(other));
}

TEST_CASE("a ground truth with unusable times is left out, in any layout of the file") {
  const temporary_folder folder;
  std::string lines;
  for (int i = 0; i != 20; ++i) lines += std::to_string(1 + i / 10) + " " + std::to_string(i) + " 0 0 0 0 0 1\n";
  write_tum(folder, lines);
  const auto index = io::detail::index_tum(folder.path()).value();
  CHECK(index.frames.size() == 3);
  CHECK(index.ground_truth.empty());
  CHECK(has_note(index.notes,
                 "18 of 20 poses have the time stamp of another pose: the time stamps are in whole seconds"));
  CHECK(has_note(index.notes, "the ground truth is not used"));

  write_tum(folder, "#time,tx,ty,tz,qw,qx,qy,qz\n1.5,1,2,3,1,0,0,0\n2.5,4,5,6,0,1,0,0\n2.5,4,5,6,0,1,0,0\n");
  const auto euroc = io::detail::index_tum(folder.path()).value();
  REQUIRE(euroc.ground_truth.size() == 2);
  CHECK(euroc.ground_truth[1].T_world_camera.rotation().unit_quaternion().x() == 1.0);
  CHECK(has_note(euroc.notes, "groundtruth.txt: 1 repeated lines are left out"));

  write_tum(folder, "1 0 0 1 0 1 0 2 0 0 1 3\n");
  CHECK(message_of(io::detail::index_tum(folder.path())).find("the poses have no times") != std::string::npos);
}

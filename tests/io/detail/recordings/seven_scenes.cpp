// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <string>

#include <orbis/io/detail/recordings/seven_scenes.hpp>

#include "io/recordings.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

namespace io = orbis::io;
using orbis::mat3;
using orbis::test::message_of;
using orbis::test::temporary_folder;

namespace {

void write_frame(const temporary_folder& folder, const std::string& stem, const char* color = ".color.png",
                 const char* pose = "1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n") {
  folder.write(stem + color, orbis::test::tiny_color(1));
  folder.write(stem + ".depth.png", orbis::test::tiny_depth(1));
  folder.write(stem + ".pose.txt", pose);
}

}  // namespace

TEST_CASE("frames are found by their names in the order of their numbers") {
  const temporary_folder folder;
  write_frame(folder, "frame-000010");
  write_frame(folder, "frame-000002", ".color.jpg");
  folder.write("frame-000003.color.png", orbis::test::tiny_color(1));
  folder.write("Thumbs.db", "x");
  const auto index = io::detail::index_seven_scenes(folder.path()).value();
  REQUIRE(index.frames.size() == 2);
  CHECK(index.frames[0].timestamp == Approx(2.0 / 30.0));
  CHECK(index.frames[0].color.filename() == "frame-000002.color.jpg");
  CHECK(index.frames[1].depth.filename() == "frame-000010.depth.png");
  CHECK(index.frames[1].T_world_camera.value().translation() == orbis::vec3(1, 2, 3));
  CHECK(index.ground_truth.size() == 2);
  CHECK_FALSE(index.camera.has_value());
  REQUIRE(index.notes.size() == 2);
  CHECK(index.notes[0].find("1 colour images have no depth") == 0);
  CHECK(index.notes[1].find("not registered") != std::string::npos);
}

TEST_CASE("the camera is made of the matrix and the size of the images") {
  const temporary_folder folder;
  write_frame(folder, "frame-000000");
  folder.write("camera-intrinsics.txt", "5.85e2 0 3.2e2\n0 586 240\n0 0 1\n");
  const auto camera = io::detail::index_seven_scenes(folder.path()).value().camera.value();
  CHECK(camera.model.k() == orbis::camera::intrinsics{8, 6, 585.0, 586.0, 320.0, 240.0});
  CHECK(camera.depth_scale == 1000.0);
  for (const char* bad : {"585 0 320 0 585 240 0 0", "585 0 320 0 nan 240 0 0 1", "-1 0 320 0 585 240 0 0 1", "a"}) {
    folder.write("camera-intrinsics.txt", bad);
    CHECK(io::detail::index_seven_scenes(folder.path()).error().code == orbis::errc::malformed);
  }
}

TEST_CASE("a scene with one sequence stands for it and one with several is refused") {
  const temporary_folder folder;
  write_frame(folder, "seq-03/frame-000000");
  CHECK(io::detail::is_seven_scenes(folder.path()));
  CHECK(io::detail::index_seven_scenes(folder.path()).value().frames.size() == 1);
  write_frame(folder, "seq-04/frame-000000");
  CHECK(message_of(io::detail::index_seven_scenes(folder.path()))
            .find("holds 2 sequences: specify one of them, for example seq-03") != std::string::npos);
}

TEST_CASE("bad pose matrices are named with their file") {
  const temporary_folder folder;
  const auto message = [&](const char* text) {
    return message_of(io::detail::read_pose_matrix(folder.write("p.txt", text)));
  };
  const std::string file = (folder / "p.txt").string();
  CHECK(message("1 0 0 0\n0 1 0 nan\n0 0 1 0\n0 0 0 1\n") == file + ":2: a pose with NaN or infinity");
  CHECK(message("1 0 0 0\n0 1 0 0\n0 0 x 0\n0 0 0 1\n") == file + ":3: \"x\" is not a number");
  CHECK(message("1 0 0 0\n0 1 0 0\n0 0 1 0\n") == file + ": a pose must be a 4x4 matrix of 16 numbers");
  CHECK(message("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n5\n") == file + ":5: more than 16 numbers in a pose");
  CHECK(message("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n") == file + ": the matrix is not a rigid transform");
  CHECK(message("2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n") == file + ": the matrix is not a rigid transform");
  CHECK(message("0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 0\n") == file + ": the matrix is not a rigid transform");
  CHECK(message("1.001 0 0 0\n0 0.999 0.001 0\n0 0 1 0\n0 0 0 1\n").empty());
}

TEST_CASE("a folder without frames has no data") {
  const temporary_folder folder;
  CHECK_FALSE(io::detail::is_seven_scenes(folder.path()));
  CHECK(io::detail::index_seven_scenes(folder.path()).error().code == orbis::errc::no_data);
}

TEST_CASE("real 7-Scenes poses become rotations") {
  ORBIS_NEEDS_DATA("sevenscenes_raw");
  const auto index = io::detail::index_seven_scenes(orbis::test::data_dir() / "sevenscenes_raw").value();
  REQUIRE(index.frames.size() == 10);
  const auto& pose = index.frames[0].T_world_camera.value();
  mat3 stored;
  stored << 0.90931290, 0.27262223, -0.31422433, -0.27248618, 0.96104980, 0.045279626, 0.31433925, 0.044449646,
      0.94820935;
  CHECK((pose.rotation_matrix() - stored).cwiseAbs().maxCoeff() < 1e-3);
  CHECK(std::abs(pose.rotation_matrix().determinant() - 1.0) < 1e-12);
  CHECK(pose.translation().x() == -3.404563400000000239e-01);
  CHECK(index.camera.value().model.k().fx == 585.0);
  CHECK(index.camera.value().model.width() == 640);
}

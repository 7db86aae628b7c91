// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include <orbis/io/detail/recordings/icl_nuim.hpp>
#include <orbis/io/recording.hpp>

#include "io/recordings.hpp"
#include "support/catch.hpp"

namespace io = orbis::io;
using orbis::se3;
using orbis::so3;
using orbis::vec3;
using orbis::test::temporary_folder;

namespace {

void write_images(const temporary_folder& folder, int first, int last) {
  for (int i = first; i <= last; ++i) {
    folder.write("rgb/" + std::to_string(i) + ".png", orbis::test::tiny_color(static_cast<std::uint8_t>(i)));
    folder.write("depth/" + std::to_string(i) + ".png", orbis::test::tiny_depth(static_cast<std::uint16_t>(i)));
  }
}

}  // namespace

TEST_CASE("numbered images are frames in the order of numbers at 30 Hz") {
  const temporary_folder folder;
  write_images(folder, 8, 11);
  folder.write("rgb/12.png", "no depth");
  folder.write("livingRoom0.gt.freiburg", "9 0 1 -2.25 0 0 0 1\n10 0 2 -2.25 0 0 0 1\n");
  CHECK(io::detail::is_icl_nuim(folder.path()));
  const auto index = io::detail::index_icl_nuim(folder.path()).value();
  REQUIRE(index.frames.size() == 4);
  CHECK(index.frames[0].timestamp == 8 / 30.0);
  CHECK(index.frames[3].color.filename() == "11.png");
  CHECK_FALSE(index.frames[0].T_world_camera.has_value());
  CHECK(index.frames[1].T_world_camera.value().translation() == vec3(0, -1, -2.25));
  CHECK(index.frames[2].T_world_camera.value().translation() == vec3(0, -2, -2.25));
  CHECK(index.camera.value().depth_scale == 5000.0);
  CHECK(index.camera.value().model.k().fx == 481.2);
}

TEST_CASE("an association list in the order of ICL-NUIM is understood") {
  const temporary_folder folder;
  write_images(folder, 0, 3);
  folder.write("associations.txt", "0 depth/0.png 0 rgb/0.png\n1 depth/1.png 1 rgb/1.png\n3 depth/3.png 3 rgb/3.png\n");
  const auto index = io::detail::index_icl_nuim(folder.path()).value();
  REQUIRE(index.frames.size() == 3);
  CHECK(index.frames[2].timestamp == 0.1);
  CHECK(index.frames[2].color.parent_path().filename() == "rgb");
  CHECK(index.frames[2].depth.parent_path().filename() == "depth");
}

TEST_CASE("only its trajectory file identifies an ICL-NUIM recording") {
  const temporary_folder folder;
  write_images(folder, 0, 2);
  CHECK_FALSE(io::detail::is_icl_nuim(folder.path()));
  CHECK_FALSE(io::open_recording(folder.path()));  // no camera is known
  folder.write("associations.txt", "0 rgb/0.png 0 depth/0.png\n1 rgb/1.png 1 depth/1.png\n");
  CHECK_FALSE(io::detail::is_icl_nuim(folder.path()));
  CHECK_FALSE(io::open_recording(folder.path()));
  folder.write("livingRoom0.gt.freiburg", "0 0 1 0 0 0 0 1\n");
  CHECK(io::detail::is_icl_nuim(folder.path()));
  const auto recording = io::open_recording(folder.path()).value();
  CHECK(recording.format() == io::recording_format::icl_nuim);
  CHECK_THAT(recording.notes().back(),
             Catch::Matchers::Contains("the camera is icl") && Catch::Matchers::Contains("depth_scale 5000"));
}

TEST_CASE("mirroring turns left-handed poses into the ones our points need") {
  // A point seen in the left-handed camera (y up), mapped to the left-handed world, then mirrored, is
  // the mirrored point mapped by the mirrored pose.
  const auto mirrored = [](const vec3& p) { return vec3(p.x(), -p.y(), p.z()); };
  for (int i = 0; i != 20; ++i) {
    const se3 pose(so3::exp(vec3(0.3 * i, 1.0 - 0.2 * i, -0.1 * i)), vec3(i, 2 - i, 0.5 * i));
    const vec3 p(0.3, -0.2 * i, 2.0);
    CHECK((io::detail::mirrored_y(pose) * mirrored(p) - mirrored(pose * p)).norm() < 1e-12);
  }
}

TEST_CASE("what is missing in an ICL-NUIM recording is named") {
  const temporary_folder folder;
  CHECK_FALSE(io::detail::is_icl_nuim(folder.path()));
  CHECK(io::detail::index_icl_nuim(folder.path()).error().code == orbis::errc::not_found);
  folder.write("rgb/readme.txt", "x");
  CHECK(io::detail::index_icl_nuim(folder.path()).error().code == orbis::errc::not_found);
  write_images(folder, 1, 1);
  folder.write("a.gt.freiburg", "1 0 nan 0 0 0 0 1\n2 0 0 0 0 0 0 1\n");
  CHECK(io::detail::index_icl_nuim(folder.path()).value().ground_truth.size() == 1);  // a lost pose
  folder.write("a.gt.freiburg", "1 0 x 0 0 0 0 1\n");
  CHECK(orbis::test::message_of(io::detail::index_icl_nuim(folder.path())) ==
        (folder / "a.gt.freiburg").string() + ":1: \"x\" is not a number");
}

// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <string>
#include <vector>

#include <orbis/io/detail/recordings/tum.hpp>

#include "io/recordings.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

namespace io = orbis::io;
using Catch::Matchers::Contains;
using Catch::Matchers::EndsWith;
using Catch::Matchers::StartsWith;
using orbis::test::message_of;
using orbis::test::temporary_folder;

namespace {

/// Colour at 1.00, 1.03, 1.06, 1.09 and depth at 1.01, 1.04, 1.07, 1.30 seconds.
void write_images(const temporary_folder& folder) {
  for (const char* stamp : {"1.00", "1.03", "1.06", "1.09"})
    folder.write(std::string{"rgb/"} + stamp + ".png", orbis::test::tiny_color(1));
  for (const char* stamp : {"1.01", "1.04", "1.07", "1.30"})
    folder.write(std::string{"depth/"} + stamp + ".png", orbis::test::tiny_depth(1));
}

bool mentions(const io::detail::recording_index& index, const std::string& words) {
  for (const std::string& note : index.notes)
    if (note.find(words) != std::string::npos) return true;
  return false;
}

}  // namespace

TEST_CASE("images are paired by time whatever the lists look like") {
  const temporary_folder folder;
  write_images(folder);
  folder.write("rgb.txt",
               "# color images\r\n# timestamp filename\r\n1.06 rgb/1.06.png\r\n\r\n1.00 "
               "rgb/1.00.png\r\n1.03\trgb/1.03.png \r\n1.09 rgb/1.09.png");
  folder.write("depth.txt",
               "1.30 depth/1.30.png\nrubbish\n1.01 depth/1.01.png\n  1.04   depth/1.04.png\n1.07 depth/1.07.png\n");
  const auto index = io::detail::index_tum(folder.path()).value();
  REQUIRE(index.frames.size() == 3);
  for (const std::size_t i : {0U, 1U, 2U}) {
    CHECK(index.frames[i].timestamp == Approx(1.0 + 0.03 * static_cast<double>(i)));
    const auto expected = std::vector<const char*>{"1.01.png", "1.04.png", "1.07.png"}[i];
    CHECK(index.frames[i].depth.filename() == expected);
    CHECK_FALSE(index.frames[i].T_world_camera.has_value());
  }
  CHECK(mentions(index, "rgb.txt: not in chronological order"));
  CHECK(mentions(index, "depth.txt:2: skipped"));
  CHECK(mentions(index, "1 of 4 colour images have no counterpart"));
  CHECK(mentions(index, "1 of 4 depth images have no counterpart"));
}

TEST_CASE("the time allowed between colour and depth can be chosen") {
  const temporary_folder folder;
  write_images(folder);
  folder.write("rgb.txt", "1.00 rgb/1.00.png\n1.09 rgb/1.09.png\n");
  folder.write("depth.txt", "1.01 depth/1.01.png\n1.30 depth/1.30.png\n");
  CHECK(io::detail::index_tum(folder.path()).value().frames.size() == 1);
  CHECK(io::detail::index_tum(folder.path(), 0.5).value().frames.size() == 2);
  CHECK(io::detail::index_tum(folder.path(), 0.005).error().code == orbis::errc::no_data);
}

TEST_CASE("repeated time stamps are used once") {
  const temporary_folder folder;
  write_images(folder);
  folder.write("rgb.txt", "1.00 rgb/1.00.png\n1.00 rgb/1.03.png\n");
  folder.write("depth.txt", "1.01 depth/1.01.png\n1.01 depth/1.04.png\n");
  const auto index = io::detail::index_tum(folder.path()).value();
  REQUIRE(index.frames.size() == 1);
  CHECK(index.frames[0].color.filename() == "1.00.png");
  CHECK(mentions(index, "repeated time stamp"));
}

TEST_CASE("an association list decides and may name depth first") {
  const temporary_folder folder;
  write_images(folder);
  folder.write("rgb.txt", "1.00 rgb/1.00.png\n");
  folder.write("depth.txt", "1.01 depth/1.01.png\n");
  folder.write("associations.txt",
               "# all\n1.03 rgb/1.03.png 1.30 depth/1.30.png\nbad line\n1.00 rgb/1.00.png 1.04 depth/1.04.png\n");
  for (int pass = 0; pass != 2; ++pass) {
    const auto index = io::detail::index_tum(folder.path()).value();
    REQUIRE(index.frames.size() == 2);
    CHECK(index.frames[0].timestamp == 1.00);
    CHECK(index.frames[0].color.filename() == "1.00.png");
    CHECK(index.frames[0].depth.filename() == "1.04.png");
    CHECK(index.frames[1].depth.filename() == "1.30.png");
    CHECK(mentions(index, pass == 0 ? "associations.txt:3: skipped" : "not in chronological order"));
    folder.write("associations.txt", "1.30 depth/1.30.png 1.03 rgb/1.03.png\n1.04 depth/1.04.png 1.00 rgb/1.00.png\n");
  }
}

TEST_CASE("what is missing in a TUM recording is named") {
  const temporary_folder folder;
  folder.write("rgb.txt", "1.00 rgb/1.00.png\n");
  CHECK_THAT(message_of(io::detail::index_tum(folder.path())),
             StartsWith((folder / "depth.txt").string() + ": no such file; a recording in the TUM layout") &&
                 EndsWith("the folder holds rgb.txt"));
  folder.write("depth.txt", "# nothing\n\n");
  CHECK(message_of(io::detail::index_tum(folder.path())) ==
        (folder / "depth.txt").string() + ": the list contains no images");
  folder.write("depth.txt", "1.00 depth/1.00.png\n");
  CHECK(message_of(io::detail::index_tum(folder.path()))
            .find("1.00.png: the first image of the recording does not exist") != std::string::npos);
  folder.write("rgb/1.00.png", "x");
  CHECK(io::detail::index_tum(folder.path()).error().code == orbis::errc::not_found);
  folder.write("depth/1.00.png", "x");
  CHECK(io::detail::index_tum(folder.path()).has_value());
}

TEST_CASE("the ground truth is interpolated at the colour images") {
  const temporary_folder folder;
  write_images(folder);
  folder.write("rgb.txt", "1.00 rgb/1.00.png\n1.03 rgb/1.03.png\n1.09 rgb/1.09.png\n");
  folder.write("depth.txt", "1.01 depth/1.01.png\n1.04 depth/1.04.png\n1.09 depth/1.30.png\n");
  folder.write("groundtruth.txt", "0.98 0 0 0 0 0 0 1\n1.04 6 0 0 0 0 1 0\n");
  const auto index = io::detail::index_tum(folder.path()).value();
  REQUIRE(index.frames.size() == 3);
  CHECK(index.frames[0].T_world_camera.value().translation().x() == Approx(2.0));
  CHECK(index.frames[0].T_world_camera.value().rotation().angle() == Approx(3.14159265358979 / 3.0));
  CHECK(index.frames[1].T_world_camera.value().translation().x() == Approx(5.0));
  CHECK_FALSE(index.frames[2].T_world_camera.has_value());
  CHECK(mentions(index, "1 of 3 frames are outside the ground truth"));
  CHECK(index.ground_truth.size() == 2);

  folder.write("groundtruth.txt", "0.98 0 0 0 0 0 0 1\n1.04 nan zero 0 0 0 1 0\n");
  CHECK(message_of(io::detail::index_tum(folder.path())) ==
        (folder / "groundtruth.txt").string() + ":2: \"zero\" is not a number");
}

TEST_CASE("a time stamp that an association list repeats gives one frame") {
  const temporary_folder folder;
  folder.write("associations.txt", "2 rgb/b.png 2 depth/b.png\n1 rgb/a.png 1 depth/a.png\n1 rgb/x.png 1 depth/x.png\n");
  std::vector<std::string> notes;
  const auto frames = io::detail::read_associations(folder / "associations.txt", notes).value();
  REQUIRE(frames.size() == 2);
  CHECK(frames[0].color.filename() == "a.png");
  CHECK(notes.back().find("1 lines with a repeated time stamp skipped") != std::string::npos);
}

TEST_CASE("lists are read with any separator, quotes, a heading, a byte order mark and blanks in names") {
  const std::string expected[] = {"rgb/1.png", "rgb/a 2.png"};
  for (const char* const text : {"1.5 rgb/1.png\n2.5 rgb/a 2.png\n", "1.5,rgb/1.png\n2.5,rgb/a 2.png\n",
                                 "1.5, rgb/1.png\r\n2.5, rgb/a 2.png\r\n", "1.5;rgb/1.png;\n2.5;rgb/a 2.png;\n",
                                 "1.5\trgb/1.png\n2.5\trgb/a 2.png\n", "1.5 rgb\\1.png\n2.5 rgb\\a 2.png\n",
                                 "\xEF\xBB\xBF# t f\n1.5 rgb/1.png\n2.5 rgb/a 2.png",
                                 "timestamp,filename\n1.5,\"rgb/1.png\"\n2.5,\"rgb/a 2.png\"\n"}) {
    INFO(text);
    std::vector<std::string> notes;
    const auto files = io::detail::parse_image_list(text, "x/rgb.txt", "x", notes).value();
    REQUIRE(files.size() == 2);
    CHECK(notes.empty());
    for (std::size_t i : {0U, 1U}) {
      CHECK(files[i].timestamp == 1.5 + static_cast<double>(i));
      CHECK(files[i].path == std::filesystem::path{"x"} / expected[i]);
    }
  }
  for (const char* const text :
       {"1 rgb/a 1.png 1.01 depth/a 1.png\n", "1,rgb/a 1.png,1.01,depth/a 1.png\n",
        "1.01; depth/a 1.png; 1; rgb/a 1.png\n", "\xEF\xBB\xBF\"t\" x\n1\trgb/a 1.png\t1.01\tdepth/a 1.png\r\n"}) {
    INFO(text);
    std::vector<std::string> notes;
    const auto pairs = io::detail::parse_associations(text, "x/a.txt", notes).value();
    REQUIRE(pairs.size() == 1);
    CHECK(pairs[0].timestamp == 1.0);
    CHECK(pairs[0].depth_timestamp == 1.01);
    CHECK(pairs[0].color == "x/rgb/a 1.png");
    CHECK(pairs[0].depth == "x/depth/a 1.png");
  }
}

TEST_CASE("a list without entries quotes its first line") {
  std::vector<std::string> notes;
  for (const char* const text : {"a b\nc d\n", "x\n[1] rgb/1.png\n[2] rgb/2.png\n", "-\n"})
    CHECK_THAT(message_of(io::detail::parse_image_list(text, "rgb.txt", "", notes)),
               StartsWith("rgb.txt:") && Contains("the list contains no images: \"") &&
                   EndsWith("\" is not a time stamp and a file name"));
  CHECK_THAT(message_of(io::detail::parse_associations("1 rgb/1.png depth/1.png\n", "a.txt", notes)),
             Contains("a.txt:1: the list contains no images: \"1 rgb/1.png depth/1.png\" is not two pairs"));
}

TEST_CASE("whole numbers in lists are frame numbers, other stamps have the unit of their digits") {
  const temporary_folder folder;
  write_images(folder);
  folder.write("rgb.txt", "3 rgb/1.00.png\n4 rgb/1.03.png\n6 rgb/1.09.png\n");
  folder.write("depth.txt", "3 depth/1.01.png\n4 depth/1.04.png\n6 depth/1.30.png\n");
  folder.write("groundtruth.txt", "3 0 0 0 0 0 0 1\n4 1 0 0 0 0 0 1\n");
  const auto index = io::detail::index_tum(folder.path(), 0.02, 10.0).value();
  CHECK(index.frames[2].timestamp == 0.6);
  CHECK(index.frames[1].T_world_camera.value().translation().x() == 1.0);
  CHECK(index.ground_truth[1].timestamp == 0.4);
  CHECK(mentions(index, "the time stamps are frame numbers; converted to seconds at 10 frames per second"));
  folder.write("depth.txt", "3.01 depth/1.01.png\n4.01 depth/1.04.png\n6.01 depth/1.30.png\n");  // seconds
  CHECK(io::detail::index_tum(folder.path(), 0.02, 10.0).value().frames[2].timestamp == 6.0);
  for (const char* const zeros : {"000", "000000", "000000000"}) {
    const std::string z = zeros;
    folder.write("rgb.txt", "1305031102" + z + " rgb/1.00.png\n1305031103" + z + " rgb/1.03.png\n");
    folder.write("depth.txt", "1305031102" + z + ".5 depth/1.01.png\n1305031103" + z + " depth/1.04.png\n");
    std::filesystem::remove(folder / "groundtruth.txt");
    const auto in_seconds = io::detail::index_tum(folder.path()).value();
    REQUIRE(in_seconds.frames.size() == 2);
    CHECK(std::abs(in_seconds.frames[0].timestamp - 1305031102.0) < 1e-6);
  }
}

TEST_CASE("the folder's name tells the camera of the benchmark's sequences") {
  const temporary_folder folder;
  for (const auto& [name, fx] :
       {std::pair{"rgbd_dataset_freiburg1_desk", 517.3}, std::pair{"rgbd_dataset_freiburg2_xyz", 520.9},
        std::pair{"rgbd_dataset_freiburg3_office", 535.4},
        std::pair{"rgbd_dataset_freiburg2_xyz/rgbd_dataset_freiburg1_xyz", 517.3},
        std::pair{"rgbd_dataset_freiburg2_desk/part", 520.9}, std::pair{"freiburg3_desk", 535.4}}) {
    const std::filesystem::path sub = name;
    folder.write(sub / "rgb.txt", "1 a.png\n");
    folder.write(sub / "depth.txt", "1 b.png\n");
    folder.write(sub / "a.png", "x");
    folder.write(sub / "b.png", "x");
    const auto index = io::detail::index_tum(folder / sub).value();
    CHECK(index.camera.value().model.k().fx == fx);
    CHECK_THAT(index.camera_guess, Contains("according to the name "));
  }
  for (const std::filesystem::path name : {"my_freiburg1_walk", "freiburg1/kitchen", "rgbd_dataset/x"}) {
    folder.write(name / "rgb.txt", "1 a.png\n");
    folder.write(name / "depth.txt", "1 b.png\n");
    folder.write(name / "a.png", "x");
    folder.write(name / "b.png", "x");
    CHECK_FALSE(io::detail::index_tum(folder / name).value().camera);
  }
}

TEST_CASE("every truncation of a list is an index or an error in words") {
  const temporary_folder folder;
  write_images(folder);
  folder.write("depth.txt", "1.01 depth/1.01.png\n1.04 depth/1.04.png\n");
  const std::string good = "# color\n1.00 rgb/1.00.png\n1.03 rgb/1.03.png\n";
  for (std::size_t n = 0; n <= good.size(); ++n) {
    folder.write("rgb.txt", good.substr(0, n));
    const auto index = io::detail::index_tum(folder.path());
    if (index)
      CHECK_FALSE(index->frames.empty());
    else
      CHECK_FALSE(index.error().message.empty());
  }
}

TEST_CASE("a piece of the TUM benchmark is indexed as it was shipped") {
  ORBIS_NEEDS_DATA("fr1_desk_9");
  const auto index = io::detail::index_tum(orbis::test::data_dir() / "fr1_desk_9").value();
  REQUIRE(index.frames.size() == 9);
  CHECK(index.ground_truth.size() == 2335);
  for (const auto& frame : index.frames) CHECK(frame.T_world_camera.has_value());
  CHECK(index.frames[0].color.filename() == "1305031453.359684.png");
  CHECK(index.frames[0].depth.filename() == "1305031453.374112.png");
}

TEST_CASE("a list of nothing but rubbish is said so in few words") {
  std::vector<std::string> notes;
  std::string text = "1 a.png 2 b.png\n";
  for (int i = 0; i != 5000; ++i) text += "x\n";
  REQUIRE(io::detail::parse_image_list(text, "rgb.txt", "", notes).value().size() == 1);
  REQUIRE(notes.size() == 11);
  CHECK(notes.front() == "rgb.txt:2: skipped, \"x\" is not a time stamp and a file name");
  CHECK(notes.back() == "rgb.txt: 4990 more lines skipped");
  notes.clear();
  REQUIRE(io::detail::parse_associations(text, "both.txt", notes).value().size() == 1);
  CHECK(notes.size() == 11);
}

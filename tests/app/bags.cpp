// SPDX-License-Identifier: BSD-3-Clause
//
// The bags in tests/app/bags: containers and messages that other implementations wrote, and what is left of them if
// they are cut off. Needs all libraries for bags.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <sys/stat.h>

#ifdef RGBD_SLAM_SQLITE
#include <sqlite3.h>
#endif

#include <orbis/core/file.hpp>

#include "inputs/bag_file.hpp"
#include "inputs/file_recording.hpp"
#include "inputs/ros_messages.hpp"
#include "io/recordings.hpp"
#include "support/catch.hpp"

#if defined RGBD_SLAM_SQLITE && defined RGBD_SLAM_LZ4 && defined RGBD_SLAM_ZSTD && defined RGBD_SLAM_BZ2
using namespace orbis;
using Catch::Matchers::Contains;
using slam::sensor_kind;
using test::message_of;
using test::temporary_folder;

namespace {

const std::filesystem::path bags{BAGS};
constexpr camera::intrinsics k{16, 12, 20.0, 20.0, 7.5, 5.5};

const std::string color_topic = "/camera/camera/color/image_raw";

/// The colours that make_bags.mjs writes.
void check_color(const image<rgb8>& color, std::size_t i) {
  REQUIRE(color.width() == 16);
  REQUIRE(color.height() == 12);
  for (const auto& [x, y] : {std::pair{0, 0}, {15, 11}, {3, 7}})
    CHECK(color(x, y) == rgb8{static_cast<std::uint8_t>(10 * static_cast<int>(i) + x),
                              static_cast<std::uint8_t>(20 + y),
                              static_cast<std::uint8_t>(200 - x - static_cast<int>(i))});
}

/// The depth that make_bags.mjs writes: a wall at 400 mm, then the pixels from `first` to `last` at 410 mm, 420 mm...
void check_depth(const app::source_frame& frame, std::size_t i, std::pair<int, int> first, std::pair<int, int> last) {
  const double stored = (0.4 + 0.01 * static_cast<double>(i)) * frame.depth_scale;
  for (int y = 0; y != 12; ++y)
    for (int x = 0; x != 16; ++x) {
      const bool is_set = i == 0 || (x >= first.first && x <= last.first && y >= first.second && y <= last.second);
      INFO(x << ' ' << y);
      CHECK(frame.depth(x, y) == (is_set ? static_cast<std::uint16_t>(std::lround(stored)) : 0));
    }
}

/// Checks `n` frames at intervals of 0.1 s, with depth that is registered in the bag.
void check_frames(const app::file_recording& bag, std::size_t n, double begin) {
  CHECK(bag.sensor == sensor_kind::rgbd);
  CHECK(bag.camera.model.k() == k);
  REQUIRE(bag.size() == n);
  for (std::size_t i = 0; i != n; ++i) {
    const auto frame = bag.frame(i).value();
    CHECK(frame.timestamp == Approx(begin + 0.1 * static_cast<double>(i)).epsilon(1e-15).margin(1e-6));
    check_color(frame.color, i);
    check_depth(frame, i, {6, 4}, {6, 4});
    CHECK(bag.color(i).value() == frame.color);
  }
}

std::vector<std::filesystem::path> all_bags() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator{bags})
    if (app::is_bag(entry.path()) && entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

TEST_CASE("A camera of a bag that cannot have made its images is refused") {
  app::ros_messages::camera_info info{};
  info.width = 160;
  info.height = 120;
  info.distortion_model = "plumb_bob";
  const auto with_focal = [&](double f) {
    info.K = {f, 0, 80, 0, f, 60, 0, 0, 1};
    info.P = {f, 0, 80, 0, 0, f, 60, 0, 0, 0, 1, 0};
  };
  for (const bool is_rectified : {false, true}) {
    with_focal(130.0);
    CHECK(app::ros_messages::make_camera(info, is_rectified, "a.bag"));
    with_focal(0.000001);
    CHECK_THAT(message_of(app::ros_messages::make_camera(info, is_rectified, "a.bag")),
               Contains("a.bag: fx = 1e-06 is too short"));
    with_focal(0.0);
    CHECK_THAT(message_of(app::ros_messages::make_camera(info, is_rectified, "a.bag")), Contains("calibrated?"));
  }
}

TEST_CASE("bags of all containers and compressions have the same frames") {
  const auto [name, frames, begin] = GENERATE(table<const char*, std::size_t, double>({
      {"no_chunks.mcap", 3, 100.0},
      {"no_index_lz4.mcap", 3, 0.0},
      {"no_stamps.mcap", 3, 50.25},  // the times of recording
      {"ros1.mcap", 3, 5.0},
      {"split", 4, 1.7e9},
      {"messages_zstd.db3", 3, 1.7e9},
      {"wal/wal.db3", 3, 1.7e9},
      {"bz2.bag", 3, 1.7e9},
      {"lz4.bag", 3, 1.7e9},
  }));
  INFO(name);
  REQUIRE(app::is_bag(bags / name));
  const auto bag = app::open_bag(bags / name, {}).value();
  CHECK(bag->notes.empty());
  check_frames(*bag, frames, begin);
}

TEST_CASE("depth that is not registered is registered by both cameras and the static transforms") {
  const std::string name = GENERATE("realsense_zstd.mcap", "none.bag");
  const auto bag = app::open_bag(bags / name, {}).value();
  CHECK(bag->notes.empty());
  CHECK(bag->images_of == color_topic + " and /camera/camera/depth/image_rect_raw (registered by tf)");
  REQUIRE(bag->size() == 3);
  for (std::size_t i = 0; i != 3; ++i) {
    const auto frame = bag->frame(i).value();
    check_color(frame.color, i);
    // The depth camera is 15 mm to the right; its pixel (6, 4) has twice the size of a colour pixel.
    check_depth(frame, i, {8, 5}, {10, 6});
  }
  CHECK_THAT(message_of(app::open_bag(bags / "no_tf.mcap", {})),
             Contains("depth is not registered to colour") && Contains("no static transform connects them"));
  const auto color = app::open_bag(bags / "no_tf.mcap", {.topics = {color_topic}}).value();
  CHECK(color->sensor == sensor_kind::monocular);
  CHECK(color->images_of == color_topic);
}

TEST_CASE("ground truth of a bag comes from poses, odometry or transforms, and is that of the camera") {
  const auto path = bags / "realsense_zstd.mcap";
  const auto truth = [&](const std::string& topic) { return app::open_bag(path, {.truth_topic = topic}).value(); };
  const auto check = [&](const app::file_recording& bag, const vec3& begin, const vec3& step) {
    REQUIRE(bag.ground_truth.size() == 3);
    for (std::size_t i = 0; i != 3; ++i) {
      CHECK(bag.ground_truth[i].timestamp == Approx(1.7e9 + 0.1 * static_cast<double>(i)).epsilon(1e-15));
      const vec3 expected = begin + static_cast<double>(i) * step;
      CHECK(norm(vec3{bag.ground_truth[i].T_world_camera.translation() - expected}) < 1e-9);
    }
  };
  const vec3 z(0, 0, 1);
  const auto transforms = truth("/tf");
  CHECK(transforms->notes.empty());
  CHECK(transforms->truth_of == "/tf (camera_color_optical_frame in map)");
  check(*transforms, vec3(-0.015, 0.1, 0.3), vec3(0.1, 0, 0));
  CHECK(norm(vec3{transforms->ground_truth[1].T_world_camera.rotation() * z - vec3(0, 1, 0)}) < 1e-9);

  const auto odometry = truth("/odom");
  CHECK(odometry->notes.empty());
  CHECK(odometry->truth_of == "/odom (base_link in map)");
  check(*odometry, vec3(0.1, 0.015, 0.3), vec3(0.1, 0, 0));
  CHECK(norm(vec3{odometry->ground_truth[1].T_world_camera.rotation() * z - vec3(1, 0, 0)}) < 1e-9);

  const auto poses = truth("/mocap/pose");
  CHECK_THAT(poses->notes.at(0),
             Contains("used as those of the camera; geometry_msgs/PoseStamped does not specify a body"));
  check(*poses, vec3(0, 0, 1), vec3(0, 0.1, 0));

  CHECK(app::open_bag(path, {}).value()->ground_truth.empty());
  CHECK_THAT(message_of(app::open_bag(path, {.truth_topic = "/chatter"})),
             Contains("has no poses in /chatter; there are poses in ") && Contains("/odom"));
  CHECK_THAT(message_of(app::open_bag(path, {.truth_topic = "/tf_static"})),
             Contains("/tf_static has static transforms only; there are poses in ") && Contains("/odom"));
}

TEST_CASE("the baseline of two cameras comes from their frames if their messages have none") {
  const auto bag = app::open_bag(bags / "stereo.mcap", {}).value();
  CHECK(bag->sensor == sensor_kind::stereo);
  CHECK(bag->camera.baseline.value() == Approx(0.25));
  REQUIRE(bag->size() == 3);
  const auto frame = bag->frame(2).value();
  CHECK(frame.color(3, 3) == rgb8{126, 126, 126});
  // Y, U and V of 126: BT.601 with 16 to 235.
  CHECK(std::abs(frame.right(3, 3).r - 125) <= 1);
  CHECK(std::abs(frame.right(3, 3).g - 131) <= 1);
  CHECK(std::abs(frame.right(3, 3).b - 124) <= 1);
}

TEST_CASE("an interrupted bag gives its complete messages, and a note") {
  const std::string name = GENERATE("interrupted.bag.active", "interrupted_lz4.bag.active");
  const auto bag = app::open_bag(bags / name, {}).value();
  REQUIRE(!bag->notes.empty());
  CHECK_THAT(bag->notes[0], Contains("the bag is truncated, damaged or was not closed; "));
  check_frames(*bag, 2, 1.7e9);
}

TEST_CASE("a database and its write-ahead log are not changed, and no files are created") {
  const temporary_folder folder;
  for (const char* file : {"wal.db3", "wal.db3-wal"}) std::filesystem::copy(bags / "wal" / file, folder.path() / file);
  CHECK(app::is_bag(folder.path()));
  check_frames(*app::open_bag(folder.path() / "wal.db3", {}).value(), 3, 1.7e9);
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator{folder.path()}) {
    CHECK(read_file(entry.path()).value() == read_file(bags / "wal" / entry.path().filename()).value());
    ++count;
  }
  CHECK(count == 2);
  std::filesystem::remove(folder.path() / "wal.db3-wal");
  CHECK(app::open_bag(folder.path(), {}).value()->size() == 2);
}

TEST_CASE("the empty write-ahead log of a recorder that is still running stays") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.db3";
  std::filesystem::copy(bags / "split/split_0.db3", path);
  sqlite3* recorder = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &recorder) == SQLITE_OK);
  REQUIRE(sqlite3_exec(recorder,
                       "PRAGMA journal_mode = WAL; CREATE TABLE more (data BLOB); PRAGMA wal_checkpoint(TRUNCATE);",
                       nullptr, nullptr, nullptr) == SQLITE_OK);
  const auto log = folder.path() / "a.db3-wal";
  REQUIRE(std::filesystem::file_size(log) == 0);
  check_frames(*app::open_bag(path, {}).value(), 2, 1.7e9);
  CHECK(std::filesystem::exists(log));
  sqlite3_close(recorder);
}

TEST_CASE("a database with views, or with a pipe as its journal, is refused") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.db3";
  std::filesystem::copy(bags / "split/split_0.db3", path);
  SECTION("views, which need not end") {
    const std::string table = GENERATE("topics", "messages");
    sqlite3* writer = nullptr;
    REQUIRE(sqlite3_open(path.c_str(), &writer) == SQLITE_OK);
    const std::string columns = table == "topics" ? "1 AS id, 'a' AS name, 'b' AS type, 'cdr' AS serialization_format"
                                                  : "1 AS id, 1 AS topic_id, 1 AS timestamp, x'00' AS data";
    const std::string sql = "ALTER TABLE " + table + " RENAME TO old; CREATE VIEW " + table +
                            " AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT " + columns +
                            " FROM n;";
    REQUIRE(sqlite3_exec(writer, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
    sqlite3_close(writer);
    CHECK_THAT(app::open_bag(path, {}).error().message, Contains("is not a readable bag (rosbag2): "));
  }
  SECTION("a pipe") {
    const std::string pipe = path.string() + GENERATE("-journal", "-wal");
    REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
    const auto refused = app::open_bag(path, {});
    CHECK(refused.error().where == pipe);
    CHECK(refused.error().message == "is not a regular file");
  }
}

TEST_CASE("a database whose recording was interrupted in a transaction is read as it is, and unchanged") {
  const temporary_folder folder, copy;
  const auto path = folder.path() / "a.db3";
  std::filesystem::copy(bags / "split/split_0.db3", path);
  sqlite3* writer = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &writer) == SQLITE_OK);
  // More than the cache holds, so that a part is in the file before the end of the transaction.
  REQUIRE(sqlite3_exec(writer,
                       "PRAGMA journal_mode = DELETE; PRAGMA cache_size = 2; BEGIN;"
                       "CREATE TABLE more (data BLOB); INSERT INTO more VALUES (randomblob(50000));",
                       nullptr, nullptr, nullptr) == SQLITE_OK);
  for (const char* name : {"a.db3", "a.db3-journal"}) std::filesystem::copy(folder.path() / name, copy.path() / name);
  sqlite3_close(writer);
  const auto interrupted = copy.path() / "a.db3";
  const std::string bytes = read_file(interrupted).value(), journal = read_file(copy.path() / "a.db3-journal").value();
  CHECK(app::is_bag(copy.path()));
  const auto bag = app::open_bag(interrupted, {}).value();
  CHECK_THAT(bag->notes.at(0), Contains("the recording was interrupted; its last messages may be damaged"));
  check_frames(*bag, 2, 1.7e9);
  CHECK(read_file(interrupted).value() == bytes);
  CHECK(read_file(copy.path() / "a.db3-journal").value() == journal);
}

TEST_CASE("of a folder with metadata the listed files are read") {
  const temporary_folder folder;
  for (const char* file : {"split_0.db3", "split_1.db3"})
    std::filesystem::copy(bags / "split" / file, folder.path() / file);
  const auto frames = [&](const std::string& list) {
    folder.write("metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:" + list +
                                      "\n  duration:\n    nanoseconds: 1\n");
    const auto bag = app::open_bag(folder.path(), {}).value();
    CHECK(bag->notes.empty());
    return bag->size();
  };
  CHECK(frames("\n    - split_0.db3") == 2);
  CHECK(frames("\n    - split_0.db3\n    - split_1.db3") == 4);
  CHECK(frames(" [split_1.db3]") == 2);
  CHECK(frames(" ['bag/split_0.db3',\n    \"split_1.db3\"]") == 4);
  CHECK(frames("\n    - split_0.db3.zstd") == 2);
}

TEST_CASE("a folder without metadata, with missing or damaged parts gives the rest") {
  const temporary_folder folder;
  for (const char* file : {"split_0.db3", "split_1.db3"})
    std::filesystem::copy(bags / "split" / file, folder.path() / file);
  CHECK(app::is_bag(folder.path()));
  const auto whole = app::open_bag(folder.path(), {}).value();
  CHECK_THAT(whole->notes.at(0), Contains("metadata.yaml is missing or damaged"));
  check_frames(*whole, 4, 1.7e9);

  std::filesystem::copy(bags / "split/metadata.yaml", folder.path() / "metadata.yaml");
  folder.write("split_1.db3", "damaged");
  const auto first = app::open_bag(folder.path(), {}).value();
  CHECK_THAT(first->notes.at(0), Contains("split_1.db3: is not a readable bag"));
  CHECK(first->size() == 2);
  std::filesystem::remove(folder.path() / "split_1.db3");
  CHECK_THAT(app::open_bag(folder.path(), {}).value()->notes.at(0),
             Contains("split_1.db3, listed in metadata.yaml, is missing"));

  folder.write("split_1.db3.zstd", "\x28\xb5\x2f\xfd and so on");
  CHECK_THAT(message_of(app::open_bag(folder.path(), {})),
             Contains("is compressed as a whole; decompress it first: zstd -d split_1.db3.zstd"));
  std::filesystem::remove(folder.path() / "split_0.db3");
  std::filesystem::remove(folder.path() / "split_1.db3.zstd");
  CHECK_THAT(message_of(app::open_bag(folder.path(), {})), Contains("contains no .db3 or .mcap file"));
  CHECK(!app::is_bag(BAGS "/README.md"));
  CHECK(!app::is_bag(bags));  // it has other files
}

TEST_CASE("an unknown compression is named, and damaged images are omitted with a note") {
  const temporary_folder folder;
  const auto changed = [&](const char* name, const std::string& from, const std::string& to) {
    std::string bytes = read_file(bags / name).value();
    const std::size_t at = bytes.find(from);
    REQUIRE(at != std::string::npos);
    return folder.write(name, bytes.replace(at, to.size(), to));
  };
  for (const auto& file :
       {changed("lz4.bag", "=lz4", "=xyz"),
        changed("realsense_zstd.mcap", std::string("\4\0\0\0zstd", 8), std::string("\4\0\0\0xyz2", 8))})
    CHECK_THAT(message_of(app::open_bag(file, {})), Contains("the compression \"xyz") && Contains("is not supported"));
  std::string bytes = read_file(bags / "lz4.bag").value();
  bytes.replace(bytes.rfind("=lz4") + 80, 100, std::string(100, '\xff'));  // in the last chunk
  const auto bag = app::open_bag(folder.write("damaged.bag", bytes), {}).value();
  CHECK_THAT(bag->notes.at(0), Contains("1 image of /camera/camera/color/image_raw/compressed "
                                        "is omitted because of damage or truncation: ") &&
                                   Contains("a message is damaged in the chunk at byte "));
  check_frames(*bag, 2, 1.7e9);
}

TEST_CASE("a ROS 1 bag that is cut off among its definitions has all topics, and a note") {
  const temporary_folder folder;
  const std::string bytes = read_file(bags / "none.bag").value();
  const auto path = folder.write("a.bag", bytes);
  const auto whole = app::bag::open(path).value();
  CHECK(whole.notes.empty());
  std::uint64_t begin = 0;
  std::memcpy(&begin, &bytes[bytes.find("index_pos=") + 10], sizeof begin);
  REQUIRE(begin < bytes.size() - 1000);
  for (std::size_t size = bytes.size() - 1; size >= begin; --size) {
    std::filesystem::resize_file(path, size);
    INFO(size);
    const auto cut = app::bag::open(path).value();
    REQUIRE(cut.topics.size() == whole.topics.size());
    for (const app::bag_topic& t : cut.topics) {
      const auto same = std::ranges::find(whole.topics, t.name, &app::bag_topic::name);
      REQUIRE(same != whole.topics.end());
      REQUIRE(t.messages.size() == same->messages.size());
    }
    REQUIRE(cut.notes.size() == 1);
    REQUIRE_THAT(cut.notes[0], Contains("truncated"));
  }
}

TEST_CASE("topics of an MCAP file whose summary has no schemas are found") {
  const temporary_folder folder;
  std::string bytes = read_file(bags / "realsense_zstd.mcap").value();
  const auto whole = app::bag::open(bags / "realsense_zstd.mcap").value();
  std::uint64_t at = 0;
  std::memcpy(&at, &bytes[bytes.size() - 28], sizeof at);  // the summary, from the footer
  std::size_t schemas = 0;
  for (std::uint64_t length = 0; at < bytes.size() - 37; at += 9 + length) {
    std::memcpy(&length, &bytes[at + 1], sizeof length);
    if (bytes[at] == 3) bytes[at] = '\x7f', ++schemas;  // an unknown record
  }
  CHECK(schemas > 2);
  const auto changed = app::bag::open(folder.write("a.mcap", bytes)).value();
  CHECK(changed.notes.empty());
  REQUIRE(changed.topics.size() == whole.topics.size());
  for (const app::bag_topic& t : changed.topics) {
    const auto same = std::ranges::find(whole.topics, t.name, &app::bag_topic::name);
    REQUIRE(same != whole.topics.end());
    CHECK(t.messages.size() == same->messages.size());
  }
}

TEST_CASE("a bag that is cut off anywhere gives complete frames or an error") {
  const temporary_folder folder;
  std::size_t opened = 0, failed = 0;
  for (const auto& bag : all_bags()) {
    INFO(bag);
    const std::string bytes = read_file(bag).value();
    const std::string name = bag.filename().string();
    std::size_t frames = 0;  // of the whole file
    sensor_kind sensor{};
    std::string images_of;
    const auto path = folder.write(name, bytes);
    for (std::size_t size = bytes.size(); size > 0; size -= std::min<std::size_t>(size, 31)) {
      std::filesystem::resize_file(path, size);
      const auto recording = app::open_bag(path, {});
      ++(recording ? opened : failed);
      if (!recording) {
        CHECK(recording.error().to_string().size() < 600);
        continue;
      }
      const app::file_recording& found = **recording;
      if (size == bytes.size()) frames = found.size(), sensor = found.sensor, images_of = found.images_of;
      INFO(size << " of " << bytes.size() << " bytes: " << found.images_of);
      CHECK(
          ((found.size() == frames && found.sensor == sensor && found.images_of == images_of) || !found.notes.empty()));
      for (std::size_t i = 0; i != (*recording)->size(); ++i) {
        const auto frame = (*recording)->frame(i);
        INFO(message_of(frame));
        REQUIRE(frame);
        if (name != "stereo.mcap") check_color(frame->color, i + (name == "split_1.db3" ? 2 : 0));
      }
    }
  }
  CHECK(opened > failed / 4);
  CHECK(failed > 100);
}
#else
TEST_CASE("bags of other programs") { WARN("[skipped] this build lacks a library for bags"); }
#endif

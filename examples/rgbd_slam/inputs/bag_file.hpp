// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Topics and messages of ROS bags, independent of the container: ROS 1 bags (format 2.0), MCAP files, and SQLite
/// databases of rosbag2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/core/result.hpp>

#include "inputs/byte_source.hpp"
#include "inputs/message_reader.hpp"

namespace app {

/// The position of a message, and the time at which it was recorded.
struct bag_message {
  std::int64_t time = 0;  ///< nanoseconds
  std::uint64_t at = 0;   ///< position in the file or chunk; for SQLite, the row
  std::uint32_t chunk = 0, file = 0;
};

struct bag_topic {
  std::string name, type;  ///< the type is spelt as in ROS 1: "sensor_msgs/Image"
  message_encoding coding = message_encoding::cdr;
  std::vector<bag_message> messages;
};

/// Reads one file. Lists only messages that `bag_recording` may need: images, cameras, depth units, transforms and
/// poses. Memory: 24 bytes per listed message, 8 bytes per chunk, and two decompressed chunks. Not thread-safe.
class bag_file {
 public:
  virtual ~bag_file() = default;
  /// The first `most` bytes of a message. Errors: malformed, unreadable, unsupported (compression).
  [[nodiscard]] virtual orbis::result<std::string> read(const bag_message& m, std::size_t most) = 0;
  /// Frees memory that the next call to `read` allocates again.
  virtual void rest() {}

  std::vector<bag_topic> topics;
  std::vector<std::string> notes;  ///< warnings, for example that the file is truncated
};

inline constexpr std::size_t whole_message = std::size_t{1} << 30U;  ///< bytes; larger messages and chunks are rejected

/// The name of a type in ROS 1: "sensor_msgs/Image" for "sensor_msgs/msg/Image".
[[nodiscard]] std::string ros1_type(std::string_view type);
/// Returns true if the messages of a topic are listed. `type` is spelt as in ROS 1.
[[nodiscard]] bool is_listed(std::string_view name, std::string_view type);
/// Returns true for the topic of a librealsense bag that states the depth unit in metres.
[[nodiscard]] bool is_depth_unit(std::string_view name, std::string_view type);
/// Finds the topic with the name, type and encoding of `t` in a list; if it is missing, appends it without messages.
[[nodiscard]] bag_topic& topic_like(std::vector<bag_topic>& topics, const bag_topic& t);
/// The number of listed messages, for example "12 messages".
[[nodiscard]] std::string count_messages(const std::vector<bag_topic>& topics);

/// Lists the messages in a file. `where` names the file in errors and notes. For truncated files and files without an
/// index, lists the complete messages and adds a note. Errors: malformed, unsupported.
[[nodiscard]] orbis::result<std::unique_ptr<bag_file>> open_rosbag1(byte_source file, const std::string& where);
[[nodiscard]] orbis::result<std::unique_ptr<bag_file>> open_mcap(byte_source file, const std::string& where);
/// Lists the messages in a database. Leaves the database and its write-ahead log unchanged, and creates no files.
[[nodiscard]] orbis::result<std::unique_ptr<bag_file>> open_sqlite_bag(const std::filesystem::path& path);

/// Returns true if `path` is a bag or a folder with one. Examines the name of a file and its first bytes, or the files
/// in a folder.
[[nodiscard]] bool is_bag(const std::filesystem::path& path);

/// A bag that consists of one or more files: a single file, or the folder of a rosbag2 with its parts, whose
/// metadata.yaml may be missing.
class bag {
 public:
  /// Opens a bag. Errors: not_found, unreadable, malformed, unsupported, no_data.
  [[nodiscard]] static orbis::result<bag> open(const std::filesystem::path& path);

  /// The first `most` bytes of a message. Errors: those of `bag_file::read`.
  [[nodiscard]] orbis::result<std::string> read(const bag_message& m, std::size_t most = whole_message);

  std::vector<bag_topic> topics;  ///< topics with their messages, in chronological order
  std::vector<std::string> notes;
  std::vector<std::filesystem::path> files;

 private:
  std::vector<std::unique_ptr<bag_file>> parts_;
  std::uint32_t last_ = 0;  // the part that was read last
};

}  // namespace app

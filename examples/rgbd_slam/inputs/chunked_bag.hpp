// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The common structure of ROS 1 bags and MCAP files: records, some of which are chunks that contain further records.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "inputs/bag_file.hpp"

namespace app {

struct bag_record {
  enum class kind { other, topic, message, chunk, index, end };
  kind what = kind::other;
  std::uint64_t next = 0;            ///< position of the next record; exceeds the size of a truncated source
  std::uint64_t data = 0, size = 0;  ///< position and size of a message, of a chunk's contents or of index entries
  std::uint32_t channel = 0;         ///< channel of a topic, a message or an index
  std::int64_t time = 0;             ///< time of a message, nanoseconds
  std::string compression;           ///< compression of a chunk; empty: none
  std::uint64_t plain_size = 0;      ///< size of a chunk after decompression
  bag_topic topic;                   ///< name and type; a topic with an empty type is not listed
};

/// Scans the headers of the records from front to back. Lists the messages in a chunk from its index, or from the chunk
/// itself if it has no index or the index refers to a topic that is not defined yet.
class chunked_bag : public bag_file {
 public:
  chunked_bag(byte_source file, std::string where) : file_{std::move(file)}, where_{std::move(where)} {}
  /// Lists the messages. Errors: unsupported (compression).
  orbis::result<void> open();
  [[nodiscard]] orbis::result<std::string> read(const bag_message& m, std::size_t most) override;
  void rest() override { cache_ = {}; }

 protected:
  /// The record at a position; empty if there is none. `next` of a record is greater than its position.
  virtual std::optional<bag_record> record_at(byte_source& from, std::uint64_t at) = 0;
  /// Positions of the first record, and of the topic definitions outside of chunks (0: none).
  virtual std::uint64_t first_record() = 0;
  virtual std::uint64_t definitions() = 0;
  /// Message times and positions in the chunk, from the entries of an index.
  virtual std::vector<bag_message> entries(std::string_view bytes) = 0;

  byte_source file_;

 private:
  static constexpr std::uint32_t no_chunk = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t unlisted = std::numeric_limits<std::size_t>::max();
  struct opened_chunk {
    byte_source* source = nullptr;
    std::uint64_t begin = 0, end = 0;
    bool is_complete = true;
  };
  struct cached_chunk {
    std::uint32_t chunk = no_chunk;
    std::optional<byte_source> bytes;
    bool is_complete = true;
  };

  /// Returns true if there is a complete index of known topics at a position.
  bool has_index(std::uint64_t at);
  void define(const bag_record& r);
  void add(std::uint32_t channel, const bag_message& m);
  orbis::result<void> list(std::uint32_t chunk, bool has_end);
  orbis::result<opened_chunk> open_chunk(std::uint32_t chunk);

  std::string where_;
  std::map<std::uint32_t, std::size_t> topic_of_channel_;
  std::vector<std::uint64_t> chunks_;  // positions of the chunks
  std::array<cached_chunk, 2> cache_;  // most recent first
};

}  // namespace app

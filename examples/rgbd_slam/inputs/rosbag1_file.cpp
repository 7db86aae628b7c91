// SPDX-License-Identifier: BSD-3-Clause
//
// ROS 1 bags, format 2.0 (wiki.ros.org/Bags/Format/2.0): a record consists of a header of named fields and of data,
// each preceded by its length.
#include <string_view>

#include "inputs/chunked_bag.hpp"

namespace app {
namespace {

constexpr std::uint64_t magic = 13, most_head = 1U << 20U;  // bytes

/// The value of the field with this name; empty if there is none.
std::string_view field(std::string_view fields, std::string_view name) {
  message_reader in{fields, message_encoding::ros1};
  while (in.rest() != 0 && in.ok()) {
    const std::string_view one = in.string();
    if (one.size() > name.size() && one.starts_with(name) && one[name.size()] == '=')
      return one.substr(name.size() + 1);
  }
  return {};
}

/// The number in a field; 0 if there is none.
template <class T>
T number(std::string_view fields, std::string_view name) {
  return message_reader{field(fields, name), message_encoding::ros1}.number<T>();
}

std::int64_t read_time(message_reader& in) {
  const std::int64_t seconds = in.number<std::uint32_t>();
  return seconds * 1'000'000'000 + in.number<std::uint32_t>();
}

class rosbag1_file final : public chunked_bag {
 public:
  using chunked_bag::chunked_bag;

 private:
  enum operation : std::uint8_t { message = 2, bag_header, index, chunk, chunk_info, connection };

  std::uint64_t first_record() override { return magic; }
  /// Position of the topic definitions; 0 if the bag was not closed.
  std::uint64_t definitions() override { return read_header().definitions; }

  /// The numbers in the header of the bag.
  struct header {
    std::uint64_t definitions = 0;              // position of the definitions
    std::uint32_t connections = 0, chunks = 0;  // numbers of records at this position
  };
  header read_header() {
    const std::string bytes = file_.read(magic, 4096);
    message_reader in{bytes, message_encoding::ros1};
    const std::string_view fields = in.string();
    if (number<std::uint8_t>(fields, "op") != bag_header) return {};
    return {number<std::uint64_t>(fields, "index_pos"), number<std::uint32_t>(fields, "conn_count"),
            number<std::uint32_t>(fields, "chunk_count")};
  }
  /// Returns true if the end of the file has as many definitions and chunk records as the header specifies.
  bool has_whole_end() {
    const header known = read_header();
    std::uint32_t connections = 0, chunks = 0;
    std::uint64_t at = known.definitions;
    while (at != 0 && at < file_.size()) {
      const auto r = record_at(file_, at);
      if (!r || r->next > file_.size()) return false;
      (r->what == bag_record::kind::topic ? connections : chunks) += 1;
      at = r->next;
    }
    return at != 0 && connections == known.connections && chunks == known.chunks;
  }

  std::optional<bag_record> record_at(byte_source& from, std::uint64_t at) override {
    bag_record r;
    if (&from == &file_ && at == file_.size()) {
      if (!has_whole_end()) return std::nullopt;  // not closed, or truncated
      r.what = bag_record::kind::end;
      r.next = at + 1;
      return r;
    }
    std::string bytes = from.read(at, 256);
    const std::size_t length = message_reader{bytes, message_encoding::ros1}.number<std::uint32_t>();
    if (length > most_head) return std::nullopt;
    if (bytes.size() < length + 8) bytes = from.read(at, length + 8);
    message_reader in{bytes, message_encoding::ros1};
    const std::string_view fields = in.string();
    r.size = in.number<std::uint32_t>();
    const auto code = number<std::uint8_t>(fields, "op");
    if (!in.ok() || code < message || code > connection) return std::nullopt;
    r.data = at + in.position();
    r.channel = number<std::uint32_t>(fields, "conn");
    if (code == message) {
      r.what = bag_record::kind::message;
      message_reader time{field(fields, "time"), message_encoding::ros1};
      r.time = read_time(time);
    }
    if (code == chunk) {
      r.what = bag_record::kind::chunk;
      r.plain_size = number<std::uint32_t>(fields, "size");
      if (const std::string_view method = field(fields, "compression"); method != "none") r.compression = method;
      // The lengths of a chunk are written after its messages, so that they are zero if the recording was interrupted.
      if (r.size == 0 && !r.compression.empty() && r.data < from.size()) {
        r.size = from.size() - r.data;
        r.plain_size = whole_message;
      }
    }
    if (code == index) r.what = bag_record::kind::index;
    if (code == connection) {
      r.what = bag_record::kind::topic;
      r.topic.name = field(fields, "topic");
      const std::string definition = from.read(r.data, std::min(r.size, most_head));
      r.topic.type = field(definition, "type");
      r.topic.coding = message_encoding::ros1;
    }
    r.next = r.data + r.size;
    return r;
  }

  std::vector<bag_message> entries(std::string_view bytes) override {
    message_reader in{bytes, message_encoding::ros1};
    std::vector<bag_message> messages(bytes.size() / 12);
    for (bag_message& m : messages) {
      m.time = read_time(in);
      m.at = in.number<std::uint32_t>();
    }
    return messages;
  }
};

}  // namespace

orbis::result<std::unique_ptr<bag_file>> open_rosbag1(byte_source file, const std::string& where) {
  auto bag = std::make_unique<rosbag1_file>(std::move(file), where);
  if (auto opened = bag->open(); !opened) return orbis::fail(opened.error());
  return bag;
}

}  // namespace app

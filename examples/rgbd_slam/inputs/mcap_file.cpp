// SPDX-License-Identifier: BSD-3-Clause
//
// MCAP, version 0 (mcap.dev/spec): a record is an operation code, the 64-bit length of its fields, and the fields.
#include <string_view>

#include "inputs/chunked_bag.hpp"

namespace app {
namespace {

constexpr std::uint64_t magic = 8, head = 9;  // bytes in the header of the file, and of a record

class mcap_file final : public chunked_bag {
 public:
  using chunked_bag::chunked_bag;

 private:
  enum operation : std::uint8_t { footer = 2, schema_record, channel, message, chunk, index, data_end = 15 };

  std::uint64_t first_record() override { return magic; }
  std::uint64_t definitions() override {
    constexpr std::uint64_t footer_size = head + 8 + 8 + 4;
    if (file_.size() < 2 * magic + footer_size) return 0;
    const std::string bytes = file_.read(file_.size() - magic - footer_size, head + 8);
    message_reader in{bytes, message_encoding::ros1};
    if (in.number<std::uint8_t>() != footer || in.number<std::uint64_t>() != footer_size - head) return 0;
    return in.number<std::uint64_t>();
  }

  std::optional<bag_record> record_at(byte_source& from, std::uint64_t at) override {
    constexpr std::uint64_t most_head = 256, most_definition = 1U << 20U;  // bytes
    std::string bytes = from.read(at, most_head);
    message_reader in{bytes, message_encoding::ros1};  // ROS 1 has the same layout of numbers and strings
    const auto code = in.number<std::uint8_t>();
    const auto length = in.number<std::uint64_t>();
    if (!in.ok() || code == 0 || length > std::uint64_t{1} << 62U) return std::nullopt;
    bag_record r;
    r.next = at + head + length;
    if (length > most_head - head && (code == schema_record || code == channel)) {
      bytes = from.read(at, std::min(head + length, most_definition));
      in = message_reader{bytes, message_encoding::ros1};
      in.skip(head);
    }
    if (code == footer || code == data_end) r.what = bag_record::kind::end;
    if (code == schema_record) {
      const auto id = in.number<std::uint16_t>();
      const std::string name = ros1_type(in.string());
      if (in.ok()) schemas_[id] = name;
    }
    if (code == channel) {
      r.what = bag_record::kind::topic;
      r.channel = in.number<std::uint16_t>();
      const auto schema = in.number<std::uint16_t>();
      const auto type = schemas_.find(schema);
      if (schema != 0 && type == schemas_.end()) r.what = bag_record::kind::other;  // the summary may have no schemas
      r.topic.name = in.string();
      const std::string_view encoding = in.string();
      r.topic.coding = encoding == "ros1" ? message_encoding::ros1 : message_encoding::cdr;
      if (type != schemas_.end() && (encoding == "ros1" || encoding == "cdr")) r.topic.type = type->second;
    }
    if (code == message) {
      r.what = bag_record::kind::message;
      r.channel = in.number<std::uint16_t>();
      in.skip(4);  // a sequence number
      r.time = in.number<std::int64_t>();
      in.skip(8);  // the time of publication
    }
    if (code == chunk) {
      r.what = bag_record::kind::chunk;
      in.skip(8 + 8);  // the times of its messages
      r.plain_size = in.number<std::uint64_t>();
      in.skip(4);  // a checksum
      r.compression = in.string();
      r.size = in.number<std::uint64_t>();
    }
    if (code == index) {
      r.what = bag_record::kind::index;
      r.channel = in.number<std::uint16_t>();
      r.size = in.number<std::uint32_t>();
    }
    if (!in.ok() || in.position() > head + length) return std::nullopt;
    r.data = at + in.position();
    if (code == message) r.size = r.next - r.data;
    if ((code == chunk || code == index) && r.size > r.next - r.data) return std::nullopt;
    return r;
  }

  std::vector<bag_message> entries(std::string_view bytes) override {
    message_reader in{bytes, message_encoding::ros1};
    std::vector<bag_message> messages(bytes.size() / 16);
    for (bag_message& m : messages) {
      m.time = in.number<std::int64_t>();
      m.at = in.number<std::uint64_t>();
    }
    return messages;
  }

  std::map<std::uint16_t, std::string> schemas_;
};

}  // namespace

orbis::result<std::unique_ptr<bag_file>> open_mcap(byte_source file, const std::string& where) {
  auto bag = std::make_unique<mcap_file>(std::move(file), where);
  if (auto opened = bag->open(); !opened) return orbis::fail(opened.error());
  return bag;
}

}  // namespace app

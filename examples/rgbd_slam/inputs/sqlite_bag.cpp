// SPDX-License-Identifier: BSD-3-Clause
//
// The SQLite databases of rosbag2: a table of topics and a table of messages.
#include "inputs/bag_file.hpp"

#ifdef RGBD_SLAM_SQLITE
#include <algorithm>
#include <map>
#include <new>
#include <utility>

#include <sqlite3.h>
#endif

namespace app {

using orbis::errc;
using orbis::fail;
using orbis::result;

#ifdef RGBD_SLAM_SQLITE
namespace {

struct closer {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_blob* blob) const { sqlite3_blob_close(blob); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using statement = std::unique_ptr<sqlite3_stmt, closer>;

/// The bytes of a column, whose type may be text or a blob.
std::string_view column(const statement& row, int i) {
  const void* bytes = sqlite3_column_blob(row.get(), i);
  const int size = sqlite3_column_bytes(row.get(), i);
  return bytes == nullptr ? std::string_view{}
                          : std::string_view{static_cast<const char*>(bytes), static_cast<std::size_t>(size)};
}

/// Makes SQLite report an error if it reads the incomplete last page of a truncated file; by default, it would complete
/// the page with zeros.
void reject_short_reads(sqlite3* database) {
  sqlite3_file* file = nullptr;
  sqlite3_file_control(database, "main", SQLITE_FCNTL_FILE_POINTER, &file);
  if (file == nullptr || file->pMethods == nullptr) return;
  static const sqlite3_io_methods& plain = *file->pMethods;  // the same for all files opened with "unix-none"
  static const sqlite3_io_methods strict = [] {
    sqlite3_io_methods methods = plain;
    methods.xRead = [](sqlite3_file* from, void* to, int size, sqlite3_int64 at) {
      const int state = plain.xRead(from, to, size, at);
      return state == SQLITE_IOERR_SHORT_READ ? SQLITE_IOERR_READ : state;
    };
    return methods;
  }();
  file->pMethods = &strict;
}

class sqlite_bag final : public bag_file {
 public:
  sqlite_bag(std::string path, std::uintmax_t size) : path_{std::move(path)}, file_size_{size} {}

  result<void> open() {
    // Without locks and in exclusive mode, SQLite reads a write-ahead log but creates no files. A "writable" schema
    // makes it accept files that are shorter than their header indicates.
    connect(path_, 0);
    if (sqlite3_exec(database_.get(), "SELECT 1 FROM topics", nullptr, nullptr, nullptr) != SQLITE_OK &&
        sqlite3_extended_errcode(database_.get()) == SQLITE_READONLY_ROLLBACK) {
      connect(immutable(path_), SQLITE_OPEN_URI);  // ignores the journal
      notes.push_back(path_ + ": the recording was interrupted; its last messages may be damaged");
    }

    const auto unreadable = [&] {
      return fail(errc::malformed, path_, "is not a readable bag (rosbag2): " + reason());
    };
    std::map<std::int64_t, std::size_t> topic_of_id;
    const statement rows = prepare("SELECT id, name, type, serialization_format FROM topics");
    if (!rows) return unreadable();
    int state = sqlite3_step(rows.get());
    for (; state == SQLITE_ROW; state = sqlite3_step(rows.get())) {
      const std::string type = ros1_type(column(rows, 2));
      if (!is_listed(column(rows, 1), type) || column(rows, 3) != "cdr") continue;
      topic_of_id[sqlite3_column_int64(rows.get(), 0)] = topics.size();
      topics.push_back({std::string{column(rows, 1)}, type, message_encoding::cdr, {}});
    }
    const statement found = prepare("SELECT id, topic_id, timestamp FROM messages ORDER BY id");
    if (!found) return unreadable();
    const bool has_topics = state == SQLITE_DONE;
    for (state = sqlite3_step(found.get()); state == SQLITE_ROW; state = sqlite3_step(found.get()))
      if (const auto topic = topic_of_id.find(sqlite3_column_int64(found.get(), 1)); topic != topic_of_id.end())
        topics[topic->second].messages.push_back(
            {sqlite3_column_int64(found.get(), 2), static_cast<std::uint64_t>(sqlite3_column_int64(found.get(), 0))});
    // The missing pages at the end of a truncated file contain the rest of messages that begin in earlier pages.
    const auto can_read = [&](const bag_message& m) { return read(m, whole_message).has_value(); };
    const bool has_ends = std::ranges::all_of(
        topics, [&](const bag_topic& t) { return t.messages.empty() || can_read(t.messages.back()); });
    if (state == SQLITE_DONE && has_topics && has_ends) return {};
    for (bag_topic& t : topics) std::erase_if(t.messages, [&](const bag_message& m) { return !can_read(m); });
    notes.push_back(path_ + ": the bag is truncated or damaged; " + count_messages(topics) + " can be read");
    return {};
  }

  result<std::string> read(const bag_message& m, std::size_t most) override {
    sqlite3_blob* opened = nullptr;
    int state =
        sqlite3_blob_open(database_.get(), "main", "messages", "data", static_cast<sqlite3_int64>(m.at), 0, &opened);
    const std::unique_ptr<sqlite3_blob, closer> blob{opened};
    const auto size = static_cast<std::size_t>(sqlite3_blob_bytes(opened));
    if (state == SQLITE_OK && size <= file_size_) {
      std::string bytes(std::min(size, most), '\0');
      state = sqlite3_blob_read(opened, bytes.data(), static_cast<int>(bytes.size()), 0);
      if (state == SQLITE_OK) return bytes;
    }
    return fail(errc::malformed, path_,
                "message " + std::to_string(m.at) +
                    " cannot be read: " + (state == SQLITE_OK ? "it is larger than the file" : sqlite3_errstr(state)));
  }

 private:
  void connect(const std::string& name, int flags) {
    sqlite3* opened = nullptr;
    sqlite3_open_v2(name.c_str(), &opened, SQLITE_OPEN_READONLY | flags, "unix-none");
    if (opened == nullptr) throw std::bad_alloc{};
    database_.reset(opened);
    reject_short_reads(opened);
    // Otherwise, SQLite deletes an empty write-ahead log, which the recorder may still be using.
    int persists = 1;
    sqlite3_file_control(opened, "main", SQLITE_FCNTL_PERSIST_WAL, &persists);
    // Views and computed values need not end, or can be larger than the file.
    sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
    const std::uintmax_t longest = std::clamp<std::uintmax_t>(file_size_, 1U << 20U, whole_message);
    sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, static_cast<int>(longest));
    sqlite3_exec(opened, "PRAGMA locking_mode = EXCLUSIVE; PRAGMA writable_schema = ON", nullptr, nullptr, nullptr);
  }
  /// The URI by which SQLite opens a database as immutable.
  static std::string immutable(const std::string& path) {
    std::string address = "file:";
    for (const char c : path) {
      constexpr const char* digits = "0123456789ABCDEF";
      const auto code = static_cast<unsigned char>(c);
      if (c == '?' || c == '#' || c == '%')
        (address += '%') += {digits[code >> 4U], digits[code & 15U]};
      else
        address += c;
    }
    return address + "?immutable=1";
  }
  [[nodiscard]] statement prepare(const char* sql) const {
    sqlite3_stmt* made = nullptr;
    sqlite3_prepare_v2(database_.get(), sql, -1, &made, nullptr);
    return statement{made};
  }
  [[nodiscard]] std::string reason() const { return sqlite3_errmsg(database_.get()); }

  std::string path_;
  std::uintmax_t file_size_;  // including the write-ahead log and the journal
  std::unique_ptr<sqlite3, closer> database_;
};

}  // namespace

result<std::unique_ptr<bag_file>> open_sqlite_bag(const std::filesystem::path& path) {
  std::uintmax_t size = 0;
  for (const char* ending : {"", "-wal", "-journal"}) {
    std::error_code error;
    const std::string file = path.string() + ending;
    const auto status = std::filesystem::status(file, error);
    if (!std::filesystem::exists(status)) continue;
    if (!std::filesystem::is_regular_file(status)) return fail(errc::unreadable, file, "is not a regular file");
    if (const std::uintmax_t more = std::filesystem::file_size(file, error); !error) size += more;
  }
  auto bag = std::make_unique<sqlite_bag>(path.string(), size);
  if (auto opened = bag->open(); !opened) return fail(opened.error());
  return bag;
}
#else
result<std::unique_ptr<bag_file>> open_sqlite_bag(const std::filesystem::path& path) {
  return fail(errc::unsupported, path.string(),
              "is an SQLite database, for which this build has no library (libsqlite3-dev)");
}
#endif

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/bag_file.hpp"

#include <algorithm>
#include <string_view>
#include <tuple>
#include <utility>

#include <orbis/core/file.hpp>

#include "inputs/decompression.hpp"

namespace app {
namespace {

namespace fs = std::filesystem;
using orbis::errc;
using orbis::fail;
using orbis::result;

constexpr std::string_view rosbag1_magic = "#ROSBAG V2.0\n", mcap_magic = "\x89MCAP0\r\n",
                           sqlite_magic{"SQLite format 3\0", 16};

std::string first_bytes(const fs::path& path) {
  auto file = byte_source::open(path);
  return file ? file->read(0, 16) : std::string{};
}

bool has_magic(std::string_view first) {
  return first.starts_with(rosbag1_magic) || first.starts_with(mcap_magic) || first.starts_with(sqlite_magic);
}

bool has_bag_name(const fs::path& path) {
  const std::string name = path.filename().string();
  return std::ranges::any_of(
      std::initializer_list<std::string_view>{".bag", ".bag.active", ".mcap", ".db3", ".mcap.zstd", ".db3.zstd"},
      [&](std::string_view ending) { return name.ends_with(ending); });
}

/// The bag files in a folder, sorted by name, excluding compressed files that also exist uncompressed.
std::vector<fs::path> parts_in(const fs::path& folder) {
  std::vector<fs::path> parts;
  std::error_code error;
  for (fs::directory_iterator i{folder, error}, end; !error && i != end; i.increment(error))
    if (i->is_regular_file(error) && has_bag_name(i->path())) parts.push_back(i->path());
  std::ranges::sort(parts, [](const fs::path& a, const fs::path& b) {  // x_9 before x_10
    const std::string x = a.string(), y = b.string();
    return std::pair{x.size(), x} < std::pair{y.size(), y};
  });
  std::erase_if(parts, [&](const fs::path& p) {
    return p.extension() == ".zstd" && fs::exists(fs::path{p}.replace_extension(), error);
  });
  return parts;
}

/// The file names listed in metadata.yaml: the items of `relative_file_paths`, one per line or as `[a, b]`.
std::vector<std::string> listed_in(const std::string& metadata) {
  std::vector<std::string> names;
  const auto add = [&](std::string_view item) {
    std::string name{item};
    std::erase_if(name, [](char c) { return c == '"' || c == '\'' || c == '\r' || c == '\n'; });
    name.erase(0, name.find_first_not_of(' '));
    name.erase(name.find_last_not_of(' ') + 1);
    if (!name.empty()) names.push_back(fs::path{name}.filename().string());  // old versions include the folder
  };
  bool is_list = false;
  for (std::size_t at = 0; at < metadata.size();) {
    const std::size_t end = std::min(metadata.find('\n', at), metadata.size());
    const std::string_view line = std::string_view{metadata}.substr(at, end - at);
    const std::size_t begin = at;
    at = end + 1;
    const std::size_t dash = line.find_first_not_of(' ');
    if (line.find("relative_file_paths:") != std::string_view::npos) {
      is_list = true;
      const std::size_t open = metadata.find('[', begin), close = metadata.find(']', begin);
      if (open >= end || close == std::string::npos) continue;
      for (std::size_t from = open + 1, to = 0; from < close; from = to + 1) {
        to = std::min(metadata.find(',', from), close);
        add(std::string_view{metadata}.substr(from, to - from));
      }
      return names;
    } else if (is_list && dash != std::string_view::npos && line.substr(dash).starts_with("- ")) {
      add(line.substr(dash + 2));
    } else if (dash != std::string_view::npos) {
      is_list = false;
    }
  }
  return names;
}

result<std::unique_ptr<bag_file>> open_part(const fs::path& path) {
  auto file = byte_source::open(path);
  if (!file) return fail(file.error());
  const std::string first = file->read(0, 16);
  if (first.starts_with(rosbag1_magic)) return open_rosbag1(*std::move(file), path.string());
  if (first.starts_with(mcap_magic)) return open_mcap(*std::move(file), path.string());
  if (first.starts_with(sqlite_magic)) return open_sqlite_bag(path);
  if (is_zstd(first))
    return fail(errc::unsupported, path.string(),
                "is compressed as a whole; decompress it first: zstd -d " + path.filename().string());
  return fail(errc::malformed, path.string(), "is not a readable bag: it is neither a ROS 1 bag, nor MCAP, nor SQLite");
}

}  // namespace

std::string ros1_type(std::string_view type) {
  std::string name{type};
  if (const std::size_t at = name.find("/msg/"); at != std::string::npos) name.erase(at, 4);
  return name;
}

bool is_depth_unit(std::string_view name, std::string_view type) {
  return type == "std_msgs/Float32" &&
         (name.ends_with("/option/Depth Units/value") || name.ends_with("/option/Depth_Units/value"));
}

bool is_listed(std::string_view name, std::string_view type) {
  constexpr std::string_view types[] = {"sensor_msgs/Image",
                                        "sensor_msgs/CompressedImage",
                                        "sensor_msgs/CameraInfo",
                                        "tf2_msgs/TFMessage",
                                        "tf/tfMessage",
                                        "nav_msgs/Odometry",
                                        "geometry_msgs/PoseStamped",
                                        "geometry_msgs/PoseWithCovarianceStamped"};
  return std::ranges::find(types, type) != std::end(types) || is_depth_unit(name, type);
}

bag_topic& topic_like(std::vector<bag_topic>& topics, const bag_topic& t) {
  const auto same = std::ranges::find_if(topics, [&](const bag_topic& other) {
    return std::tie(other.name, other.type, other.coding) == std::tie(t.name, t.type, t.coding);
  });
  return same != topics.end() ? *same : topics.emplace_back(bag_topic{t.name, t.type, t.coding, {}});
}

std::string count_messages(const std::vector<bag_topic>& topics) {
  std::size_t count = 0;
  for (const bag_topic& t : topics) count += t.messages.size();
  return std::to_string(count) + (count == 1 ? " message" : " messages");
}

bool is_bag(const fs::path& path) {
  std::error_code error;
  if (fs::is_regular_file(path, error)) return has_bag_name(path) || has_magic(first_bytes(path));
  if (!fs::is_directory(path, error)) return false;
  if (const auto metadata = orbis::read_file(path / "metadata.yaml"))
    if (metadata->find("rosbag2_bagfile_information") != std::string::npos) return true;
  bool any = false;
  for (fs::directory_iterator i{path, error}, end; !error && i != end; i.increment(error)) {
    const std::string name = i->path().filename().string();
    if (has_bag_name(i->path()))
      any = true;
    else if (name != "metadata.yaml" && !name.ends_with("-wal") && !name.ends_with("-shm") &&
             !name.ends_with("-journal"))
      return false;
  }
  return any;
}

result<bag> bag::open(const fs::path& path) {
  bag all;
  std::error_code error;
  all.files = {path};
  if (fs::is_directory(path, error)) {
    all.files = parts_in(path);
    if (all.files.empty())
      return fail(errc::no_data, path.string(), "the folder of the bag contains no .db3 or .mcap file");
    const auto metadata = orbis::read_file(path / "metadata.yaml");
    const std::vector<std::string> listed = metadata ? listed_in(*metadata) : std::vector<std::string>{};
    if (listed.empty())
      all.notes.push_back("metadata.yaml is missing or damaged; all bag files in the folder are read");
    // A listed name may have the extension of the compressed file although the file has been decompressed.
    const auto is_listed_as = [](const std::string& name) {
      return [name](const fs::path& file) {
        const std::string found = file.filename().string();
        return found == name || found + ".zstd" == name || found == name + ".zstd";
      };
    };
    std::vector<fs::path> known;
    for (const std::string& name : listed) {
      const auto file = std::ranges::find_if(all.files, is_listed_as(name));
      if (file != all.files.end())
        known.push_back(*file);
      else
        all.notes.push_back(name + ", listed in metadata.yaml, is missing");
    }
    if (!known.empty()) all.files = std::move(known);
  }
  for (const fs::path& file : all.files) {
    auto part = open_part(file);
    if (!part) {
      if (all.files.size() == 1 || part.error().code == errc::unsupported) return fail(part.error());
      all.notes.push_back(part.error().to_string());
      all.parts_.emplace_back();
      continue;
    }
    for (const std::string& note : (*part)->notes) all.notes.push_back(note);
    for (bag_topic& t : (*part)->topics) {
      for (bag_message& m : t.messages) m.file = static_cast<std::uint32_t>(all.parts_.size());
      std::vector<bag_message>& to = topic_like(all.topics, t).messages;
      if (to.empty())
        to = std::move(t.messages);
      else
        to.insert(to.end(), t.messages.begin(), t.messages.end());
    }
    (*part)->topics.clear();
    all.parts_.push_back(*std::move(part));
  }
  std::erase_if(all.topics, [](const bag_topic& t) { return t.messages.empty(); });
  for (bag_topic& t : all.topics) std::ranges::stable_sort(t.messages, {}, [](const bag_message& m) { return m.time; });
  return all;
}

result<std::string> bag::read(const bag_message& m, std::size_t most) {
  if (last_ != m.file && parts_[last_]) parts_[last_]->rest();
  last_ = m.file;
  auto bytes = parts_[m.file]->read(m, most);
  if (!bytes || !is_zstd(*bytes)) return bytes;  // only compressed messages begin like this
  if (most != whole_message) bytes = parts_[m.file]->read(m, whole_message);
  if (!bytes) return bytes;
  auto plain = decompress("zstd", *bytes, most, files[m.file].string());
  if (!plain) return fail(plain.error());
  if (!plain->is_complete) return fail(errc::malformed, files[m.file].string(), "a compressed message is damaged");
  return std::move(plain->bytes);
}

}  // namespace app

// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as an MCAP file or a ROS 1 bag: its messages are listed and read. Databases are left out: SQLite reads
// them.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "fuzz/target.hpp"
#include "rgbd_slam/inputs/bag_file.hpp"

namespace {

using namespace orbis;

void check(std::string bytes) {
  const std::size_t size = bytes.size();
  const bool is_mcap = bytes.starts_with("\x89MCAP");
  result<std::unique_ptr<app::bag_file>> bag = fail(errc::no_data, "", "");
  // A decompressed chunk takes memory in proportion to its contents, of which Zstandard and bzip2 make many times their
  // bytes: up to 100 kB of 4, and 900 kB of 40.
  const std::size_t most_bytes = (std::size_t{1} << 20U) + 65536 * size;
  const std::size_t peak = fuzz::peak_bytes_of([&] {
    app::byte_source file{std::move(bytes)};
    bag = is_mcap ? app::open_mcap(std::move(file), "fuzz.bag") : app::open_rosbag1(std::move(file), "fuzz.bag");
  });
  fuzz::require(peak <= most_bytes, "a bag takes memory in proportion to its bytes");
  if (!bag) {
    fuzz::require(bag.error().code == errc::unsupported, "only an unknown compression prevents reading");
    fuzz::require(bag.error().to_string().size() < 300, "the reason is short");
    return;
  }
  std::size_t count = 0;
  for (const app::bag_topic& t : (*bag)->topics) {
    fuzz::require(app::is_listed(t.name, t.type), "only some types are listed");
    for (const app::bag_message& m : t.messages) {
      if (++count > 1000) return;
      const auto message = (*bag)->read(m, app::whole_message);
      if (!message) continue;
      fuzz::accept();
      const auto part = (*bag)->read(m, 16);
      fuzz::require(part && *part == message->substr(0, 16), "a part of a message is its beginning");
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  check({reinterpret_cast<const char*>(data), size});
  return 0;
}

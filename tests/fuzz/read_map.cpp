// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as the file of a SLAM map: as they are, and with their checksums put right, so that what lies
// behind those is tried too. What can be read is whole, is written and read again, and can be worked on.
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/slam/detail/map/file_sections.hpp>
#include <orbis/slam/map_file.hpp>

#include "fuzz/target.hpp"
#include "support/validate.hpp"

namespace {

using namespace orbis;

[[nodiscard]] std::string resealed(std::string file) {
  constexpr std::size_t head = slam::detail::section_head, tail = slam::detail::section_tail;
  for (std::size_t at = 12; at + head + tail <= file.size();) {
    const auto length = load_number<std::uint64_t>(file.data() + at + 4);
    if (length > file.size() - at - head - tail) break;
    const std::size_t size = head + static_cast<std::size_t>(length);
    std::string sum;
    slam::detail::put(sum, crc32c(std::as_bytes(std::span{file}).subspan(at, size)));
    file.replace(at + size, tail, sum);
    at += size + tail;
  }
  return file;
}

void check(const std::string& file) {
  std::optional<result<slam::map>> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(slam::parse_map(std::as_bytes(std::span{file}))); });
  fuzz::require(peak <= 64 * 1024 + 512 * file.size(), "memory in proportion to the file");
  if (!*got) {
    const error& e = got->error();
    fuzz::require(e.code == errc::malformed || e.code == errc::unsupported,
                  "a damaged file is malformed or unsupported");
    fuzz::require(!e.message.empty() && e.to_string().size() < 300, "the reason is given, and short");
    return;
  }
  fuzz::accept();
  slam::map& m = **got;
  const auto whole = test::validate(m);
  fuzz::require(whole.has_value(), whole ? "" : whole.error().to_string().c_str());
  const std::string written = slam::map_bytes(m);
  const auto again = slam::parse_map(std::as_bytes(std::span{written}));
  fuzz::require(again && slam::map_bytes(*again) == written, "what was read is written and read to the same bytes");
  for (slam::landmark_id l = m.next_landmark(0); l < m.landmark_end(); l = m.next_landmark(l + 2)) m.update_landmark(l);
  std::vector<slam::keyframe_id> there;
  for (const auto& k : m.keyframes()) there.push_back(k.id);
  for (const slam::keyframe_id k : there)
    if (k.value() % 2 == 0) m.erase_keyframe(k);
  for (const auto& k : m.keyframes())
    for (std::uint32_t i = 0; i != k.size(); ++i)
      if (k.landmarks[i] == slam::no_id && k.has_depth(i)) m.add_landmark(k.id, i);
  fuzz::require(test::validate(m).has_value(), "a map that was read stays whole");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string file{reinterpret_cast<const char*>(data), size};
  check(file);
  check(resealed(file));
  return 0;
}

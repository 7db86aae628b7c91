// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a list of images, and as a list of pairs of them.
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/io/detail/recordings/tum.hpp>

#include "fuzz/target.hpp"

namespace {

using namespace orbis;

template <class Parse>
void check(std::string_view text, Parse&& parse) {
  std::vector<std::string> notes;
  std::optional<decltype(parse(text, "fuzz.txt", notes))> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(parse(text, "fuzz.txt", notes)); });
  fuzz::require(peak <= 16384 + 256 * text.size(), "memory in proportion to the file");
  fuzz::require(notes.size() < 20, "many lines make few notes");
  if (!*got) {
    fuzz::require(got->error().code == errc::no_data && got->error().where.starts_with("fuzz.txt"),
                  "a list without images");
    return;
  }
  fuzz::accept();
  fuzz::require(!(*got)->empty(), "a list that is read names images");
  double last = -INFINITY;
  for (const auto& entry : **got) {
    fuzz::require(std::isfinite(entry.timestamp) && entry.timestamp > last, "images are in the order of time");
    last = entry.timestamp;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  check(text, [](std::string_view list, const auto& path, auto& notes) {
    return io::detail::parse_image_list(list, path, "folder", notes);
  });
  check(text, [](auto&&... a) { return io::detail::parse_associations(a...); });
  return 0;
}

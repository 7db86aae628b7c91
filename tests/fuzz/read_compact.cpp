// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a compact map file: as they are, and with their checksums put right, so that what lies
// behind those is tried too. Of values of several types; a file has one of them.
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <orbis/octree/compact_file.hpp>

#include "fuzz/octree.hpp"

namespace {

using namespace orbis;

[[nodiscard]] std::string resealed(std::string file) {
  constexpr std::size_t frame = 16;
  for (std::size_t at = 12; at + frame <= file.size();) {
    std::string_view length{file.data() + at + 4, 8};
    const auto content = octree::detail::take<std::uint64_t>(length);
    if (content > file.size() - at - frame) break;
    const std::size_t end = at + 12 + static_cast<std::size_t>(content);
    std::string sum;
    octree::detail::put(sum, crc32c(std::as_bytes(std::span{file}).subspan(at, end - at)));
    file.replace(end, 4, sum);
    at = end + 4;
  }
  return file;
}

void check_error(const error& e) {
  fuzz::require(e.code == errc::malformed || e.code == errc::unsupported, "a damaged file is malformed or unsupported");
  fuzz::require(!e.message.empty() && e.to_string().size() < 300, "the reason is given, and short");
}

template <class Model>
void check(std::span<const std::byte> bytes, const octree::compact_info& info) {
  using map = octree::occupancy_octree<Model>;
  std::optional<result<map>> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(octree::read_compact<Model>(bytes)); });
  fuzz::require(peak <= 512 * 1024 + 4096 * bytes.size(), "memory in proportion to the file");
  if (!*got) return check_error(got->error());
  const map& m = **got;
  fuzz::require(m.tree_depth() == info.tree_depth && m.resolution() == info.resolution,
                "the map has the depth and the resolution of the header");
  for (const bool occupancy_only : {false, true}) {
    const std::string file = octree::compact_bytes(m, {.occupancy_only = occupancy_only});
    const auto again = octree::read_compact<Model>(fuzz::bytes_of(file));
    fuzz::require(again && again->tree_depth() == m.tree_depth() && again->resolution() == m.resolution(),
                  "what was read can be written and read again");
    fuzz::require(octree::compact_bytes(*again, {.occupancy_only = occupancy_only}) == file, "to the same bytes");
    const auto head = octree::read_compact_info(fuzz::bytes_of(file));
    fuzz::require(head && head->value == octree::detail::compact_value_of<typename Model::value_type> &&
                      head->occupancy_only == occupancy_only && head->resolution == m.resolution(),
                  "and its header says what it is");
    if constexpr (octree::octomap_model<Model>) {
      if (m.tree_depth() != octree::default_tree_depth) continue;
      fuzz::require(octree::bt_bytes(*again) == octree::bt_bytes(m) || occupancy_only, "with the same .bt file");
      fuzz::require(occupancy_only || octree::ot_bytes(*again) == octree::ot_bytes(m), "with the same .ot file");
    }
  }
}

void check(std::span<const std::byte> bytes) {
  std::optional<result<octree::compact_info>> info;
  const std::size_t peak = fuzz::peak_bytes_of([&] { info.emplace(octree::read_compact_info(bytes)); });
  fuzz::require(peak <= 4096, "a header takes little memory");
  if (!*info) {
    check_error(info->error());
    fuzz::require(!octree::read_compact(bytes), "a map without a header is not read");
    return;
  }
  fuzz::require(std::isfinite((*info)->resolution) && (*info)->resolution > 0.0, "a resolution is above zero");
  check<octree::log_odds<>>(bytes, **info);
  check<octree::log_odds<double>>(bytes, **info);
  check<octree::log_odds<std::int16_t>>(bytes, **info);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  check(std::as_bytes(std::span{data, size}));
  const std::string sealed = resealed(std::string{reinterpret_cast<const char*>(data), size});
  check(fuzz::bytes_of(sealed));
  return 0;
}

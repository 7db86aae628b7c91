// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of map_file.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <orbis/core/bytes.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/slam/detail/map/file_sections.hpp>
#include <orbis/slam/detail/map/map_reader.hpp>
#include <orbis/slam/detail/map/map_writer.hpp>
#include <orbis/slam/map_file.hpp>

namespace orbis::slam {

ORBIS_INLINE std::string map_bytes(const map& m) { return detail::write_sections(m); }

ORBIS_INLINE result<map> parse_map(std::span<const std::byte> bytes, const std::string& where) {
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  constexpr std::size_t head = detail::map_magic.size() + sizeof(detail::map_version);
  if (text.substr(0, detail::map_magic.size()) != detail::map_magic)
    return fail(errc::malformed, where, "not a map of orbis: it does not begin with \"orbismap\"");
  if (text.size() < head) return fail(errc::malformed, where, "ends before its version");
  const auto version = load_number<std::uint32_t>(text.data() + detail::map_magic.size());
  if (version == 0 || version > detail::map_version)
    return fail(errc::unsupported, where, "version " + std::to_string(version) + ", this reads versions 1 to 4");

  detail::map_reader::content parts;
  detail::map_reader read{parts, version};
  detail::section_finder next{text, head};
  using section = std::pair<std::string_view, bool (detail::map_reader::*)(detail::section_reader)>;
  for (const auto& [name, take] :
       {section{"size", &detail::map_reader::sizes}, section{"kfrm", &detail::map_reader::keyframes},
        section{"tree", &detail::map_reader::tree}, section{"land", &detail::map_reader::landmarks}}) {
    const auto content = next.find(name);
    if (!content) return fail(errc::malformed, where, next.problem());
    if (!(read.*take)(*content)) return fail(errc::malformed, where, std::move(read.problem));
  }
  if (!next.at_end()) return fail(errc::malformed, where, next.problem());
  return map{std::move(parts)};
}

ORBIS_INLINE result<map> read_map(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return parse_map(std::as_bytes(std::span{*bytes}), path.string());
}

ORBIS_INLINE result<void> write_map_bytes(const std::filesystem::path& path, const std::string& bytes) {
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}

ORBIS_INLINE result<void> write_map(const std::filesystem::path& path, const map& m) {
  return write_map_bytes(path, map_bytes(m));
}

}  // namespace orbis::slam

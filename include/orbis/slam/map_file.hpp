// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reading and writing of map files.
///
/// A file is little-endian; equal maps give equal bytes on every machine:
///
///     0   "orbismap"
///     8   version (u32), 4; versions 1 to 3 are read as well
///     12  the sections "size", "kfrm", "tree" and "land", each: its name (4 bytes), the length of its content (u64),
///         the content, CRC-32C of all three (u32)
///
/// Poses are tx ty tz qx qy qz qw (f64); ids are u32, ffffffff for none.
///
///     size  number of pyramid levels (u32), minimum number of shared landmarks per edge (u32), scale factor (f64),
///           number of ids assigned to keyframes (u32) and to landmarks (u32), sensor (u32: 1 RGB-D, 2 stereo, 3
///           monocular, 0 unknown), unit of length (u32: 1 metres, 0 arbitrary); version 1 has neither of the last two
///     kfrm  for each keyframe id, a byte. 0: it was erased; its replacement (id) and its pose relative to the
///           replacement. 1: timestamp (f64), frame index (u64), pose, number of keypoints (u32), and for each keypoint
///           x, y, size, angle, response (f32), octave (i32), depth (f32), x and y of the ray (f64; NaN without one),
///           descriptor (32 bytes). 2 (version 4): a run of forgotten ids; its length (u32, at least 1, this id
///           included)
///     tree  for each keyframe: parent (id), number of loop edges (u32), their other ends (ids)
///     land  for each landmark id the number of observations (u32). 0: it was erased; the id that replaced it, or none.
///           ffffffff (version 3): a run of erased ids without replacement; its length (u32, at least 1, this id
///           included). Otherwise position, normal (3 f64 each), minimum and maximum distance (f64), descriptor (32
///           bytes), keyframe that created it (id), times visible, times found (u32 each), a byte that is 1 if the
///           descriptor is current, and the observations: keyframe (id), keypoint (u32)
///
/// A file has at most 2^28 ids each of keyframes and landmarks. If a map has assigned more landmark ids, the erased
/// ones are not written: its landmarks get new ids when it is read.
///
/// The covisibility graph and the grids of keypoints are not stored: they are rebuilt from the other data.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam {

/// Returns the content of a map file as bytes. O(map).
ORBIS_LAZY [[nodiscard]] std::string map_bytes(const map& m);

/// Parses the map in `bytes`; `where` names the source in errors. The returned map is consistent for any input. Errors:
/// `malformed` (with the section and the problem), `unsupported` (another version).
ORBIS_LAZY [[nodiscard]] result<map> parse_map(std::span<const std::byte> bytes, const std::string& where = "bytes");

/// Reads a map from a file. Errors: `not_found`, `unreadable`, and those of `parse_map`.
ORBIS_LAZY [[nodiscard]] result<map> read_map(const std::filesystem::path& path);

/// Writes the result of `map_bytes` to a file; an existing file is replaced only after everything is written. Errors:
/// `write_failed`.
ORBIS_LAZY [[nodiscard]] result<void> write_map_bytes(const std::filesystem::path& path, const std::string& bytes);

/// Writes a map to a file, like `write_map_bytes`. Errors: `write_failed`.
ORBIS_LAZY [[nodiscard]] result<void> write_map(const std::filesystem::path& path, const map& m);

}  // namespace orbis::slam

#ifndef ORBIS_COMPILED
#include <orbis/slam/map_file-inl.hpp>
#endif

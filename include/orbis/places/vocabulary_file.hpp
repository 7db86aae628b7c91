// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Vocabulary files, which have the layout of the tree in memory: a million words are read in milliseconds.
///
/// A file is little-endian; the same vocabulary gives the same bytes on every machine:
///
///     0   "orbisvoc"
///     8   version (u32), 1
///     12  CRC-32C of all following bytes (u32)
///     16  descriptor bits, weighting (0 tf-idf, 1 tf, 2 idf, 3 binary), nodes including the root, number of nodes up
///         to the last one with children, words (u32 each)
///     36  zeros up to byte 64
///     64  the descriptors of all nodes except the root, level by level, the children of a node consecutively
///         the weights of the words (f32); the words are the leaves in that order
///         the number of children (u16) of each node up to the last one with children
///
/// The library orbis::compiled contains the functions for 256 bits; for other lengths, include vocabulary_file-inl.hpp.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/result.hpp>
#include <orbis/places/vocabulary.hpp>

namespace orbis::places {

/// The first eight bytes of a vocabulary file.
inline constexpr std::string_view vocabulary_magic = "orbisvoc";

/// Serialises a vocabulary in the file format.
template <std::size_t Bits>
[[nodiscard]] std::string vocabulary_bytes(const basic_vocabulary<Bits>& vocabulary);

/// Parses the vocabulary in `bytes`; `where` names the source in errors. Uses at most three times the memory of
/// `bytes`. Errors: malformed (with the reason), unsupported (another version or descriptor size).
template <std::size_t Bits = 256>
[[nodiscard]] result<basic_vocabulary<Bits>> parse_vocabulary(std::span<const std::byte> bytes,
                                                              const std::string& where = "bytes");

/// Reads a file directly into its final memory. Errors: not_found, unreadable, malformed, unsupported.
template <std::size_t Bits = 256>
[[nodiscard]] result<basic_vocabulary<Bits>> read_vocabulary(const std::filesystem::path& path);

/// Writes a file atomically. Errors: write_failed.
template <std::size_t Bits>
[[nodiscard]] result<void> write_vocabulary(const std::filesystem::path& path,
                                            const basic_vocabulary<Bits>& vocabulary);

}  // namespace orbis::places

#ifndef ORBIS_COMPILED
#include <orbis/places/vocabulary_file-inl.hpp>
#endif

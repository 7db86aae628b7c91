// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images of many keyframes in little memory: compressed without loss, and in a file where that is not enough.
///
/// @code
///   mapping::depth_store depths{{.memory_budget = 64 << 20, .spill_file = "depths.tmp"}};
///   if (auto kept = depths.put(frame, depth); !kept) report(kept.error());
///   if (auto got = depths.get(frame, again); !got) report(got.error());   // `again` equals `depth`
/// @endcode
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/mapping/detail/depth/depth_codec.hpp>
#include <orbis/mapping/detail/depth/spill_file.hpp>

namespace orbis::mapping {

struct depth_store_options {
  /// Of the compressed images in memory, bytes. What was used longest ago goes to the spill file first.
  std::size_t memory_budget = std::size_t{64} << 20U;
  /// A file that does not exist yet, in a folder that does. It is created when it is needed first, and loses its name
  /// at once: it vanishes with the store, or with the process. Empty: everything stays in memory.
  std::filesystem::path spill_file{};
};

/// Depth images by number, as they were put in, pixel by pixel.
///
/// An image takes .05 to .2 of its 16 bits a pixel, whether it comes from a real or from a simulated sensor, because a
/// depth camera that measures disparity has few distinct depths (`detail/depth/depth_codec.hpp`). An image of pure
/// noise stays as large as it is. Pixels are numbers: scale and meaning are the caller's. Depth in `float` metres is
/// not kept; its lowest bits are noise, which does not compress.
///
/// Any number of threads may call const members, `get` among them, as long as none calls another one. May be moved.
class depth_store {
 public:
  explicit depth_store(depth_store_options options = {})
      : memory_budget_{options.memory_budget}, file_{options.spill_file} {
    if (!options.spill_file.empty()) spills_ = true;
  }

  /// Keeps `depth` under the number `frame`, in place of the image that was there. Error: write_failed, where an image
  /// had to go to the spill file and could not: the disk is full, the folder is not there, or the file exists already.
  /// Nothing is lost then: this image and the others are kept, in memory and beyond the budget, and the next call tries
  /// again. Linear in the pixels, about 2 ms for 640 x 480.
  result<void> put(std::uint64_t frame, image_view<const std::uint16_t> depth) {
    return put(frame, depth, encoder_.encode(depth));
  }

  /// Compresses images for `put`, so that several threads can, each with a packer of its own. Keeps about 2 bytes a
  /// pixel and 130 kB.
  class packer {
   public:
    packer() = default;
    packer(packer&&) noexcept = default;  // a copy would refer to this one's bytes
    packer& operator=(packer&&) noexcept = default;
    /// O(pixels).
    void pack(image_view<const std::uint16_t> depth) { packed_ = encoder_.encode(depth); }
    /// On the heap.
    [[nodiscard]] std::size_t bytes() const noexcept { return encoder_.bytes(); }

   private:
    friend class depth_store;
    detail::depth_encoder encoder_;
    std::span<const std::byte> packed_;
  };
  /// The same with an image that was just packed. @pre packed.pack(depth) was its last call
  result<void> put(std::uint64_t frame, image_view<const std::uint16_t> depth, const packer& packed) {
    return put(frame, depth, packed.packed_);
  }

  /// Copies the image of `frame` to `out`, whose size changes to the image's. An image in the file stays there.
  /// Errors: not_found; unreadable or malformed, where the spill file fails or is damaged (`out` is empty then).
  /// Linear in the pixels, about 1 ms for 640 x 480.
  result<void> get(std::uint64_t frame, image<std::uint16_t>& out) const {
    const auto at = entries_.find(frame);
    if (at == entries_.end()) return fail(errc::not_found, name(frame), "there is no depth image of it");
    const entry& e = at->second;
    std::atomic_ref{e.last_use}.store(std::atomic_ref{uses_}.fetch_add(1) + 1);
    if (out.width() != e.width || out.height() != e.height) out = image<std::uint16_t>(e.width, e.height);
    detail::depth_decoder decoder;
    result<void> done;
    if (e.spilled) {
      const auto bytes = file_.read(*e.spilled);
      done = bytes ? decoder.decode(*bytes, out.view()) : result<void>{fail(bytes.error())};
    } else {
      done = decoder.decode(e.in_memory, out.view());
    }
    if (done) return done;
    out = {};
    error why = done.error();
    why.where = name(frame) + ", " + why.where;
    return fail(std::move(why));
  }

  /// Forgets the image of `frame`; false where there is none.
  bool erase(std::uint64_t frame) {
    const auto at = entries_.find(frame);
    if (at == entries_.end()) return false;
    bytes_in_memory_ -= at->second.in_memory.size();
    if (const auto& record = at->second.spilled) {
      bytes_spilled_ -= record->size;
      file_.erase(*record);
    }
    entries_.erase(at);
    return true;
  }

  [[nodiscard]] bool contains(std::uint64_t frame) const { return entries_.contains(frame); }
  /// Frees the memory that `put` works in; the next call of it gets it again.
  void free_buffers() { encoder_ = {}; }
  /// How many images there are.
  [[nodiscard]] std::size_t size() const noexcept { return entries_.size(); }
  /// Of the compressed images that are in memory.
  [[nodiscard]] std::size_t bytes_in_memory() const noexcept { return bytes_in_memory_; }
  /// Of the compressed images that are in the spill file.
  [[nodiscard]] std::size_t bytes_spilled() const noexcept { return bytes_spilled_; }

 private:
  struct entry {
    int width = 0, height = 0;
    std::vector<std::byte> in_memory;  // empty once it is spilled
    std::optional<detail::spill_file::record> spilled{};
    alignas(8) mutable std::uint64_t last_use = 0;
  };
  struct use {
    std::uint64_t when, frame;
  };

  result<void> put(std::uint64_t frame, image_view<const std::uint16_t> depth, std::span<const std::byte> packed) {
    erase(frame);
    entry& e = entries_[frame];
    e.width = depth.width();
    e.height = depth.height();
    e.in_memory.assign(packed.begin(), packed.end());
    e.last_use = ++uses_;
    bytes_in_memory_ += e.in_memory.size();
    return keep_budget();
  }
  [[nodiscard]] static std::string name(std::uint64_t frame) { return "frame " + std::to_string(frame); }

  result<void> keep_budget() {
    while (spills_ && bytes_in_memory_ > memory_budget_) {
      if (oldest_.empty()) list_uses();
      const use next = oldest_.back();
      const auto at = entries_.find(next.frame);
      if (at != entries_.end() && !at->second.spilled && at->second.last_use == next.when) {
        entry& e = at->second;
        auto record = file_.write(e.in_memory);
        if (!record) return fail(std::move(record.error()));
        bytes_in_memory_ -= e.in_memory.size();
        bytes_spilled_ += e.in_memory.size();
        e.spilled = *record;
        std::vector<std::byte>{}.swap(e.in_memory);
      }
      oldest_.pop_back();
    }
    return {};
  }
  /// What was used after the list was made is younger than all that is in it.
  void list_uses() {
    for (const auto& [frame, e] : entries_)
      if (!e.spilled) oldest_.push_back({e.last_use, frame});
    std::sort(oldest_.begin(), oldest_.end(), [](const use& a, const use& b) { return a.when > b.when; });
  }

  std::size_t memory_budget_;
  detail::spill_file file_;
  bool spills_ = false;
  detail::depth_encoder encoder_;
  std::unordered_map<std::uint64_t, entry> entries_;
  std::vector<use> oldest_;  // of some time ago, the oldest at the back; looked through before a new one is made
  std::size_t bytes_in_memory_ = 0, bytes_spilled_ = 0;
  alignas(8) mutable std::uint64_t uses_ = 0;
};

}  // namespace orbis::mapping

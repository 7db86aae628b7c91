// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Compact store of the depth images of many keyframes: lossless compression, and a spill file beyond a budget.
///
/// @code
///   mapping::depth_store depths{{.memory_budget = 64 << 20, .spill_file = "depths.tmp"}};
///   if (auto kept = depths.put(frame, depth); !kept) report(kept.error());
///   if (auto got = depths.get(frame, again); !got) report(got.error());   // `again` equals `depth`
/// @endcode
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/mapping/detail/depth/depth_codec.hpp>
#include <orbis/mapping/detail/depth/spill_file.hpp>

namespace orbis::mapping {

struct depth_store_options {
  /// Memory budget for the compressed images in bytes, excluding masks, which stay in memory. The least recently used
  /// images are spilled first.
  std::size_t memory_budget = std::size_t{64} << 20U;
  /// Path of a file that does not exist yet, in an existing folder. The file is created when first needed and unlinked
  /// immediately, so that it is deleted with the store or when the process ends. Empty: everything stays in memory.
  std::filesystem::path spill_file{};
};

/// Stores depth images, indexed by frame, without loss.
///
/// An image from a real or simulated sensor takes 5 to 20 % of its original 16 bits per pixel, because a depth camera
/// that measures disparity produces few distinct depths (`detail/depth/depth_codec.hpp`). An image of pure noise is not
/// compressed. Pixels are plain numbers; the caller defines their scale and meaning. Depth in `float` metres is not
/// supported; its lowest bits are noise, which does not compress. Pixels can be removed later, and restored, without
/// compressing the image again.
///
/// Any number of threads may call const members, including `get`, while no thread calls a non-const member. Movable.
class depth_store {
 public:
  explicit depth_store(const depth_store_options& options = {});
  depth_store(depth_store&&) noexcept;
  depth_store& operator=(depth_store&&) noexcept;
  ~depth_store();

  /// Stores `depth` for `frame`, and replaces an existing image of this frame. Error: write_failed if an image could
  /// not be written to the spill file: the disk is full, the folder does not exist, or the file exists already. In that
  /// case nothing is lost: this image and the others stay in memory, beyond the budget, and the next call tries again.
  /// Linear in the number of pixels, about 1.3 ms for 640 x 480.
  ORBIS_LAZY result<void> put(std::uint64_t frame, image_view<const std::uint16_t> depth);

  /// Removes the pixels that are 0 in `depth` from the image of `frame`, in place of those removed by an earlier call.
  /// Only the runs of pixels without depth are stored; they stay in memory and do not count towards the budget. Errors:
  /// not_found; invalid_argument if the size of `depth` differs from that of the image. Linear in the number of pixels,
  /// about 0.2 ms for 640 x 480.
  /// @pre the other pixels of `depth` are those of the image
  ORBIS_LAZY result<void> mask(std::uint64_t frame, image_view<const std::uint16_t> depth);

  /// Copies the image of `frame`, with 0 in removed pixels, to `out`, which is resized to the size of the image. A
  /// spilled image stays in the file. Errors: not_found; unreadable or malformed if the spill file fails or is damaged
  /// (`out` is then empty). Linear in the number of pixels, about 1 ms for 640 x 480.
  ORBIS_LAZY result<void> get(std::uint64_t frame, image<std::uint16_t>& out) const;
  /// Like `get`, but includes the removed pixels.
  ORBIS_LAZY result<void> get_whole(std::uint64_t frame, image<std::uint16_t>& out) const;

  /// Removes the image of `frame`. Returns false if there is none.
  ORBIS_LAZY bool erase(std::uint64_t frame);

  [[nodiscard]] bool contains(std::uint64_t frame) const;
  /// Frees the buffers of `put`; the next call to `put` allocates them again.
  void free_buffers();
  /// Number of images.
  [[nodiscard]] std::size_t size() const noexcept { return entries_.size(); }
  /// Size of the compressed images in memory, and of the masks: the runs of pixels without depth.
  [[nodiscard]] std::size_t bytes_in_memory() const noexcept { return bytes_in_memory_ + bytes_of_masks_; }
  /// Size of the compressed images in the spill file.
  [[nodiscard]] std::size_t bytes_spilled() const noexcept { return bytes_spilled_; }

 private:
  struct entry {
    int width = 0, height = 0;
    std::vector<std::byte> in_memory;  // empty once it is spilled
    std::optional<detail::spill_file::record> spilled{};
    std::vector<std::byte> zeros{};  // see detail::encode_zeros; empty: no pixel is removed
    alignas(8) mutable std::uint64_t last_use = 0;
  };
  struct use {
    std::uint64_t when, frame;
  };

  ORBIS_LAZY [[nodiscard]] result<void> decode(const entry& e, image<std::uint16_t>& out) const;
  /// Returns true if every pixel is 0 or equals that of the image, or if the image cannot be read. Does not count as
  /// a use of the image, so that the same images are spilled with and without assertions.
  ORBIS_LAZY [[nodiscard]] bool is_part_of_image(const entry& e, image_view<const std::uint16_t> depth) const;

  ORBIS_LAZY result<void> keep_budget();
  /// Lists the images in memory, the most recently used first. Images used later are more recent than all listed
  /// ones.
  ORBIS_LAZY void list_uses();

  std::size_t memory_budget_;
  detail::spill_file file_;
  bool spills_;
  detail::depth_encoder encoder_;
  std::unordered_map<std::uint64_t, entry> entries_;
  std::vector<use> oldest_;  // an earlier list of uses, the oldest last; exhausted before a new list is made
  std::size_t bytes_in_memory_ = 0, bytes_spilled_ = 0, bytes_of_masks_ = 0;
  alignas(8) mutable std::uint64_t uses_ = 0;
};

}  // namespace orbis::mapping

#ifndef ORBIS_COMPILED
#include <orbis/mapping/depth_store-inl.hpp>
#endif

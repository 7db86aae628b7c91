// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of depth_store.hpp.
#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstdint>
#include <string>
#include <utility>

#include <orbis/core/inline.hpp>
#include <orbis/mapping/depth_store.hpp>

namespace orbis::mapping {

namespace detail {

[[nodiscard]] ORBIS_INLINE std::string frame_name(std::uint64_t frame) { return "frame " + std::to_string(frame); }
[[nodiscard]] ORBIS_INLINE tl::unexpected<error> not_stored(std::uint64_t frame) {
  return fail(errc::not_found, frame_name(frame), "no depth image is stored for this frame");
}
[[nodiscard]] ORBIS_INLINE std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

}  // namespace detail

ORBIS_INLINE depth_store::depth_store(const depth_store_options& options)
    : memory_budget_{options.memory_budget}, file_{options.spill_file}, spills_{!options.spill_file.empty()} {}
ORBIS_INLINE depth_store::depth_store(depth_store&&) noexcept = default;
ORBIS_INLINE depth_store& depth_store::operator=(depth_store&&) noexcept = default;
ORBIS_INLINE depth_store::~depth_store() = default;

ORBIS_LAZY_INLINE result<void> depth_store::put(std::uint64_t frame, image_view<const std::uint16_t> depth) {
  const std::span<const std::byte> packed = encoder_.encode(depth);
  erase(frame);
  entry& e = entries_[frame];
  e.width = depth.width();
  e.height = depth.height();
  e.in_memory.assign(packed.begin(), packed.end());
  e.last_use = ++uses_;
  bytes_in_memory_ += e.in_memory.size();
  return keep_budget();
}

ORBIS_LAZY_INLINE result<void> depth_store::mask(std::uint64_t frame, image_view<const std::uint16_t> depth) {
  const auto at = entries_.find(frame);
  if (at == entries_.end()) return detail::not_stored(frame);
  const entry& e = at->second;
  if (depth.width() != e.width || depth.height() != e.height)
    return fail(errc::invalid_argument, detail::frame_name(frame),
                "the mask has " + detail::size_text(depth.width(), depth.height()) +
                    " pixels, but the depth image has " + detail::size_text(e.width, e.height));
  assert(is_part_of_image(e, depth));
  bytes_of_masks_ -= at->second.zeros.size();
  at->second.zeros = detail::encode_zeros(depth);
  bytes_of_masks_ += at->second.zeros.size();
  return {};
}

ORBIS_LAZY_INLINE result<void> depth_store::get(std::uint64_t frame, image<std::uint16_t>& out) const {
  auto done = get_whole(frame, out);
  if (done) detail::set_zeros(entries_.find(frame)->second.zeros, out.view());
  return done;
}

ORBIS_LAZY_INLINE result<void> depth_store::get_whole(std::uint64_t frame, image<std::uint16_t>& out) const {
  const auto at = entries_.find(frame);
  if (at == entries_.end()) return detail::not_stored(frame);
  const entry& e = at->second;
  std::atomic_ref{e.last_use}.store(std::atomic_ref{uses_}.fetch_add(1) + 1);
  auto done = decode(e, out);
  if (done) return done;
  out = {};
  error why = done.error();
  why.where = detail::frame_name(frame) + ", " + why.where;
  return fail(std::move(why));
}

ORBIS_LAZY_INLINE bool depth_store::erase(std::uint64_t frame) {
  const auto at = entries_.find(frame);
  if (at == entries_.end()) return false;
  bytes_in_memory_ -= at->second.in_memory.size();
  bytes_of_masks_ -= at->second.zeros.size();
  if (const auto& record = at->second.spilled) {
    bytes_spilled_ -= record->size;
    file_.erase(*record);
  }
  entries_.erase(at);
  return true;
}

ORBIS_INLINE bool depth_store::contains(std::uint64_t frame) const { return entries_.contains(frame); }

ORBIS_INLINE void depth_store::free_buffers() { encoder_ = {}; }

ORBIS_LAZY_INLINE result<void> depth_store::decode(const entry& e, image<std::uint16_t>& out) const {
  if (out.width() != e.width || out.height() != e.height) out = image<std::uint16_t>(e.width, e.height);
  detail::depth_decoder decoder;
  if (!e.spilled) return decoder.decode(e.in_memory, out.view());
  const auto bytes = file_.read(*e.spilled);
  return bytes ? decoder.decode(*bytes, out.view()) : result<void>{fail(bytes.error())};
}

ORBIS_LAZY_INLINE bool depth_store::is_part_of_image(const entry& e, image_view<const std::uint16_t> depth) const {
  image<std::uint16_t> whole;
  if (!decode(e, whole)) return true;
  for (int y = 0; y != depth.height(); ++y)
    for (int x = 0; x != depth.width(); ++x)
      if (depth(x, y) != 0 && depth(x, y) != whole(x, y)) return false;
  return true;
}

ORBIS_LAZY_INLINE result<void> depth_store::keep_budget() {
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

ORBIS_LAZY_INLINE void depth_store::list_uses() {
  for (const auto& [frame, e] : entries_)
    if (!e.spilled) oldest_.push_back({e.last_use, frame});
  std::sort(oldest_.begin(), oldest_.end(), [](const use& a, const use& b) { return a.when > b.when; });
}

}  // namespace orbis::mapping

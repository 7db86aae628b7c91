// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A depth_store that compresses in the background, so that tracking does not wait.
#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <optional>
#include <utility>

#include <orbis/mapping/depth_store.hpp>

#include "background.hpp"
#include "priority.hpp"

namespace app {

class background_depth_store {
 public:
  /// Without `in_background` images are compressed in the caller's thread.
  background_depth_store(orbis::mapping::depth_store_options options, bool in_background)
      : store_{std::move(options)}, background_{in_background} {}
  background_depth_store(const background_depth_store&) = delete;
  background_depth_store& operator=(const background_depth_store&) = delete;
  ~background_depth_store() {
    if (ahead_.valid()) ahead_.wait();
  }

  /// Copies the image; waits first if the previous one is not compressed yet.
  void put(std::uint64_t frame, const orbis::image<std::uint16_t>& depth) {
    finish();
    if (background_) {
      ahead_ = start_in_background([this, frame, copy = depth] {
        lower_priority(compression_niceness);
        keep(frame, copy);
      });
    }
    if (!ahead_.valid()) keep(frame, depth);
  }
  /// Waits for the last image. Rethrows an exception of its compression.
  void finish() {
    if (ahead_.valid()) ahead_.get();
  }

  /// See depth_store. @pre finish() was called after the last put, as for the functions below
  [[nodiscard]] orbis::result<void> get(std::uint64_t frame, orbis::image<std::uint16_t>& out) const {
    return store_.get(frame, out);
  }
  void erase(std::uint64_t frame) { store_.erase(frame); }
  void free_buffers() { store_.free_buffers(); }
  /// The error because of which images are in memory instead of the spill file; empty if there was none.
  [[nodiscard]] const std::optional<orbis::error>& unspilled() const { return unspilled_; }

 private:
  void keep(std::uint64_t frame, const orbis::image<std::uint16_t>& depth) {
    if (auto kept = store_.put(frame, depth); !kept) unspilled_ = kept.error();
  }

  orbis::mapping::depth_store store_;
  std::optional<orbis::error> unspilled_;
  bool background_;
  std::future<void> ahead_;
};

}  // namespace app

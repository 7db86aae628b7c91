// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Type-erased owner of a scan's buffers; scan_buffers.hpp defines them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <type_traits>

#include <orbis/core/execution.hpp>
#include <orbis/octree/detail/mark/rays/read_points.hpp>

namespace orbis::octree::detail {

/// Operations on buffers of unknown type.
struct scan_buffers_deleter {
  void (*destroy)(void*) = nullptr;
  std::size_t (*bytes)(const void*) = nullptr;

  void operator()(void* buffers) const { destroy(buffers); }
};

/// Owns the buffers of a scan, which are created on first use. A copy does not share the buffers but creates new ones.
class scan_scratch {
 public:
  scan_scratch() = default;
  scan_scratch(const scan_scratch&) noexcept {}
  scan_scratch(scan_scratch&&) noexcept = default;
  scan_scratch& operator=(const scan_scratch&) noexcept { return *this; }
  scan_scratch& operator=(scan_scratch&&) noexcept = default;
  ~scan_scratch() = default;

  /// Returns the buffers. `Buffers` is always scan_buffers, whose definition is not needed elsewhere.
  template <class Buffers>
  [[nodiscard]] Buffers& get() {
    if (!buffers_)
      buffers_ = {new Buffers,
                  {.destroy = [](void* b) { delete static_cast<Buffers*>(b); },
                   .bytes = [](const void* b) { return static_cast<const Buffers*>(b)->memory_bytes(); }}};
    return *static_cast<Buffers*>(buffers_.get());
  }
  /// Views a range of points, see point_reader.
  template <point_range Points>
  [[nodiscard]] point_view view(const Points& points) {
    return reader_.view(points);
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return reader_.memory_bytes() + (buffers_ ? buffers_.get_deleter().bytes(buffers_.get()) : 0);
  }

 private:
  std::unique_ptr<void, scan_buffers_deleter> buffers_;
  point_reader reader_;
};

/// Converts any policy to the type for which algorithms are compiled.
template <execution_policy Policy>
[[nodiscard]] parallel_policy as_parallel(const Policy& policy) {
  if constexpr (std::is_same_v<Policy, parallel_policy>)
    return policy;
  else
    return {.count = std::max(1U, static_cast<unsigned>(policy.threads()))};
}

}  // namespace orbis::octree::detail

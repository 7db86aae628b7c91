// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pool of reusable workspaces.
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace orbis::features::detail {

/// A pool of workspaces: a call acquires one and returns it. Concurrent calls use separate workspaces; sequential calls
/// reuse one. A workspace that is not returned (after an exception) is freed. Copies of the pool are empty.
template <class Workspace>
class kept_memory {
 public:
  kept_memory() = default;
  kept_memory(const kept_memory&) noexcept : kept_memory{} {}
  kept_memory& operator=(const kept_memory&) noexcept { return *this; }
  ~kept_memory() = default;

  [[nodiscard]] std::unique_ptr<Workspace> take() {
    {
      const std::lock_guard lock{mutex_};
      if (!stock_.empty()) {
        auto last = std::move(stock_.back());
        stock_.pop_back();
        return last;
      }
    }
    return std::make_unique<Workspace>();
  }
  void give(std::unique_ptr<Workspace> workspace) {
    const std::lock_guard lock{mutex_};
    stock_.push_back(std::move(workspace));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<Workspace>> stock_;
};

}  // namespace orbis::features::detail
